"""Clumps of a given number of spheres: shapes with holes and corners, and errors against closed forms."""

import math

import numpy as np
import pytest
import trimesh
from scipy.integrate import dblquad

from solver.shapes.clump import fit_clump
from solver.shapes.clump_error import distance_to_mesh, sphere_error, union_moments
from solver.shapes.solid import ShapeError, Solid, mass_properties
from solver.shapes.sphere_number import deviation, doubling, fitted, general_target
from tests.solver.meshes import angle_bar, bent_rod, ring, saved

MESHES = {"ring": ring(), "bend": bent_rod(), "angle": angle_bar()}


@pytest.fixture(scope="module")
def solids(tmp_path_factory):
    folder = tmp_path_factory.mktemp("meshes")
    return {
        name: Solid("mesh", file=str(saved(mesh, folder / f"{name}.stl")), unit="mm") for name, mesh in MESHES.items()
    }


@pytest.fixture(scope="module")
def fits(solids):
    """Centres and radii by mesh and number of spheres."""
    numbers = doubling(16)
    return {name: dict(zip(numbers, fitted(solid, numbers), strict=True)) for name, solid in solids.items()}


def test_doubling():
    assert doubling(1) == [1]
    assert doubling(8) == [1, 2, 4, 8]
    assert doubling(9) == [1, 2, 4, 8, 9]


@pytest.mark.parametrize("name", [pytest.param("ring", marks=pytest.mark.slow), "bend"])
def test_sixteen_spheres_follow_a_rod_that_is_not_straight(solids, fits, name):
    """Spheres of radius r in a row, a apart, leave grooves of r − √(r² − a²/4).

    The ring's axis is 62.8 mm long: a = 3.9 mm and a groove of 0.72 mm, whose mean depth, a third of it, is taken off
    by the least-squares fit. What is left is below 0.11 r; of the bend, 47 mm long with two flat ends, too.
    """
    found = sphere_error(solids[name], *fits[name][16])
    assert found.number == 16
    assert found.rms < 0.11 * 3e-3
    assert found.covered > 0.85
    # the inscribed radius, to which the smallest sphere relates, is known to the spacing of points
    assert found.smallest_radius >= 0.5 * 3e-3 * 0.95


def test_spheres_stay_inside_the_angle_of_a_bar(solids, fits):
    """A sphere in the inner corner would touch both bars from outside and stand for neither."""
    found = sphere_error(solids["angle"], *fits["angle"][16])
    # a square bar is missed by (√2 − 1) r = 1.24 mm at its edges
    assert found.rms < 0.25 * 3e-3
    volume = mass_properties(solids["angle"], 1.0).volume
    assert found.volume - found.covered * volume < 0.04 * volume
    assert found.covered > 0.7


def test_the_hole_of_a_ring_stays_open(fits):
    """The axis of the ring is 7 mm from its surface: no sphere may come nearer to it than the roughness of the fit."""
    centres, radii = fits["ring"][16]
    assert (np.hypot(centres[:, 0], centres[:, 1]) - radii).min() > 7e-3 - 1e-3


def test_spheres_of_a_bent_rod_lie_along_its_arc(fits):
    """Eight spheres on a rod of 6 mm and 47 mm: their centres are on the arc of 20 mm, not on the chord."""
    centres, _ = fits["bend"][8]
    apart = np.linalg.norm(centres[:, None] - centres[None], axis=2)
    neighbours = np.sort(apart, axis=1)[:, 1]
    # an even row between the ends: (47.1 − 2 r)/7 = 5.9 mm
    assert neighbours == pytest.approx(np.full(8, 5.9e-3), rel=0.1)
    # circumcircle of the ends and the middle of the row; 7 %: the end spheres move to where the flat ends are met best
    ends = np.unravel_index(apart.argmax(), apart.shape)
    a, b = centres[ends[0]], centres[ends[1]]
    height = np.linalg.norm(np.cross(centres - a, b - a), axis=1).max() / np.linalg.norm(b - a)
    half = np.linalg.norm(b - a) / 2
    assert (half**2 + height**2) / (2 * height) == pytest.approx(20e-3, rel=0.07)


def test_more_spheres_are_nearer(solids, fits):
    errors = [deviation(general_target(solids["bend"]), *fits["bend"][number]) for number in (4, 8, 16)]
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] < 0.2 * errors[0]


def test_the_same_bits_again_whatever_number_comes_later(solids, fits):
    for number, again in zip((1, 2, 4), fitted(solids["angle"], [1, 2, 4]), strict=True):
        assert np.array_equal(fits["angle"][number][0], again[0])
        assert np.array_equal(fits["angle"][number][1], again[1])


def test_a_ball_needs_one_sphere(tmp_path):
    solid = Solid("mesh", file=str(saved(trimesh.creation.icosphere(3, 5.0), tmp_path / "ball.stl")), unit="mm")
    found = sphere_error(solid, *next(fitted(solid, [1])))
    # facets of this icosphere lie up to 14 µm below the sphere
    assert found.rms < 6e-6
    assert found.largest < 2.5e-5


def test_a_number_in_place_of_a_resolution(solids, fits):
    seed = Solid("ellipsoid", (27.92e-3, 11.18e-3, 6.11e-3))
    clump = fit_clump(seed, 346.0, "9")
    assert len(clump.radii) == 9
    # symmetric where the solid is, to the last bit
    spheres = {(*c, r) for c, r in zip(clump.centres.tolist(), clump.radii.tolist(), strict=True)}
    mirrored = {(*c, r) for c, r in zip((clump.centres * [-1, 1, 1] + 0.0).tolist(), clump.radii, strict=True)}
    assert mirrored == spheres
    assert clump.mass == mass_properties(seed, 346.0).mass
    assert clump.fit.surface_rms < fit_clump(seed, 346.0, "5").fit.surface_rms
    of_mesh = fit_clump(solids["ring"], 1000.0, "4")
    assert np.array_equal(of_mesh.centres, fits["ring"][4][0])
    assert np.array_equal(of_mesh.radii, fits["ring"][4][1])
    for bad in ("0", "129", "-3", "8.0"):
        with pytest.raises(ShapeError, match="numbers from 1 to 128"):
            fit_clump(seed, 346.0, bad)


def test_moments_of_spheres_apart_by_closed_form():
    """V = 4/3 π Σ r³, and by Steiner 2/5 m r² + m d² per unit density."""
    centres, radii = np.array([[3.0, 0.0, 1.0], [-2.0, 1.0, 0.0]]), np.array([1.0, 1.5])
    volume, second = union_moments(centres, radii)
    mass = 4.0 / 3.0 * math.pi * radii**3
    offset = (centres**2).sum(axis=1)[:, None] - centres**2
    # quadrature on 200 000 points of equal area
    assert volume == pytest.approx(mass.sum(), rel=1e-4)
    assert second == pytest.approx((mass[:, None] * (0.4 * radii[:, None] ** 2 + offset)).sum(axis=0), rel=1e-4)


def test_the_lens_of_two_spheres_counts_once():
    """Two unit spheres at distance 1: the lens is π (4 + d)(2 − d)²/12."""
    volume, _ = union_moments(np.array([[-0.5, 0, 0], [0.5, 0, 0]]), np.ones(2))
    assert volume == pytest.approx(8.0 / 3.0 * math.pi - math.pi * 5.0 / 12.0, rel=1e-3)


def test_distance_from_a_box(tmp_path):
    """Over a face, over an edge, over a corner, inside; a box of 20 × 12 × 6 mm."""
    path = saved(trimesh.creation.box((20, 12, 6)), tmp_path / "box.ply")
    points = np.array([[1.0, 2.0, 5.0], [12.0, 9.0, 0.0], [11.0, 8.0, 5.0], [0.0, 0.0, 2.5]]) * 1e-3
    expected = np.array([2.0, math.hypot(2, 3), 3.0, 0.5]) * 1e-3
    assert distance_to_mesh(Solid("mesh", file=str(path), unit="mm"), points) == pytest.approx(expected, rel=1e-6)


def test_errors_of_the_inscribed_sphere_of_a_cube(tmp_path):
    path = saved(trimesh.creation.box((10, 10, 10)), tmp_path / "cube.ply")
    found = sphere_error(Solid("mesh", file=str(path), unit="mm"), np.zeros((1, 3)), np.array([5e-3]))
    outward = dblquad(lambda y, x: (math.sqrt(x * x + y * y + 25) - 5) ** 2, 0, 5, 0, 5)[0] / 25
    # 4000 points on the cube
    assert found.rms == pytest.approx(1e-3 * math.sqrt(outward), rel=0.01)
    assert found.largest == pytest.approx(5e-3 * (math.sqrt(3) - 1), rel=1e-6)  # at a corner
    # a lattice of 200 000 cells
    assert found.covered == pytest.approx(math.pi / 6, abs=2e-3)
    assert found.volume == pytest.approx(4 / 3 * math.pi * 125e-9, rel=1e-4)
    assert found.second == pytest.approx(np.full(3, 0.4 * found.volume * 25e-6), rel=1e-3)
