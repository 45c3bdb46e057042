"""The vector of summaries: chosen by names alone, in a fixed order, and the same for data and runs."""

import dataclasses

import numpy as np
import pytest

from doe.measurement import (
    load_measurement,
    readings_of_record,
    summaries_of_data,
    summaries_of_record,
    summary_names,
    summary_uncertainties,
)
from doe.measurement.measurement import Condition, Observation
from doe.measurement.piles import read_pile
from doe.measurement.summaries import ASYMMETRY, MOST, PREFERRED, Summary
from solver.assets import measurement_folder
from solver.observables.free_surface import column_places
from solver.pours.record import FreeSurface
from tests.doe.measurement.folders import TABLE, write
from tests.solver.observables.made_up import pile_of, record_of

SCENE = load_measurement(measurement_folder("trefoil_1")).conditions[0].scene


def offering(*names, curves=None):
    """A condition of two replicates with these scalars, and curves at so many places."""
    scalars = [Observation(name, "", None, np.array([1.0, 2.0]), 0.5) for name in names]
    profiles = [
        Observation(name, "m", np.arange(n) * 0.01, np.tile(np.arange(n) * 1.0, (2, 1)), 0.1)
        for name, n in (curves or {}).items()
    ]
    return Condition("c", "fit", SCENE, 2, tuple(scalars + profiles))


def test_the_order_is_fixed_and_twelve_are_enough():
    everything = [name for name in PREFERRED if name != ASYMMETRY]
    offered = offering(*reversed(everything), "angle_of_repose_left_deg", "angle_of_repose_right_deg")
    assert summary_names(offered) == PREFERRED[:MOST]


def test_views_and_flanks_only_stand_in_for_a_missing_mean():
    single = ("angle_of_repose_deg@0", "angle_of_repose_deg@90", "angle_of_repose_left_deg")
    assert summary_names(offering(*single)) == single
    assert summary_names(offering(*single, "angle_of_repose_deg")) == ("angle_of_repose_deg",)


def test_asymmetry_is_left_minus_right():
    condition = offering("angle_of_repose_left_deg", "angle_of_repose_right_deg")
    assert summary_names(condition)[0] == ASYMMETRY
    np.testing.assert_array_equal(summaries_of_data(condition)[:, 0], [0.0, 0.0])
    assert Summary(ASYMMETRY, "deg", ("a", "b")).of({"a": 21.0, "b": 18.5}) == 2.5
    # Two independent readings of 0.5 each.
    assert summary_uncertainties(condition)[0] == pytest.approx(0.5 * np.sqrt(2.0), rel=1e-12)


def test_curves_fill_up_where_scalars_are_few():
    names = summary_names(offering("apex_height_m", curves={"height_profile_m": 30}))
    assert names[0] == "apex_height_m"
    # Eight of 30 places, spread evenly from the first to the last.
    assert names[1:] == tuple(f"height_profile_m({0.01 * k:g})" for k in (0, 4, 8, 12, 17, 21, 25, 29))
    values = summaries_of_data(offering("apex_height_m", curves={"height_profile_m": 30}))
    np.testing.assert_array_equal(values[1], [2.0, 0, 4, 8, 12, 17, 21, 25, 29])


def test_a_short_curve_is_taken_whole():
    names = summary_names(offering(curves={"surface_profile_m": 3}))
    assert names == ("surface_profile_m(0)", "surface_profile_m(0.01)", "surface_profile_m(0.02)")


def test_slopes_of_a_listed_profile_say_nothing_new():
    names = summary_names(offering("slope_deg", "slope_core_deg", curves={"surface_profile_m": 11}))
    assert len(names) == 8
    assert all(name.startswith("surface_profile_m(") for name in names)
    assert summary_names(offering("slope_deg", "slope_core_deg")) == ("slope_core_deg", "slope_deg")


def test_the_choice_does_not_depend_on_values():
    condition = offering("apex_height_m", "stray_fraction", curves={"height_profile_m": 9})
    other = dataclasses.replace(
        condition,
        observations=tuple(dataclasses.replace(o, values=np.zeros_like(o.values)) for o in condition.observations),
    )
    assert summary_names(other) == summary_names(condition)


def test_missing_data_are_nan(tmp_path):
    condition = load_measurement(write(tmp_path)).conditions[0]
    names = summary_names(condition)
    assert names == ("angle_of_repose_deg", "discharged_mass_kg(0.5)", "discharged_mass_kg(1)")
    np.testing.assert_array_equal(summaries_of_data(condition), [[20.0, 0.001, 0.003], [22.0, 0.002, np.nan]])
    assert "1,angle_of_repose_deg,,20.0" in TABLE


def test_a_run_with_a_scanned_pile_has_the_summaries_of_that_scan():
    """The contract of the diagnosis: one code for both. Data and run are the same pile, so the numbers are equal."""
    measurement = load_measurement(measurement_folder("trefoil_1"))
    condition = measurement.conditions[0]
    pile = read_pile(measurement.folder / "piles/fit_2.npz", condition.scene)
    time, mass = condition.offered["discharged_mass_kg"].x, condition.offered["discharged_mass_kg"].values[1]
    record = dataclasses.replace(record_of(pile, time, mass, mass[-1]), scene=condition.scene)
    data, run = summaries_of_data(condition)[1], summaries_of_record(condition, record)
    flow = [name.startswith(("discharge", "residual")) for name in summary_names(condition)]
    np.testing.assert_array_equal(run[~np.array(flow)], data[~np.array(flow)])
    # Times are read between listed points 50 ms apart, theirs from every step; 30 g do not all arrive.
    np.testing.assert_allclose(run[flow], data[flow], atol=0.05)


def test_slopes_of_a_run_are_taken_over_the_listed_places():
    """A bent surface: the slope over all columns is another one than over the places that the data list."""
    x = np.array([-0.02, -0.01, -0.005, 0.0, 0.005, 0.01, 0.02])
    listed = Observation("surface_profile_m", "m", x, np.zeros((1, x.size)), 1e-3)
    slopes = [Observation(name, "deg", None, np.zeros(1), 1.0) for name in ("slope_deg", "slope_core_deg")]
    condition = Condition("drum", "fit", SCENE, 1, (listed, *slopes))
    columns = column_places(42e-3)
    surface = FreeSurface(np.zeros(1), columns, (-0.5 * columns + 1e4 * columns**4 * np.sign(columns))[None])
    pile = pile_of(np.zeros((1, 3)), np.ones(1), np.zeros(1, dtype=np.int32))
    record = dataclasses.replace(record_of(pile, np.zeros(1), np.zeros(1), 1.0), free_surface=surface)
    readings = readings_of_record(condition, record)
    y = np.interp(x, columns, surface.height[0])
    by_hand = np.degrees(np.arctan(-np.polyfit(x, y, 1)[0]))
    core = np.degrees(np.arctan(-np.polyfit(x[2:5], y[2:5], 1)[0]))  # |x| < 10 mm: the ends do not count
    assert readings["slope_deg"] == pytest.approx(by_hand, rel=1e-9)
    assert readings["slope_core_deg"] == pytest.approx(core, rel=1e-9)
