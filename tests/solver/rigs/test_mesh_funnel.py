"""A funnel from a mesh: its openings by closed form, its pour beside that of its cone, what is refused."""

import numpy as np
import pytest
import trimesh

from solver.params import ParameterError
from solver.pours.pour_key import pour_key
from solver.pours.record import Outcome
from solver.pours.run import run_pour
from solver.rigs import Funnel, MeshFunnel
from solver.scenes.material_file import load_material, with_set_up, with_settings
from solver.scenes.scene import parameters, with_values
from tests.explorer.beads import bead_scene

SECTIONS = 96
INSCRIBED = np.cos(np.pi / SECTIONS)
"""Inner over outer radius of the polygon that stands for a circle."""


def cone(outlet=30.0, inlet=114.0, height=130.0, wall=0.0, sections=SECTIONS):
    """A conical funnel in millimetres by its diameters; thin, or with a closed wall of ``wall`` outside."""
    line = [(outlet / 2, 0.0), (inlet / 2, height)]
    if wall:
        line = [*line, (inlet / 2 + wall, height), (outlet / 2 + wall, 0.0), line[0]]
    return trimesh.creation.revolve(line, sections=sections)


def exported(mesh):
    return mesh.export(file_type="stl")


def funnel(folder, mesh, **values):
    (folder / "own.stl").write_bytes(exported(mesh))
    return MeshFunnel(mesh=str(folder / "own.stl"), **values)


@pytest.mark.parametrize("wall", [0.0, 2.0])
@pytest.mark.parametrize("shift", [(0.0, 0.0, 0.0), (50.0, -20.0, 300.0)])
def test_a_cone_has_the_openings_of_its_circles_wherever_it_lies_in_its_file(tmp_path, wall, shift):
    mesh = cone(wall=wall)
    mesh.apply_translation(shift)
    placed = funnel(tmp_path, mesh).placed
    assert placed.height == pytest.approx(0.130, rel=1e-6)
    # The cuts are 0.5 % of the height away from the ends, where the cone is 0.21 mm wider or narrower.
    assert placed.outlet.nearest == pytest.approx(0.015 * INSCRIBED, abs=2.2e-4)
    assert placed.inlet.nearest == pytest.approx(0.057 * INSCRIBED, abs=2.2e-4)
    assert placed.outlet.farthest == pytest.approx(0.015 + 1e-3 * wall, abs=2.2e-4)
    assert placed.outlet.closed
    assert placed.inlet.closed
    assert placed.reach == pytest.approx(0.057 + 1e-3 * wall, rel=1e-6)


def test_the_shipped_hopper_is_what_its_name_says():
    """Square, 114 mm wide at its top, 110 mm above a chute of 20 mm that is 40 mm wide."""
    rig = MeshFunnel()
    _, hopper, gate = rig.surfaces()
    assert hopper.pose.origin == (0.0, 0.0, rig.outlet_height)
    corners = np.unique(np.round(np.array(hopper.vertices), 9), axis=0)
    expected = [(x * half, y * half, z) for half, z in ((0.02, 0.0), (0.02, 0.02), (0.057, 0.13))
                for x in (-1, 1) for y in (-1, 1)]  # fmt: skip
    np.testing.assert_allclose(corners, sorted(expected, key=lambda p: p), atol=1e-9)
    assert rig.placed.outlet.nearest == pytest.approx(0.02, rel=1e-6)
    # The gate covers the corners of the square.
    assert gate.r1 == pytest.approx(0.02 * np.sqrt(2.0), rel=1e-6)
    assert rig.feed().radius == pytest.approx(0.057, rel=5e-3)


def test_what_bodies_cannot_pass_is_refused(tmp_path):
    lying = cone()
    lying.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, (1, 0, 0)))
    offset = cone()
    top = offset.vertices[:, 2] > 100.0
    offset.vertices[top] += (200.0, 0.0, 0.0)
    for mesh, words in (
        (lying, "must be upright"),
        (offset, "its upper end"),
        (cone(outlet=4.0), "its outlet is 0.00.* m wide, too narrow"),
        (cone(inlet=900.0), "beyond rig.domain_half_width"),
    ):
        rig = funnel(tmp_path, mesh)
        with pytest.raises(ParameterError, match=words) as error:
            rig.check(widest_body=0.012)
        assert "\n" not in str(error.value)


def test_the_file_is_a_parameter_like_others(tmp_path):
    scene = with_settings(bead_scene(), {"rig.name": "mesh_funnel"})
    declared = parameters(scene)["rig.mesh"]
    assert not declared.is_number
    (tmp_path / "own.stl").write_bytes(exported(cone()))
    own = with_set_up(bead_scene(), {"rig": {"name": "mesh_funnel", "mesh": "own.stl"}}, tmp_path)
    assert own.rig.mesh == str(tmp_path / "own.stl")
    for value, words in (
        ("nowhere.stl", "nowhere.stl"),
        ("pyproject.toml", "ending in .stl"),
        (3.0, "shipped: square_hopper"),
    ):
        with pytest.raises(ParameterError, match=f"rig.mesh.*{words}"):
            with_values(scene, {"rig.mesh": value})
    # Another surface under the same name is another run.
    key = pour_key(own, 1)
    (tmp_path / "own.stl").write_bytes(exported(cone(outlet=32.0)))
    assert pour_key(own, 1) != key
    (tmp_path / "own.stl").unlink()
    with pytest.raises(ParameterError, match="neither a file"):
        own.rig.surfaces()


@pytest.mark.slow
@pytest.mark.usefixtures("taichi")
def test_a_pour_through_the_mesh_of_a_cone_is_that_through_the_cone(tmp_path):
    """Both come to rest with everything on the plate; mean times of discharge agree within 3.5 of their errors."""
    shipped = with_values(
        load_material("sunflower_extract"), {"body.spheres": "coarse", "rig.mass": "6g", "rig.outlet_diameter": "50mm"}
    )
    (tmp_path / "own.stl").write_bytes(exported(cone(outlet=50.0, sections=48)))
    meshed = with_settings(
        shipped, {"rig.name": "mesh_funnel", "rig.mesh": str(tmp_path / "own.stl"), "rig.mass": "6g"}
    )
    assert isinstance(shipped.rig, Funnel)
    t90 = {}
    for name, scene in (("cone", shipped), ("mesh", meshed)):
        records = [run_pour(scene, seed) for seed in (1, 2, 3, 4)]
        assert [record.ended[0] for record in records] == [Outcome.AT_REST] * 4
        t90[name] = []
        for record in records:
            assert record.trace.discharged_mass[-1] == pytest.approx(record.poured_mass)
            t90[name].append(np.interp(0.9 * record.poured_mass, record.trace.discharged_mass, record.trace.time))
    means = {name: np.mean(times) for name, times in t90.items()}
    # Six degrees of freedom within the groups: |t| beyond 3.5 in 1.3 % of cases; the seeds are fixed.
    within = np.sqrt(np.mean([np.var(times, ddof=1) for times in t90.values()]))
    assert abs(means["cone"] - means["mesh"]) < 3.5 * within * np.sqrt(2.0 / 4)
    assert within < 0.1
