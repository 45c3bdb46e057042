"""Mesh files: solids of closed form in every format and unit, parts of a scene, and one clear line for every fault."""

import math

import numpy as np
import pytest
import trimesh

from solver.shapes import mesh_file
from solver.shapes.mesh_file import MeshFileError, read_solid_mesh
from solver.shapes.solid import ShapeError, Solid, mass_properties
from tests.solver.meshes import angle_bar, bent_rod, crossed_boxes, ring, saved

BOX = (20.0, 12.0, 6.0)


def properties(path, unit="mm"):
    return mass_properties(Solid("mesh", file=str(path), unit=unit), 1000.0)


@pytest.mark.parametrize("suffix", ["stl", "obj", "ply", "glb"])
def test_a_box_has_its_mass_in_every_format(suffix, tmp_path):
    found = properties(saved(trimesh.creation.box(BOX), tmp_path / f"box.{suffix}"))
    squares = (np.array(BOX) * 1e-3) ** 2
    # single precision of the file
    assert found.mass == pytest.approx(20e-3 * 12e-3 * 6e-3 * 1000.0, rel=1e-6)
    assert found.inertia == pytest.approx(found.mass * (squares.sum() - squares) / 12.0, rel=1e-6)
    assert found.extents == pytest.approx(np.array(BOX) * 1e-3, rel=1e-6)


@pytest.mark.parametrize(("unit", "metres"), [("m", 1.0), ("cm", 1e-2), ("mm", 1e-3), ("um", 1e-6)])
def test_unit_of_the_coordinates(unit, metres, tmp_path):
    path = saved(trimesh.creation.box((2e-3 / metres, 1e-3 / metres, 1e-3 / metres)), tmp_path / "box.stl")
    assert properties(path, unit).volume == pytest.approx(2e-9, rel=1e-6)
    assert Solid("mesh", file=str(path), unit=unit).to_toml()["mesh"] == str(path)


def test_a_prism_has_the_inertia_of_its_polygon(tmp_path):
    """A cylinder of n sides: A = n/2 R² sin 2π/n, second moment about the axis per area R² (2 + cos 2π/n)/6."""
    n, radius, length = 32, 5.0, 20.0
    found = properties(saved(trimesh.creation.cylinder(radius, length, sections=n), tmp_path / "rod.ply"))
    turn = 2.0 * math.pi / n
    area = n / 2.0 * radius**2 * math.sin(turn)
    polar = radius**2 * (2.0 + math.cos(turn)) / 6.0
    assert found.volume == pytest.approx(1e-9 * area * length, rel=1e-6)
    along, across = polar, polar / 2.0 + length**2 / 12.0
    assert found.inertia == pytest.approx(1e-6 * found.mass * np.array([along, across, across]), rel=1e-5)


def test_a_ring_has_the_inertia_of_a_torus(tmp_path):
    """V = 2π² R r², about the axis m (R² + 3/4 r²), across m (R²/2 + 5/8 r²)."""
    found = properties(saved(ring(sections=256), tmp_path / "ring.stl"))
    # 256 × 128 facets: the polygons' areas fall short by (2π/n)²/6
    assert found.volume == pytest.approx(2e-9 * math.pi**2 * 10.0 * 9.0, rel=6e-4)
    across, along = 100.0 / 2.0 + 5.0 / 8.0 * 9.0, 100.0 + 0.75 * 9.0
    assert found.inertia == pytest.approx(1e-6 * found.mass * np.array([across, across, along]), rel=6e-4)


def test_a_ball_of_facets(tmp_path):
    found = properties(saved(trimesh.creation.icosphere(subdivisions=5, radius=5.0), tmp_path / "ball.glb"))
    # the facets of this icosphere cut off 5.6e-4 of the volume
    assert found.volume == pytest.approx(4.0 / 3.0 * math.pi * 125e-9, rel=1e-3)
    assert found.inertia == pytest.approx(np.full(3, 0.4 * found.mass * 25e-6), rel=1e-3)


@pytest.mark.parametrize("suffix", ["stl", "obj", "ply", "glb"])
def test_closed_parts_are_one_body(suffix, tmp_path):
    """Two boxes 30 mm apart: Steiner's rule for the moments."""
    one, other = trimesh.creation.box((6, 4, 2)), trimesh.creation.box((6, 4, 2))
    other.apply_translation([30, 0, 0])
    found = properties(saved(trimesh.Scene([one, other]), tmp_path / f"pair.{suffix}"))
    single = 48e-9 * 1000.0
    assert found.mass == pytest.approx(2 * single, rel=1e-6)
    expected = single * np.array([2 * 20 / 12, 2 * (40 / 12 + 225), 2 * (52 / 12 + 225)]) * 1e-6
    assert found.inertia == pytest.approx(expected, rel=1e-6)


def test_a_surface_that_is_split_into_parts_is_welded(tmp_path):
    """As GLB has a body of two materials: neither half is closed, both together are."""
    box = trimesh.creation.box(BOX)
    halves = [box.submesh([faces], append=True) for faces in (range(6), range(6, 12))]
    path = saved(trimesh.Scene(halves), tmp_path / "painted.glb")
    assert properties(path).volume == pytest.approx(1440e-9, rel=1e-6)


def test_a_cavity_is_hollow(tmp_path):
    inner = trimesh.creation.box((10, 6, 3))
    inner.invert()
    shell = trimesh.util.concatenate([trimesh.creation.box(BOX), inner])
    assert properties(saved(shell, tmp_path / "shell.stl")).volume == pytest.approx((1440 - 180) * 1e-9, rel=1e-6)


@pytest.mark.parametrize("suffix", ["glb", "stl"])
def test_a_cavity_may_be_a_part_of_its_own(suffix, tmp_path):
    inner = inverted(trimesh.creation.box((10, 6, 3)))
    path = saved(trimesh.Scene([trimesh.creation.box(BOX), inner]), tmp_path / f"hollow.{suffix}")
    assert properties(path).volume == pytest.approx((1440 - 180) * 1e-9, rel=1e-6)


def test_a_part_inside_out_beside_another_is_refused(tmp_path):
    other = inverted(trimesh.creation.box((4, 4, 4)))
    other.apply_translation([30, 0, 0])
    path = saved(trimesh.Scene([trimesh.creation.box(BOX), other]), tmp_path / "two.glb")
    with pytest.raises(MeshFileError, match="is inside out, or cuts through itself"):
        read_solid_mesh(str(path), "mm")


def test_corners_of_no_face_are_no_part_of_the_solid(tmp_path):
    box = trimesh.creation.box(BOX)
    stray = trimesh.Trimesh(np.vstack([box.vertices, [[100.0, 100.0, 100.0]]]), box.faces, process=False)
    mesh = read_solid_mesh(str(saved(stray, tmp_path / "stray.ply")), "mm")
    assert len(mesh.vertices) == 8
    assert mesh.volume == pytest.approx(1440e-9, rel=1e-6)


def test_repeated_corners_and_facets_without_area_do_no_harm(tmp_path):
    """A facet with a repeated corner, as exporters leave them, is no hole."""
    box = trimesh.creation.box(BOX)
    faces = np.vstack([box.faces, [[0, 0, 1], [2, 2, 2]]])
    path = saved(trimesh.Trimesh(box.vertices, faces, process=False), tmp_path / "sliver.obj")
    assert properties(path).volume == pytest.approx(1440e-9, rel=1e-6)


def opened(mesh):
    return trimesh.Trimesh(mesh.vertices, mesh.faces[1:], process=False)


def inverted(mesh):
    return trimesh.Trimesh(mesh.vertices, mesh.faces[:, ::-1], process=False)


def half_inverted(mesh):
    return trimesh.Trimesh(mesh.vertices, np.vstack([mesh.faces[:1, ::-1], mesh.faces[1:]]), process=False)


def flat():
    """Both sides of a square, closed and without volume."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float)
    return trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3], [0, 2, 1], [0, 3, 2]], process=False)


def cancelled():
    """A box beside an equal one inside out: their volumes add up to nothing."""
    other = inverted(trimesh.creation.box(BOX))
    other.apply_translation([30, 0, 0])
    return trimesh.util.concatenate([trimesh.creation.box(BOX), other])


def finned(mesh):
    """A fin of two facets on an edge of the mesh: four facets share it."""
    a, b = mesh.faces[0, 0], mesh.faces[0, 1]
    tip = mesh.vertices[a] + [50.0, 50.0, 50.0]
    faces = np.vstack([mesh.faces, [[a, b, len(mesh.vertices)], [b, a, len(mesh.vertices)]]])
    return trimesh.Trimesh(np.vstack([mesh.vertices, tip]), faces, process=False)


def inside_out_pocket():
    """A box beside an inverted one: as a whole its volume is positive."""
    small = inverted(trimesh.creation.box((4, 4, 4)))
    small.apply_translation([30, 0, 0])
    return trimesh.util.concatenate([trimesh.creation.box(BOX), small])


FAULTS = {
    "open": (opened(trimesh.creation.box(BOX)), "not watertight: it is open, 3 edges belong to one face only"),
    "inverted": (inverted(ring()), "inverted: its volume is not positive"),
    "inconsistent": (half_inverted(trimesh.creation.box(BOX)), "neighbouring faces disagree"),
    "flat": (flat(), "degenerate: all its corners lie in one plane"),
    "cancelled": (cancelled(), "degenerate: it encloses no volume"),
    "fin": (finned(trimesh.creation.box(BOX)), "1 edges belong to more than two faces"),
    "point": (trimesh.Trimesh([[1, 1, 1]] * 3, [[0, 1, 2]], process=False), "degenerate: it has no face with an area"),
    "crossing": (crossed_boxes(), "cuts through itself, or its parts overlap"),
    "pocket": (inside_out_pocket(), "is inside out, or cuts through itself"),
    "knot": (bent_rod(bend=4.0, radius=3.0, angle=2.2 * math.pi), "cuts through itself"),
    "nan": (trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, np.nan, 1]], [[0, 1, 2]], process=False), "not finite"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_what_bounds_no_solid_is_refused_in_one_line(fault, tmp_path):
    mesh, message = FAULTS[fault]
    path = saved(mesh, tmp_path / f"{fault}.ply")
    with pytest.raises(ShapeError, match=message) as caught:
        properties(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_open_part_is_named(tmp_path):
    other = opened(trimesh.creation.box(BOX))
    other.apply_translation([50, 0, 0])
    path = saved(trimesh.Scene([trimesh.creation.box(BOX), other]), tmp_path / "two.glb")
    with pytest.raises(MeshFileError, match=r"part [12] of 2: is not watertight"):
        read_solid_mesh(str(path))


def test_overlapping_parts_are_refused(tmp_path):
    other = trimesh.creation.box(BOX)
    other.apply_translation([15, 0, 0])
    path = saved(trimesh.Scene([trimesh.creation.box(BOX), other]), tmp_path / "two.glb")
    # a quarter of one box lies in the other: 1/7 of the union
    with pytest.raises(MeshFileError, match=r"overlap, in about 14 %"):
        read_solid_mesh(str(path))


def test_large_files_are_refused_before_they_are_read(tmp_path, monkeypatch):
    path = tmp_path / "large.stl"
    with path.open("wb") as file:
        file.truncate(mesh_file.MOST_BYTES + 1)
    with pytest.raises(MeshFileError, match=r"too large: 100 MB; at most 100 MB"):
        read_solid_mesh(str(path))
    monkeypatch.setattr(mesh_file, "MOST_FACES", 11)
    with pytest.raises(MeshFileError, match="has 12 faces; at most 11"):
        read_solid_mesh(str(saved(trimesh.creation.box(BOX), tmp_path / "box.stl")))


def test_damaged_and_missing_files(tmp_path):
    with pytest.raises(MeshFileError, match="no such file"):
        read_solid_mesh(str(tmp_path / "absent.stl"))
    (tmp_path / "text.stl").write_text("solid of nothing")
    (tmp_path / "cut.glb").write_bytes(b"glTF\x02\x00\x00\x00")
    for name in ("text.stl", "cut.glb"):
        with pytest.raises(MeshFileError, match=r"cannot be read|holds no faces"):
            read_solid_mesh(str(tmp_path / name))


@pytest.mark.parametrize("mesh", [ring(), bent_rod(), angle_bar()], ids=["ring", "bend", "angle"])
def test_sound_bodies_are_not_taken_for_crossing(mesh, tmp_path):
    """In twenty attitudes: rays of the check run along edges and through corners."""
    rng = np.random.default_rng(4)
    for k in range(20):
        turned = mesh.copy()
        if k:
            turned.apply_transform(trimesh.transformations.random_rotation_matrix(rng.uniform(size=3)))
        path = saved(turned, tmp_path / f"{k}.stl")
        assert read_solid_mesh(str(path)).volume == pytest.approx(mesh.volume, rel=1e-5)
