"""A pour as VTK files, read back by the library that wrote them."""

import dataclasses
import sys
import xml.etree.ElementTree as ET

import numpy as np
import pytest
import trimesh

from explorer.errors import CommandError
from explorer.export.paraview import (
    PARAVIEW,
    PourState,
    collection,
    contact_grid,
    moments,
    rig_grid,
    shape_grid,
    write_paraview,
)
from explorer.export.target import ExportOrder
from explorer.scene.file import load_scene, with_settings
from solver.pours.contacts import Contacts
from solver.pours.record import Outcome
from tests.explorer.command_line import TINY, explorer, refused, settings


@pytest.fixture(scope="module")
def scene():
    return with_settings(load_scene("funnel"), [f"{path}={value}" for path, value in TINY.items()])


@pytest.fixture(scope="module")
def poured(taichi, scene):
    return moments(scene, 5, 0.02)


def with_contacts(moment):
    """The moment with two contacts made up: body 0 on body 1, body 1 on the first surface."""
    contacts = Contacts(
        np.array([0, 1]),
        np.array([1, -1]),
        np.array([[0.0, 0.0, 0.1], [0.0, 0.0, 0.0]]),
        np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.0]]),
        np.array([[0.003, 0.004, 0.012], [0.0, 0.0, 0.02]]),
    )
    return PourState(moment.time, moment.bodies, moment.spheres, contacts, moment.poses, moment.gate_shut)


def test_moments_come_at_their_times_and_the_last_one_is_the_end(poured):
    seen, record = poured
    times = [moment.time for moment in seen]
    assert times[-1] == pytest.approx(record.steps * record.dt)
    assert np.diff(times[:-1]) == pytest.approx(0.02, abs=0.0101)  # the next sample of the curves, 0.01 s apart
    assert seen[-1].bodies.position == pytest.approx(record.bodies.position)


def test_only_the_end_without_every(taichi, scene):
    seen, record = moments(scene, 5, None)
    assert len(seen) == 1
    assert seen[0].bodies.position == pytest.approx(record.bodies.position)


def test_too_many_moments_are_refused(scene):
    with pytest.raises(CommandError, match=r"--every 0\.001: more than 2000 moments"):
        moments(with_settings(scene, ["numerics.sample_interval=1ms", "numerics.max_time=8s"]), 5, 1e-3)


def test_a_duration_ends_the_moments(taichi, scene):
    short = with_settings(scene, ["numerics.max_time=8s", "numerics.duration=0.03s", "insertion.rate=1kg/s"])
    seen, _ = moments(short, 5, 0.003)
    assert 2 < len(seen) < 6


def test_shapes_have_the_volume_of_their_bodies(poured, scene):
    moment = poured[0][-1]
    points, kind, faces, _, at_cells = shape_grid(scene, moment)
    assert kind == "triangle"
    for k, component in enumerate(moment.bodies.component):
        mesh = trimesh.Trimesh(points, faces[at_cells["body"] == k])
        mesh.merge_vertices()
        body = scene.bodies[component]
        assert mesh.is_watertight
        volume = body.mass / scene.material(body.material).density
        assert mesh.volume == pytest.approx(volume, rel=0.05)  # the facets of an ellipsoid lie inside it: 3.4 %
        assert mesh.center_mass == pytest.approx(moment.bodies.position[k], abs=2e-4)
        assert set(at_cells["component"][at_cells["body"] == k]) == {component}


def test_contacts_say_who_pushes_whom_how_hard(poured, scene):
    _, kind, cells, numbers, _ = contact_grid(scene, with_contacts(poured[0][-1]))
    assert (kind, cells.tolist()) == ("vertex", [[0], [1]])
    assert numbers["normal_force"] == pytest.approx([0.012, 0.02])
    assert numbers["tangential_force"] == pytest.approx([0.005, 0.0])
    assert numbers["partner"].tolist() == [1, -1]


@pytest.mark.slow
def test_contacts_of_a_pile_at_rest_carry_its_weight(taichi):
    values = TINY | {"rig.mass": "3g", "numerics.max_time": "8s", "numerics.rayleigh_fraction": "0.4"}
    scene = with_settings(load_scene("funnel"), [f"{path}={value}" for path, value in values.items()])
    (moment,), record = moments(scene, 1, None)
    assert record.outcome in {Outcome.AT_REST, Outcome.NO_HEAP}  # so few bodies are a flat layer
    contacts, weight = moment.contacts, 9.81 * moment.bodies.mass
    force = np.zeros((len(weight), 3))
    np.add.at(force, contacts.body, contacts.force)
    among = contacts.partner >= 0
    np.add.at(force, contacts.partner[among], -contacts.force[among])
    inside = moment.bodies.inside
    # A body that stands still may be out of balance by what put it to sleep, far below its weight.
    assert force[inside, 2] == pytest.approx(weight[inside], rel=0.02)
    assert contacts.force[~among, 2].sum() == pytest.approx(weight[inside].sum(), rel=0.01)


def test_an_open_gate_is_not_drawn(poured, scene):
    moment = poured[0][-1]
    shut = PourState(moment.time, moment.bodies, moment.spheres, moment.contacts, moment.poses, True)
    names = scene.rig.surface_names
    assert set(rig_grid(scene, shut)[4]["surface"]) == set(range(len(names)))
    drawn = {names[k] for k in rig_grid(scene, moment)[4]["surface"]}
    assert drawn == set(names) - {"gate"}


def test_files_hold_what_was_there(poured, tmp_path):
    meshio = pytest.importorskip("meshio")
    seen, record = poured
    moment = with_contacts(seen[-1])
    write_paraview(tmp_path, record.scene, (moment,), 5, str(record.outcome))
    assert {path.name for path in tmp_path.iterdir()} == {
        "README.txt", "bodies.vtu", "shapes.vtu", "spheres.vtu", "contacts.vtu", "rig.vtu"
    }  # fmt: skip
    bodies = meshio.read(tmp_path / "bodies.vtu")
    assert bodies.points == pytest.approx(record.bodies.position, abs=1e-15)
    assert bodies.point_data["mass"] == pytest.approx(record.bodies.mass)
    assert bodies.point_data["velocity"] == pytest.approx(record.bodies.velocity)
    assert bodies.point_data["load"][:2] == pytest.approx([0.012, 0.032])
    spheres = meshio.read(tmp_path / "spheres.vtu")
    assert spheres.point_data["radius"] == pytest.approx(record.spheres.radius)
    assert meshio.read(tmp_path / "contacts.vtu").point_data["force"] == pytest.approx(moment.contacts.force)
    assert len(meshio.read(tmp_path / "rig.vtu").cells_dict["triangle"]) > 100
    assert "0 seed, 1 plate, 2 petiole" in (tmp_path / "README.txt").read_text()


def test_several_moments_are_a_collection(poured, tmp_path):
    pytest.importorskip("meshio")
    seen, record = poured
    write_paraview(tmp_path, record.scene, seen, 5, str(record.outcome))
    entries = ET.parse(tmp_path / "bodies.pvd").getroot().findall("Collection/DataSet")
    assert [float(entry.get("timestep")) for entry in entries] == pytest.approx([moment.time for moment in seen])
    assert all((tmp_path / entry.get("file")).is_file() for entry in entries)
    # Bodies in free fall touch nothing, and a file without a point is left out.
    assert not list(tmp_path.glob("contacts*"))


def test_a_collection_escapes_its_names():
    assert "a&amp;b.vtu" in collection([(0.0, "a&b.vtu")])


@pytest.mark.parametrize("ended", [True, False])
def test_a_pour_that_ends_before_the_time_that_is_asked_for_says_so(ended, poured, tmp_path, monkeypatch):
    pytest.importorskip("meshio")
    seen, record = poured
    outcome = Outcome.AT_REST if ended else Outcome.TIME_LIMIT
    made = (seen, dataclasses.replace(record, outcome=outcome))
    monkeypatch.setattr("explorer.export.paraview.moments", lambda *_: made)
    told = PARAVIEW.write(tmp_path, ExportOrder(record.scene, 5, time=0.3))
    assert (", where the pour ended before --time 0.3 (at rest); what" in told) == ended


def test_without_the_library_it_is_one_line_before_anything_is_poured(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "meshio", None)
    line = refused(explorer("export", "funnel", tmp_path / "new", "--to", "paraview", *settings(TINY)))
    assert line.startswith("--to paraview: meshio, which writes VTK files, is not installed")
    assert not (tmp_path / "new").exists()


def test_the_command(taichi, tmp_path):
    pytest.importorskip("meshio")
    result = explorer("export", "funnel", tmp_path / "vtk", "--to", "paraview", "--every", "0.05", *settings(TINY))
    assert result.exit_code == 0, result.output
    assert "moment(s), the last at 0.1" in result.stdout
    assert (tmp_path / "vtk" / "shapes.pvd").is_file()
