"""Solids: closed forms against fine meshes, frames, and every refusal."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from solver.shapes.solid import ShapeError, Solid, mass_properties, principal_extents, surface_mesh
from solver.shapes.solid_points import interior_points, surface_points

SEED = Solid("ellipsoid", (27.92e-3, 11.18e-3, 6.11e-3))
PLATE = Solid("box", (27.53e-3, 15.02e-3, 5.0e-3))
PETIOLE = Solid("cylinder", (5.35e-3, 57.56e-3))
DISC = Solid("cylinder", (20e-3, 4e-3))
BALL = Solid("sphere", (6e-3,))
SOLIDS = [SEED, PLATE, PETIOLE, DISC, BALL]


@pytest.mark.parametrize("solid", SOLIDS, ids=lambda solid: f"{solid.kind}{len(solid.dimensions)}")
def test_closed_forms_agree_with_a_fine_mesh(solid):
    fine = surface_mesh(solid, refinement=6)
    fine.density = 700.0
    properties = mass_properties(solid, 700.0)
    # 3e-4: facets of the finest icosphere cut off 1.4e-4 of the volume and 2.3e-4 of the moments
    assert properties.mass == pytest.approx(fine.mass, rel=3e-4)
    np.testing.assert_allclose(properties.inertia, np.diag(fine.moment_inertia), rtol=3e-4)
    np.testing.assert_allclose(properties.extents, fine.extents, rtol=1e-12)
    assert properties.volume == pytest.approx(properties.mass / 700.0)


@pytest.mark.parametrize("dimensions", [(2e-4, 3e-3), (1.2e-3, 1.2e-3), (1.5e-3, 6e-3), (1e-2, 1e-4), (5e-4, 3e-4)])
def test_the_mesh_of_a_small_cylinder_has_all_its_faces(dimensions):
    for refinement in (2, 5):
        mesh = surface_mesh(Solid("cylinder", dimensions), refinement=refinement)
        sides = 8 * 2**refinement
        assert mesh.is_watertight
        # An n-sided prism has the share n/2π sin 2π/n of its cylinder's volume.
        share = sides / (2.0 * math.pi) * math.sin(2.0 * math.pi / sides)
        assert mesh.volume == pytest.approx(share * math.pi / 4.0 * dimensions[0] ** 2 * dimensions[1], rel=1e-9)
        assert sorted(mesh.extents) == pytest.approx(sorted((dimensions[0], *dimensions)))


def test_closed_forms_by_hand():
    # a sphere of 6 mm and 1000 kg/m3: m = pi/6 d^3 rho, I = m d^2 / 10
    mass = math.pi / 6 * 6e-3**3 * 1000.0
    np.testing.assert_allclose(mass_properties(BALL, 1000.0).inertia, mass * 6e-3**2 / 10, rtol=1e-12)
    # a rod: m d^2 / 8 about its axis, x
    rod = mass_properties(PETIOLE, 1000.0)
    assert rod.mass == pytest.approx(math.pi / 4 * 5.35e-3**2 * 57.56e-3 * 1000.0)
    assert rod.inertia[0] == pytest.approx(rod.mass * 5.35e-3**2 / 8)
    assert rod.inertia[1] == pytest.approx(rod.mass * (3 * 5.35e-3**2 / 4 + 57.56e-3**2) / 12)
    # a disc has its axis, of largest moment, along z
    assert mass_properties(DISC, 1000.0).inertia.argmax() == 2


lengths = st.floats(1e-4, 0.1)


@settings(max_examples=40, deadline=None)
@given(st.tuples(lengths, lengths, lengths), st.sampled_from(["ellipsoid", "box"]))
def test_frame_does_not_hang_on_the_order_of_axes(dimensions, kind):
    properties = mass_properties(Solid(kind, dimensions), 500.0)
    assert np.all(np.diff(properties.extents) <= 0.0)
    assert np.all(np.diff(properties.inertia) >= -1e-12 * properties.inertia[2])
    other = mass_properties(Solid(kind, dimensions[::-1]), 500.0)
    np.testing.assert_array_equal(properties.inertia, other.inertia)


@pytest.mark.parametrize("solid", SOLIDS, ids=lambda solid: f"{solid.kind}{len(solid.dimensions)}")
def test_toml_round_trip(solid):
    assert Solid.from_toml(solid.to_toml(), "here") == solid
    assert hash(Solid.from_toml(solid.to_toml(), "here")) == hash(solid)


def skewed_tetrahedron() -> trimesh.Trimesh:
    corners = np.array([[0, 0, 0], [30, 0, 0], [5, 12, 0], [4, 3, 7]]) * 1e-3
    return trimesh.Trimesh(corners, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


def moved(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    turn = trimesh.transformations.rotation_matrix(1.1, [0.3, -0.5, 0.8])
    turn[:3, 3] = [0.4, -0.2, 0.1]
    return mesh.copy().apply_transform(turn)


def test_mesh_lies_in_its_principal_frame(tmp_path: Path):
    moved(skewed_tetrahedron()).export(tmp_path / "body.ply")
    solid = Solid.from_toml({"mesh": "body.ply"}, "here", tmp_path)
    assert Solid.from_toml(solid.to_toml(), "here") == solid
    mesh = surface_mesh(solid)
    # the file holds 32-bit coordinates of a body 0.45 m away: 3e-8 m
    np.testing.assert_allclose(mesh.center_mass, 0.0, atol=1e-10)
    inertia = mesh.moment_inertia
    assert np.abs(inertia - np.diag(np.diag(inertia))).max() < 1e-9 * inertia[2, 2]
    properties = mass_properties(solid, 1000.0)
    np.testing.assert_allclose(properties.inertia, 1000.0 * np.diag(inertia), rtol=1e-9)
    # volume of a tetrahedron, |det| / 6 = 30 * 12 * 7 / 6 mm3
    assert properties.mass == pytest.approx(420e-9 * 1000.0, rel=1e-4)
    assert mesh.volume > 0.0, "a mirrored frame would turn the mesh inside out"


def test_mesh_frame_turns_with_the_body(tmp_path: Path):
    skewed_tetrahedron().export(tmp_path / "one.ply")
    moved(skewed_tetrahedron()).export(tmp_path / "two.ply")
    one, two = (surface_mesh(Solid("mesh", file=str(tmp_path / f"{name}.ply"))) for name in ("one", "two"))
    # 32-bit coordinates of a body 0.45 m away: 3e-8 m
    np.testing.assert_allclose(one.vertices, two.vertices, atol=5e-7)


def test_a_changed_mesh_file_is_read_again(tmp_path: Path):
    file = tmp_path / "body.stl"
    trimesh.creation.box((3e-3, 2e-3, 1e-3)).export(file)
    solid = Solid("mesh", file=str(file))
    before = mass_properties(solid, 1.0).volume
    trimesh.creation.box((6e-3, 2e-3, 1e-3)).export(file)
    assert mass_properties(solid, 1.0).volume == pytest.approx(2.0 * before, rel=1e-5)


def test_the_mesh_of_a_caller_is_his_own():
    surface_mesh(PLATE).apply_scale(5.0)
    np.testing.assert_allclose(surface_mesh(PLATE).extents, principal_extents(PLATE))


@pytest.mark.parametrize("solid", SOLIDS, ids=lambda solid: f"{solid.kind}{len(solid.dimensions)}")
def test_interior_points_of_mesh_and_closed_form_agree(solid, tmp_path: Path):
    file = tmp_path / "body.ply"
    surface_mesh(solid, refinement=6).export(file)
    inside_mesh = interior_points(Solid("mesh", file=str(file)), 20_000)
    inside = interior_points(solid, 20_000)
    # lattices differ by rounding of the bounding box: points at the surface may change sides
    assert len(inside_mesh) == pytest.approx(len(inside), rel=0.01)
    # second moments of the points are those of the solid, to the lattice's error
    squares = 12.0 if solid.kind == "box" else 20.0
    if solid.kind != "cylinder":
        for points in (inside, inside_mesh):
            np.testing.assert_allclose(
                (points**2).mean(axis=0), np.sort(principal_extents(solid) ** 2 / squares)[::-1], rtol=0.02
            )


def test_surface_points_cover_by_area():
    points, normals = surface_points(PLATE, 4000)
    assert ((points * normals).sum(axis=1) > 0.0).all(), "normals of a convex body point away from its centre"
    x, y, z = PLATE.dimensions
    on_top = np.isclose(points[:, 2], z / 2).mean()
    # stratified: each face gets its share to one point in 4000
    assert on_top == pytest.approx(x * y / (2 * (x * y + y * z + z * x)), abs=1e-3)


BAD_TABLES = [
    ({}, "exactly one"),
    ({"sphere": 1e-3, "box": [1, 1, 1]}, "exactly one"),
    ("ellipsoid", "exactly one"),
    ({"cone": [1, 2]}, "unknown key 'cone'"),
    ({"dimensions": [1, 2]}, "unknown key 'dimensions'"),
    ({"ellipsoid": [1e-3, 2e-3]}, "3 dimensions expected"),
    ({"ellipsoid": 1e-3}, "a list is expected"),
    ({"ellipsoid": "abc"}, "a list is expected"),
    ({"cylinder": [1e-3, 2e-3, 3e-3]}, r"2 dimensions expected \(diameter, length\)"),
    ({"box": [1e-3, -2e-3, 3e-3]}, "edge y must be a positive, finite length"),
    ({"box": [1e-3, 0, 3e-3]}, "edge y"),
    ({"box": [1e-3, 1e-3, math.nan]}, "edge z"),
    ({"cylinder": [math.inf, 1e-3]}, "diameter"),
    ({"cylinder": [True, 1e-3]}, "diameter"),
    ({"sphere": "6 mm"}, "diameter must be a positive, finite length"),
    ({"sphere": [1e-3]}, "diameter"),
    ({"mesh": 3}, "the name of a file"),
    ({"mesh": "body.step"}, "files ending in .stl, .obj, .ply"),
    ({"mesh": "absent.stl"}, "no such file"),
]


@pytest.mark.parametrize("table, message", BAD_TABLES)
def test_bad_declarations_are_refused_in_one_line(table, message):
    with pytest.raises(ShapeError, match=message) as caught:
        Solid.from_toml(table, "material.toml, body.seed.shape")
    assert str(caught.value).startswith("material.toml, body.seed.shape: ")
    assert "\n" not in str(caught.value)


def test_bad_meshes_are_refused(tmp_path: Path):
    box = trimesh.creation.box((1e-3, 1e-3, 1e-3))
    trimesh.Trimesh(box.vertices, box.faces[1:], process=False).export(tmp_path / "open.stl")
    trimesh.Trimesh(box.vertices, box.faces[:, ::-1], process=False).export(tmp_path / "inverted.stl")
    (tmp_path / "damaged.ply").write_text("no mesh at all")
    (tmp_path / "empty.obj").write_text("")
    cases = {
        "open.stl": "not watertight",
        "inverted.stl": "not positive",
        "damaged.ply": "read",
        "empty.obj": "empty.obj",
    }
    for name, message in cases.items():
        with pytest.raises(ShapeError, match=message) as caught:
            Solid.from_toml({"mesh": name}, "here", tmp_path)
        assert name in str(caught.value)
        assert "\n" not in str(caught.value)


def test_bad_solids_and_densities_are_refused():
    with pytest.raises(ShapeError, match="unknown solid"):
        Solid("cone", (1.0,))  # type: ignore[arg-type]
    with pytest.raises(ShapeError, match="takes no file"):
        Solid("sphere", (1.0,), "body.stl")
    for density in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(ShapeError, match="density"):
            mass_properties(SEED, density)
