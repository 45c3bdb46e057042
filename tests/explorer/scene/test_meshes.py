"""Triangles to draw, against closed forms."""

import numpy as np
import pytest

from explorer.scene.meshes import PLATE_OVERHANG, body_triangles, rig_triangles
from solver import load_material
from solver.scenes.body import Body, Members


@pytest.fixture(scope="module")
def scene():
    return load_material("sunflower_extract")


def enclosed_volume(triangles):
    """Σ v₁·(v₂ × v₃) / 6 over outward faces [m³]."""
    a, b, c = np.moveaxis(triangles.vertices.astype(float)[triangles.faces], 1, 0)
    return np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0


def test_bodies_have_their_dimensions_and_volume(scene):
    for body in scene.bodies:
        triangles = body_triangles(body)
        outer = np.ptp(triangles.vertices, axis=0)
        # an inscribed polyhedron falls short by its facets: under 1 % of a length at 32 sides, 5 % of the volume
        assert outer == pytest.approx(body.extents, rel=0.01)
        solid_volume = body.mass / body.density
        assert 0.95 * solid_volume < enclosed_volume(triangles) <= solid_volume * (1.0 + 1e-6)


def test_normals_are_unit_and_point_outwards(scene):
    for body in scene.bodies:
        triangles = body_triangles(body)
        # single precision
        assert np.linalg.norm(triangles.normals, axis=1) == pytest.approx(1.0, abs=1e-6)
        assert (np.einsum("ij,ij->i", triangles.normals, triangles.vertices) > 0.0).all()


def test_a_body_of_spheres_is_drawn_as_spheres():
    members = Members(((-0.002, 0.0, 0.0), (0.002, 0.0, 0.0)), (0.003, 0.003), 1e-4, (1e-10, 1e-10, 1e-10))
    triangles = body_triangles(Body("pair", "grain", 1.0, members, 1000.0))
    assert np.ptp(triangles.vertices[:, 0]) == pytest.approx(0.010, rel=0.01)
    distance = np.abs(np.linalg.norm(np.abs(triangles.vertices) - [0.002, 0.0, 0.0], axis=1) - 0.003)
    assert distance.min() < 1e-8


def test_rig_lies_on_its_surfaces(scene):
    rig = scene.rig
    drawn = rig_triangles(rig)
    assert set(drawn) == {"plate", "cone", "gate"}
    cone = drawn["cone"].vertices
    radius = np.hypot(cone[:, 0], cone[:, 1])
    share = (cone[:, 2] - rig.outlet_height) / rig.cone_height
    expected = 0.5 * (rig.outlet_diameter + share * (rig.inlet_diameter - rig.outlet_diameter))
    # single precision of 0.1 m
    assert radius == pytest.approx(expected, abs=1e-7)
    plate = drawn["plate"].vertices
    assert (plate[:, 2] == 0.0).all()
    assert np.hypot(plate[:, 0], plate[:, 1]).max() == pytest.approx(PLATE_OVERHANG * rig.inlet_diameter / 2.0)
    assert (drawn["plate"].normals == [0.0, 0.0, 1.0]).all()
    # Faces look the way of the normals: what is drawn from one side only is seen from above.
    for surface in drawn.values():
        corners = surface.vertices[surface.faces].astype(float)
        facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        seen = np.linalg.norm(facing, axis=1) > 0.0
        assert (np.einsum("ij,ij->i", facing, surface.normals[surface.faces[:, 0]])[seen] > 0.0).all()
    along = cone[len(cone) // 2] - cone[0]
    assert drawn["cone"].normals[0] @ along == pytest.approx(0.0, abs=1e-7)
