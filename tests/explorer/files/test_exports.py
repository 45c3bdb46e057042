"""What is taken along of a pour: read back by other programs, it is what was on the screen."""

import csv
import io
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from explorer.errors import CommandError
from explorer.files.exports import bodies_csv, bodies_stl
from solver import load_material, with_values
from tests.explorer.beads import MASS, RADIUS, bead_scene
from tests.explorer.viewer.page_session import frame_of

BEADS = bead_scene()
PLACES = [[0.01, 0.0, 0.02], [0.0, 0.05, 0.03], [0.5, 0.0, 0.0]]


def test_the_table_holds_every_body_in_order_of_entry():
    frame = replace(frame_of([0, 0, 0], PLACES, [True, True, False]), scale=np.float32([1.0, 0.5, 1.0]))
    rows = list(csv.DictReader(io.StringIO(bodies_csv(frame, BEADS))))
    assert [[float(row[key]) for key in ("x_m", "y_m", "z_m")] for row in rows] == PLACES
    # Half as long is an eighth of the mass; seven digits.
    assert [float(row["mass_kg"]) for row in rows] == pytest.approx([MASS, MASS / 8, MASS], rel=1e-6)
    assert [row["in_domain"] for row in rows] == ["1", "1", "0"]
    assert {row["component"] for row in rows} == {"bead"}


def test_masses_are_those_of_the_bodies_that_are_poured():
    lighter = with_values(BEADS, {"effect.density_error.excess": -0.3})
    (row,) = csv.DictReader(io.StringIO(bodies_csv(frame_of([0], PLACES[:1], [True]), lighter)))
    assert float(row["mass_kg"]) == pytest.approx(0.7 * MASS, rel=1e-6)


def test_the_mesh_has_the_bodies_where_they_are_in_millimetres():
    frame = frame_of([0, 0, 0], PLACES, [True, True, False])
    mesh = trimesh.load(io.BytesIO(bodies_stl(frame, BEADS)), file_type="stl")
    parts = sorted(mesh.split(), key=lambda part: part.centroid[0])
    assert len(parts) == 2
    # Single precision of 50 mm is 4e-6 mm.
    assert parts[0].centroid == pytest.approx([0.0, 50.0, 30.0], abs=1e-4)
    assert parts[1].centroid == pytest.approx([10.0, 0.0, 20.0], abs=1e-4)
    # Corners of the polyhedron lie on the ball.
    assert parts[0].extents == pytest.approx([2e3 * RADIUS] * 3, rel=0.02)
    assert mesh.is_watertight


def test_a_body_is_turned_and_sized_as_on_the_screen():
    scene = load_material("sunflower_extract")
    half = np.sqrt(0.5)
    # Half a turn about (x + z) / √2 exchanges x and z: the long axis stands upright.
    frame = replace(
        frame_of([0], [[0.0, 0.0, 0.0]]),
        quaternion=np.float32([[0.0, half, 0.0, half]]),
        scale=np.float32([2.0]),
    )
    mesh = trimesh.load(io.BytesIO(bodies_stl(frame, scene)), file_type="stl")
    assert mesh.extents == pytest.approx([2 * 6.11, 2 * 11.18, 2 * 27.92], rel=1e-4)


def test_nothing_to_export_is_told():
    with pytest.raises(CommandError, match="no body has entered yet"):
        bodies_stl(frame_of([], np.zeros((0, 3))), BEADS)
