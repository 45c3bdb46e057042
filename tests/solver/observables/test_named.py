"""Observables by name, of runs and of scans: curves at given places, views from any azimuth, the same numbers."""

import dataclasses

import numpy as np
import pytest

from solver.observables import PileReading, height_profile, observe, observe_pile
from solver.observables.free_surface import column_places
from solver.observables.named import all_names, named, observe_named, observe_scan
from solver.observables.packing import solid_fraction
from solver.observables.pile import centre_height
from solver.pours.record import FreeSurface
from solver.scenes.body import Body, Members
from solver.scenes.material import Material
from solver.scenes.scene import Scene
from tests.solver.observables.made_up import cone, empty_pile, record_of, seeds_in_cone

SEEDS = seeds_in_cone(25.0, 60, np.random.default_rng(1), reach=0.5)
TIME, MASS = np.array([0.0, 1.0, 2.0]), np.array([0.0, 0.02, 0.03])
RECORD = record_of(SEEDS, TIME, MASS, 0.03)


def test_every_name_says_what_it_is():
    for name in all_names():
        known = named(name)
        assert known is not None
        assert known.name == name
        assert (known.x_unit is not None) == (name in ("discharged_mass_kg", "height_profile_m", "surface_profile_m"))
    assert named("angle_of_repose_deg@37.5").unit == "deg"
    assert named("angle_of_repose_deg@x") is named("height") is None


def test_scalars_are_those_of_a_run():
    values = observe(RECORD)
    readings = observe_named(RECORD, dict.fromkeys(values))
    assert readings == {name: value.value for name, value in values.items()}


def test_a_scan_gives_what_the_run_gave():
    wanted = {"apex_height_m": None, "solid_fraction": None, "height_profile_m": np.array([0.01]), "slope_deg": None}
    readings = observe_scan(SEEDS, RECORD.scene, wanted)
    assert set(readings) == {"apex_height_m", "solid_fraction", "height_profile_m"}
    assert readings["solid_fraction"] == solid_fraction(RECORD).value
    assert readings["apex_height_m"] == observe_pile(SEEDS)["apex_height_m"].value


def test_discharged_mass_at_given_times():
    # By hand: half of 0.02 at 0.5 s, 0.025 at 1.5 s; nothing before, held after.
    at = observe_named(RECORD, {"discharged_mass_kg": np.array([-1.0, 0.5, 1.5, 9.0])})["discharged_mass_kg"]
    np.testing.assert_allclose(at, [0.0, 0.01, 0.025, 0.03], rtol=1e-12)


def test_height_profile_at_the_middles_of_its_rings():
    radius, height = height_profile(PileReading(SEEDS))
    at = observe_named(RECORD, {"height_profile_m": radius[[0, 3, 7]]})["height_profile_m"]
    np.testing.assert_allclose(at, height[[0, 3, 7]], rtol=1e-12)


def test_height_profile_reaches_as_far_as_asked():
    assert observe_named(RECORD, {"height_profile_m": np.array([0.4])})["height_profile_m"] == [0.0]


def test_surface_profile_of_a_plane_bed():
    x = column_places(42e-3)
    surface = FreeSurface(np.array([0.0, 0.1]), x, np.tile(-0.5 * x, (2, 1)))
    record = dataclasses.replace(RECORD, free_surface=surface)
    at = observe_named(record, {"surface_profile_m": np.array([-0.02, 0.0, 0.0133, 0.04])})["surface_profile_m"]
    # Linear between columns: exact on a plane. Beyond the middle 60 % (25.2 mm) it is not read.
    np.testing.assert_allclose(at, [0.01, 0.0, -0.00665, np.nan], atol=1e-15)


def test_a_view_from_behind_shows_the_same_mean():
    readings = observe_named(RECORD, {"angle_of_repose_deg@30": None, "angle_of_repose_deg@210": None})
    assert readings["angle_of_repose_deg@30"] == readings["angle_of_repose_deg@210"]


def test_a_view_beside_the_listed_azimuths_turns_with_the_pile():
    angle = np.radians(7.0)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    spheres = dataclasses.replace(SEEDS.spheres, centre=SEEDS.spheres.centre @ turn.T)
    turned = dataclasses.replace(SEEDS, spheres=spheres, position=SEEDS.position @ turn.T)
    before = observe_scan(SEEDS, RECORD.scene, {"angle_of_repose_deg@0": None})["angle_of_repose_deg@0"]
    after = observe_scan(turned, RECORD.scene, {"angle_of_repose_deg@7": None})["angle_of_repose_deg@7"]
    # The same outline; rounding of the rotation may move a sphere's edge over a pixel.
    assert after == pytest.approx(before, abs=0.05)


def test_centre_height_of_a_cone_is_a_quarter_of_its_height():
    # The tiling of columns of 0.8 mm: 0.2 % of the height.
    assert centre_height(PileReading(cone(25.0, height=30e-3))).value == pytest.approx(7.5e-3, rel=0.005)
    assert np.isnan(centre_height(PileReading(empty_pile())).value)


def test_a_scan_that_is_not_finite_is_nan():
    centre = SEEDS.spheres.centre.copy()
    centre[0, 0] = np.nan
    broken = dataclasses.replace(SEEDS, spheres=dataclasses.replace(SEEDS.spheres, centre=centre))
    ball = Members(((0.0, 0.0, 0.0),), (1e-3,), 1e-6, (1e-12,) * 3)
    scene = Scene("one", (Material("m"),), (Body("a", "m", 1.0, ball, 500.0),), ())
    readings = observe_scan(broken, scene, {"apex_height_m": None, "height_profile_m": np.array([0.01, 0.02])})
    assert np.isnan(readings["apex_height_m"])
    assert np.isnan(readings["height_profile_m"]).all()
