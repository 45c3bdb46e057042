"""Features of data and of runs: by the same functions, and only those that the data can carry."""

import dataclasses

import numpy as np
import pytest

from doe.measurement import load_measurement
from doe.measurement.features import (
    LISTED,
    PROFILE,
    SCALARS,
    SCAN,
    cells_of,
    coarse_map,
    feature_set,
    features_of_data,
    features_of_record,
    frame_of_scene,
    offer_of,
    ring_heights,
)
from doe.measurement.piles import PileSurface
from doe.measurement.scans import Scan
from solver import Spheres, unpacked
from solver.assets import measurement_folder
from tests.doe.golden_readings import RAW_POURS
from tests.doe.measurement.folders import MATERIAL, changed, write


@pytest.fixture(scope="module")
def trefoil():
    return load_measurement(measurement_folder("trefoil_1")).fit[0]


@pytest.fixture(scope="module")
def pour():
    """A stored pour of trefoils."""
    return unpacked((RAW_POURS / "trefoils.npz").read_bytes())


def scanned(condition, spheres, grid, noise=0.0, axis=(0.0, 0.0)):
    """The condition with one replicate, its pile scanned at ``grid`` [m] with ``noise`` [m]."""
    seen = PileSurface(spheres).height_map(frame_of_scene(condition.scene).half_width, grid)
    n = seen.height.shape[0]
    places = (np.arange(n) + 0.5 - n / 2) * grid
    x, y = np.meshgrid(places, places, indexing="ij")
    z = seen.height + noise * np.random.default_rng(0).standard_normal(seen.height.shape)
    points = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    return dataclasses.replace(condition, replicates=1, surfaces={1: Scan(points, grid, axis)}, observations=())


def plain(condition):
    """Names of the features without how they are seen."""
    return [name.partition("@")[0] for name in feature_set(condition).names]


def test_the_frame_is_that_of_the_declared_scene(trefoil):
    frame = frame_of_scene(trefoil.scene)
    assert frame.thickness == pytest.approx(6e-3)
    assert cells_of(trefoil) == (pytest.approx(0.5e-3), 3)
    assert 0.02 < frame.radius < 0.1


def test_the_frame_of_a_mixture_has_the_solid_volume_of_its_parts(trefoil):
    """Half of the mass each of 1000 and of 3000 kg/m³: the cube of the radius is the mean of both alone."""
    scene, (body,) = trefoil.scene, trefoil.scene.bodies
    light, heavy = (dataclasses.replace(body, name=name, density=rho) for name, rho in (("a", 1e3), ("b", 3e3)))
    alone = [frame_of_scene(dataclasses.replace(scene, bodies=(one,))).radius for one in (light, heavy)]
    halves = tuple(dataclasses.replace(one, mass_fraction=0.5) for one in (light, heavy))
    mixed = frame_of_scene(dataclasses.replace(scene, bodies=halves))
    assert mixed.radius**3 == pytest.approx((alone[0] ** 3 + alone[1] ** 3) / 2)
    assert alone[0] == pytest.approx(3 ** (1 / 3) * alone[1])


def test_what_is_offered_follows_from_what_is_there(trefoil):
    assert offer_of(trefoil) == SCAN
    listed = dataclasses.replace(trefoil, surfaces={})
    assert offer_of(listed) == PROFILE
    bare = tuple(one for one in trefoil.observations if one.observable != LISTED)
    assert offer_of(dataclasses.replace(listed, observations=bare)) == SCALARS


def test_a_pile_of_spheres_gives_data_and_run_the_same_numbers(trefoil, pour):
    """The upper surface of a run's own spheres is what the run is read by: not a bit differs."""
    condition = dataclasses.replace(
        trefoil, replicates=1, surfaces={1: PileSurface(pour.pile.spheres)}, observations=()
    )
    names = feature_set(condition)
    assert np.array_equal(features_of_data(condition)[0], features_of_record(condition, pour))
    assert len(names.names) == len(features_of_record(condition, pour))


def test_a_fine_scan_of_a_pile_gives_nearly_the_same_numbers(trefoil, pour):
    """A scan of 0.5 mm with 0.05 mm of noise: rings within 0.1 mm and 1 %, volume within 1 %."""
    condition = scanned(trefoil, pour.pile.spheres, 0.5e-3, 0.05e-3)
    names = plain(condition)
    data = dict(zip(names, features_of_data(condition)[0], strict=True))
    run = dict(zip(names, features_of_record(condition, pour), strict=True))
    for name in names:
        if name.startswith("ring_height"):
            assert data[name] == pytest.approx(run[name], abs=0.1e-3 + 0.01 * run[name])
    assert data["ring_volume_m3"] == pytest.approx(run["ring_volume_m3"], rel=0.01)
    assert data["height_q90_m"] == pytest.approx(run["height_q90_m"], abs=0.2e-3)
    assert data["skew_x_m"] == pytest.approx(run["skew_x_m"], abs=0.2e-3)
    assert data["slope"] == pytest.approx(run["slope"], rel=0.05)


def test_a_coarse_scan_says_nothing_of_single_bodies(trefoil, pour):
    """Spheres of 6 mm are seen at 1.5 mm and not at 2 mm; what is read at 2 mm has names of its own."""
    fine, coarse = (plain(scanned(trefoil, pour.pile.spheres, grid)) for grid in (1.5e-3, 2e-3))
    assert "slope" in fine
    assert not [name for name in coarse if name.startswith(("slope", "height_share", "ring_roughness"))]
    assert "height_q90_m" in coarse
    assert "height_q90_m@1 x 2 mm" in feature_set(scanned(trefoil, pour.pile.spheres, 2e-3)).names


@pytest.mark.parametrize(("grid", "times"), [(0.5e-3, 3), (0.7e-3, 2), (0.8e-3, 1), (1.5e-3, 1), (2e-3, 1)])
def test_a_pixel_is_as_many_cells_as_fit_into_a_quarter_of_a_body(trefoil, pour, grid, times):
    """1.5 mm of 6 mm, no more unless a cell is; the coarsest scan says how wide a cell is."""
    assert cells_of(scanned(trefoil, pour.pile.spheres, grid)) == (grid, times)


def test_a_scan_without_an_axis_says_nothing_of_where_the_pile_leans(trefoil, pour):
    names = plain(scanned(trefoil, pour.pile.spheres, 1e-3, axis=None))
    assert "ring_volume_m3" in names
    assert not [name for name in names if "skew" in name]


def test_listed_heights_are_averaged_over_rings(trefoil):
    """h = a − b r over a ring from r₁ to r₂: a − 2 b (r₂³ − r₁³) / (3 (r₂² − r₁²)); beyond the places nothing."""
    frame = frame_of_scene(trefoil.scene)
    places = np.linspace(0.0, 0.9 * frame.half_width, 200)
    found = ring_heights(places, 0.03 - 0.2 * places, frame)
    low, high = frame.ring_width, 2.0 * frame.ring_width
    assert found[1] == pytest.approx(0.03 - 0.4 * (high**3 - low**3) / (3.0 * (high**2 - low**2)), rel=1e-3)
    assert found[-1] == 0.0
    # The first height holds down to the axis.
    assert ring_heights(places[places > low], np.full((places > low).sum(), 0.02), frame)[0] == pytest.approx(0.02)


def test_listed_heights_give_the_profile_of_data_and_run(trefoil, pour):
    """The run's heights at the listed places make its rings: the same numbers as from a table of them."""
    listed = dataclasses.replace(trefoil, surfaces={})
    names = feature_set(listed)
    assert all("@" in name for name in names.profile)
    data = features_of_data(listed)
    assert data.shape == (trefoil.replicates, names.offered(PROFILE))
    assert np.isfinite(data[:, len(names.scalars) :]).all()
    run = features_of_record(listed, pour)
    assert len(run) == len(names.names)


@pytest.mark.parametrize("diameter", ["6.1e-3", "6.2e-3", "12e-3"])
def test_pixels_are_whole_cells_whatever_a_body_s_size(diameter, tmp_path):
    """A third of 6.1 mm/4, three times, is not 6.1 mm/4 to the last bit: the map would end within a pixel."""
    folder = write(tmp_path, {"material.toml": changed(MATERIAL, "12e-3", diameter)})
    condition = load_measurement(folder).fit[0]
    radius = float(diameter) / 2.0
    bead = PileSurface(Spheres(np.array([[0.0, 0.0, radius]]), np.array([radius]), np.array([0])))
    seen = coarse_map(bead, condition)
    thickness = frame_of_scene(condition.scene).thickness
    assert seen.pixel == pytest.approx(thickness)
    assert len(seen.height) * thickness == pytest.approx(
        2.0 * frame_of_scene(condition.scene).half_width, abs=2.0 * thickness
    )
    # Half a ball over its plate: 2/3 π r³ and the upright wall π r³ below its widest circle.
    assert seen.volume(np.inf) == pytest.approx(5.0 / 3.0 * np.pi * radius**3, rel=0.05)
