"""Clumps: limits of the fit, stated errors against independent counts, symmetry, refusals."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from solver.shapes.clump import Clump, _fit_spheres, explicit_clump, fit_clump
from solver.shapes.solid import ShapeError, Solid, mass_properties, surface_mesh
from solver.shapes.sphere_fit import FitTarget, _Residuals, orbits_of
from solver.shapes.sphere_union import distance_to_union, union_volume

SEED = Solid("ellipsoid", (27.92e-3, 11.18e-3, 6.11e-3))
PLATE = Solid("box", (27.53e-3, 15.02e-3, 5.0e-3))
PETIOLE = Solid("cylinder", (5.35e-3, 57.56e-3))
SOLIDS = {"seed": SEED, "plate": PLATE, "petiole": PETIOLE}


@pytest.mark.parametrize("name", SOLIDS)
def test_standard_clump_follows_the_solid(name):
    fit = fit_clump(SOLIDS[name], 346.0, "standard").fit
    assert fit.n_spheres >= 9
    assert fit.volume_ratio >= 0.70
    assert fit.covered_ratio >= 0.70
    assert fit.surface_rms <= 0.5e-3
    assert np.abs(fit.extent_errors).max() <= 0.02
    assert fit.smallest_radius >= 2e-3


@pytest.mark.parametrize("name", SOLIDS)
def test_resolutions_are_ordered(name):
    coarse, standard, fine = (fit_clump(SOLIDS[name], 346.0, level).fit for level in ("coarse", "standard", "fine"))
    assert coarse.n_spheres < 0.7 * standard.n_spheres
    assert standard.n_spheres < fine.n_spheres
    assert coarse.surface_rms > standard.surface_rms > fine.surface_rms
    for fit in (coarse, standard, fine):
        assert np.abs(fit.extent_errors).max() <= 0.02


def inside_union(clump: Clump, points: np.ndarray) -> np.ndarray:
    return np.any(
        [((points - c) ** 2).sum(axis=1) <= r**2 for c, r in zip(clump.centres, clump.radii, strict=True)],
        axis=0,
    )


@pytest.mark.parametrize("name", SOLIDS)
def test_stated_volumes_agree_with_monte_carlo(name):
    solid = SOLIDS[name]
    clump = fit_clump(solid, 346.0, "standard")
    low = (clump.centres - clump.radii[:, None]).min(axis=0)
    high = (clump.centres + clump.radii[:, None]).max(axis=0)
    points = np.random.default_rng(3).uniform(low, high, (200_000, 3))
    volume = mass_properties(solid, 1.0).volume
    in_union = inside_union(clump, points)
    x, y, z = (2 * points / mass_properties(solid, 1.0).extents).T
    in_solid = {
        "seed": x**2 + y**2 + z**2 <= 1,
        "plate": np.maximum.reduce([abs(x), abs(y), abs(z)]) <= 1,
        "petiole": (abs(x) <= 1) & (y**2 + z**2 <= 1),
    }[name]
    box = float(np.prod(high - low))
    # 0.01: three standard errors of the counts are 0.006, the lattice behind covered_ratio adds 0.003
    assert in_union.mean() * box / volume == pytest.approx(clump.fit.volume_ratio, abs=0.01)
    assert (in_union & in_solid).mean() * box / volume == pytest.approx(clump.fit.covered_ratio, abs=0.01)


def test_stated_deviation_agrees_with_a_dense_union_surface():
    """Every distance again: a random sample of the solid to a random sample of the union's surface."""
    clump = fit_clump(SEED, 346.0, "standard")
    rng = np.random.default_rng(5)
    faces = surface_mesh(SEED, 6)
    points = faces.triangles_center[rng.choice(len(faces.faces), 1500, p=faces.area_faces / faces.area)]
    directions = rng.normal(size=(len(clump.radii), 6000, 3))
    directions /= np.linalg.norm(directions, axis=2, keepdims=True)
    shell = clump.centres[:, None] + clump.radii[:, None, None] * directions
    shrunk = Clump(clump.centres, clump.radii * (1 - 1e-9), 1.0, clump.inertia, 1.0, clump.fit)
    shell = shell.reshape(-1, 3)
    shell = shell[~inside_union(shrunk, shell)]
    distances = np.array([np.sqrt(((shell - p) ** 2).sum(axis=1).min()) for p in points])
    # 0.02 mm: sampling error of the mean of 1500 squares, and the shell's spacing of 0.1 mm seen sideways
    assert np.sqrt((distances**2).mean()) == pytest.approx(clump.fit.surface_rms, abs=2e-5)
    assert distances.max() == pytest.approx(clump.fit.surface_max, abs=1e-4)


def test_union_of_two_spheres_by_closed_form():
    radii = np.array([1.0, 1.0])
    centres = np.array([[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]])
    # lens of two unit spheres at distance d = 1: pi (4 + d) (2 - d)^2 / 12
    lens = math.pi * 5.0 / 12.0
    assert union_volume(centres, radii) == pytest.approx(8 / 3 * math.pi - lens, rel=2e-3)
    # outside, inside on the axis, and in the middle, whose nearest place is the groove at sqrt(1 - 1/4)
    points = np.array([[3.0, 0, 0], [1.0, 0, 0], [0.0, 0, 0]])
    # 3e-3: the groove is known to the spacing of points along it
    np.testing.assert_allclose(distance_to_union(points, centres, radii), [1.5, 0.5, math.sqrt(0.75)], atol=3e-3)


@pytest.mark.parametrize("name", SOLIDS)
def test_clump_is_mirror_symmetric_and_has_the_inertia_of_the_solid(name):
    clump = fit_clump(SOLIDS[name], 346.0, "standard")
    spheres = {(*c, r) for c, r in zip(clump.centres.tolist(), clump.radii.tolist(), strict=True)}
    for axis in range(3):
        mirror = np.ones(3)
        mirror[axis] = -1.0
        # + 0.0 turns -0.0 into 0.0
        mirrored = clump.centres * mirror + 0.0
        assert {(*c, r) for c, r in zip(mirrored.tolist(), clump.radii.tolist(), strict=True)} == spheres
    properties = mass_properties(SOLIDS[name], 346.0)
    assert clump.mass == properties.mass
    np.testing.assert_array_equal(clump.inertia, properties.inertia)
    assert clump.bounding_radius == (np.linalg.norm(clump.centres, axis=1) + clump.radii).max()


def test_density_moves_mass_and_nothing_else():
    light, heavy = fit_clump(SEED, 300.0, "coarse"), fit_clump(SEED, 600.0, "coarse")
    np.testing.assert_array_equal(light.centres, heavy.centres)
    np.testing.assert_allclose(heavy.inertia, 2.0 * light.inertia, rtol=1e-14)


def test_clump_scales_with_the_solid():
    small = fit_clump(SEED, 346.0, "coarse")
    large = fit_clump(Solid("ellipsoid", tuple(2.0 * d for d in SEED.dimensions)), 346.0, "coarse")
    # a factor of two is exact in binary, so every step of the fit is the same
    np.testing.assert_allclose(large.centres, 2.0 * small.centres, atol=1e-9)
    np.testing.assert_allclose(large.radii, 2.0 * small.radii, rtol=1e-7)


def test_same_bits_again(tmp_path, monkeypatch):
    first = fit_clump(SEED, 346.0, "standard")
    monkeypatch.setenv("REPOSE_CACHE", str(tmp_path))  # empty: it is fitted again
    _fit_spheres.cache_clear()
    again = fit_clump(SEED, 346.0, "standard")
    assert again.centres is not first.centres
    np.testing.assert_array_equal(again.centres, first.centres)
    np.testing.assert_array_equal(again.radii, first.radii)
    assert again.fit == first.fit


def test_arrays_are_read_only():
    with pytest.raises(ValueError, match="read-only"):
        fit_clump(SEED, 346.0, "coarse").radii[0] = 1.0


@pytest.mark.parametrize("level", ["coarse", "standard", "fine"])
def test_sphere_is_one_sphere_exactly(level):
    clump = fit_clump(Solid("sphere", (6e-3,)), 346.0, level)
    np.testing.assert_array_equal(clump.centres, np.zeros((1, 3)))
    np.testing.assert_array_equal(clump.radii, [3e-3])
    assert clump.fit.volume_ratio == 1.0
    assert clump.fit.surface_rms == 0.0


def test_mesh_of_the_seed_fits_as_well_as_the_closed_form(tmp_path: Path):
    file = tmp_path / "seed.stl"
    turn = trimesh.transformations.rotation_matrix(0.7, [1, 2, 3])
    surface_mesh(SEED, 4).apply_transform(turn).export(file)
    fit = fit_clump(Solid("mesh", file=str(file)), 346.0, "standard").fit
    closed = fit_clump(SEED, 346.0, "standard").fit
    assert fit.n_spheres <= closed.n_spheres + 2
    assert fit.surface_rms <= 1.1 * closed.surface_rms
    assert fit.volume_ratio >= 0.9
    assert np.abs(fit.extent_errors).max() <= 0.02


def test_moving_the_mesh_leaves_the_clump(tmp_path: Path):
    # tapered and lopsided: no mirror plane, so that the frame is the body's own
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=1.0)
    v = mesh.vertices
    mesh.vertices = v * [14e-3, 6e-3, 4e-3] * (1.0 + v @ np.array([0.2, 0.15, 0.1]))[:, None]
    turn = trimesh.transformations.rotation_matrix(2.0, [0.3, -1.0, 0.4])
    turn[:3, 3] = [0.03, -0.02, 0.05]
    for name, shape in {"one": mesh, "two": mesh.copy().apply_transform(turn)}.items():
        shape.export(tmp_path / f"{name}.ply")
    one, two = (
        fit_clump(Solid("mesh", file=str(tmp_path / f"{name}.ply")), 346.0, "coarse") for name in ("one", "two")
    )
    # files hold 32-bit coordinates, and a minimum that hangs on which sphere is nearest may move further
    assert two.fit.n_spheres == one.fit.n_spheres
    assert two.fit.surface_rms == pytest.approx(one.fit.surface_rms, rel=0.02)
    assert two.mass == pytest.approx(one.mass, rel=1e-5)
    np.testing.assert_allclose(two.inertia, one.inertia, rtol=1e-4)
    np.testing.assert_allclose(two.centres, one.centres, atol=2e-4)


def test_bent_mesh_keeps_its_spheres_inside(tmp_path: Path):
    """An L of two bars: a sphere in its inner corner touches the surface, but stands for nothing."""
    bars = [trimesh.creation.box((30e-3, 6e-3, 6e-3)), trimesh.creation.box((6e-3, 20e-3, 6e-3))]
    outline = np.array([[0, 0], [30, 0], [30, 6], [6, 6], [6, 26], [0, 26]]) * 1e-3
    bottom, top = (np.column_stack([outline, np.full(6, z)]) for z in (0.0, 6e-3))
    caps = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)]
    faces = [(c, b, a) for a, b, c in caps] + [(a + 6, b + 6, c + 6) for a, b, c in caps]
    for i in range(6):
        j = (i + 1) % 6
        faces += [(i, j, j + 6), (i, j + 6, i + 6)]
    mesh = trimesh.Trimesh(np.concatenate([bottom, top]), faces)
    assert mesh.volume == pytest.approx(sum(bar.volume for bar in bars))
    mesh.export(tmp_path / "angle.stl")
    fit = fit_clump(Solid("mesh", file=str(tmp_path / "angle.stl")), 346.0, "12").fit
    # spheres that touch the inner corner from outside would put a sixth of the union there
    assert fit.covered_ratio >= 0.88 * fit.volume_ratio
    assert fit.covered_ratio >= 0.6
    assert np.abs(fit.extent_errors).max() <= 0.05


@pytest.mark.parametrize("symmetric", [True, False])
def test_gradient_of_the_residuals_is_that_of_finite_differences(symmetric):
    rng = np.random.default_rng(1)
    centres = np.array([[0.0, 0, 0], [1.1, 0, 0], [1.3, 0.6, 0]])
    orbits = orbits_of(centres, np.array([0.9, 0.8, 0.7]), symmetric)
    normals = rng.normal(size=(300, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    surface = normals * [2.0, 1.0, 0.8]
    target = FitTarget(
        np.abs(surface) if symmetric else surface,
        np.abs(normals) if symmetric else normals,
        rng.uniform(-0.5, 0.5, (50, 3)),
        np.array([[-2, -1, -0.8], [2, 1, 0.8]]),
        symmetric,
    )
    model = _Residuals(orbits, target)
    x = model.pack(orbits)
    _, gradient, _ = model(x)
    step = 1e-6
    numeric = [(model(x + step * e)[0] - model(x - step * e)[0]) / (4 * step) for e in np.eye(len(x))]
    # 1e-5: a point within 1e-6 of changing its nearest sphere would add a kink of that order
    np.testing.assert_allclose(gradient, numeric, rtol=1e-5, atol=1e-6)


TREFOIL: dict[str, Any] = {
    "centres": [[0.0, 3.0e-3, 0.0], [-2.598076e-3, -1.5e-3, 0.0], [2.598076e-3, -1.5e-3, 0.0]],
    "radii": [3.0e-3, 3.0e-3, 3.0e-3],
    "mass": 1.14381e-4,
    "inertia": [9.458021e-10, 9.458021e-10, 1.471203e-09],
}


def test_explicit_clump_is_taken_as_declared():
    clump = explicit_clump(**TREFOIL)
    np.testing.assert_array_equal(clump.centres, TREFOIL["centres"])
    np.testing.assert_array_equal(clump.inertia, TREFOIL["inertia"])
    assert clump.mass == TREFOIL["mass"]
    assert clump.bounding_radius == pytest.approx(6.0e-3, rel=1e-6)
    assert clump.fit.n_spheres == 3
    # its declared mass is that of the union at 346 kg/m3
    assert union_volume(clump.centres, clump.radii) * 346.0 == pytest.approx(clump.mass, rel=2e-3)


@pytest.mark.parametrize(
    "change, message",
    [
        ({"centres": [[0.0, 0.0]]}, "sphere_centres"),
        ({"centres": []}, "sphere_centres"),
        ({"centres": [[0, 0, 0], [1, 2]]}, "sphere_centres"),
        ({"centres": [[0, 0, math.nan]] * 3}, "finite"),
        ({"radii": [1e-3]}, "one radius for each"),
        ({"radii": [1e-3, -1e-3, 1e-3]}, "positive"),
        ({"radii": ["a", "b", "c"]}, "sphere_radii"),
        ({"mass": 0.0}, "mass"),
        ({"mass": -1.0}, "mass"),
        ({"mass": math.inf}, "mass"),
        ({"inertia": [1e-9, 1e-9]}, "three positive"),
        ({"inertia": [1e-9, 1e-9, 0.0]}, "three positive"),
        ({"inertia": [1e-9, 1e-9, 3e-9]}, "sum of the other two"),
    ],
)
def test_bad_explicit_clumps_are_refused(change, message):
    with pytest.raises(ShapeError, match=message) as caught:
        explicit_clump(**{**TREFOIL, **change})
    assert "\n" not in str(caught.value)


def test_bad_resolution_and_density_are_refused():
    with pytest.raises(ShapeError, match="coarse, standard, fine"):
        fit_clump(SEED, 346.0, "medium")  # type: ignore[arg-type]
    with pytest.raises(ShapeError, match="density"):
        fit_clump(SEED, -1.0, "coarse")


@pytest.mark.parametrize(
    ("solid", "spheres"),
    [(Solid("box", (10e-3, 10e-3, 1e-4)), "coarse"), (Solid("cylinder", (2e-4, 20e-3)), "coarse")],
)
def test_a_solid_too_slender_for_a_resolution_is_refused_in_one_line(solid, spheres, tmp_path, monkeypatch):
    monkeypatch.setenv("REPOSE_CACHE", str(tmp_path))
    with pytest.raises(
        ShapeError, match=r"^[^\n]*too slender for the \d+ spheres of this resolution; allowed: thicker"
    ):
        fit_clump(solid, 346.0, spheres)
