"""Numbers and units of a report: as people read them, and intervals as SciPy computes them."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from doe.analysis.screening import analyse_screening
from doe.analysis.t_tests import Sample
from doe.designs import factorial
from doe.run_records import sample_of
from explorer.units import (
    code,
    counted,
    number,
    observable_label,
    observed,
    own_path,
    p_value,
    parameter_label,
    parameter_range,
    parameter_value,
    percent,
    with_sign,
)


def test_intervals_agree_with_scipy():
    values = [24.1, 22.8, 27.3, 25.0, 23.2]
    sample = Sample.of(values)
    low, high = stats.t.interval(0.95, 4, loc=sample.mean, scale=stats.sem(values))
    assert (sample.mean - sample.half_width, sample.mean + sample.half_width) == pytest.approx((low, high))
    assert math.isnan(Sample.of(values[:1]).half_width)
    empty = sample_of([], "angle_of_repose_deg")
    assert empty.n == 0
    assert math.isnan(empty.mean)
    assert math.isnan(empty.standard_error)


def test_half_width_is_nan_without_an_error():
    levels = factorial(2)
    full = np.column_stack(
        [levels, levels.prod(axis=1)]
    )  # as many columns as the rows allow: nothing is left for error
    found = analyse_screening(full, ("a", "b", "ab"), np.array([[1.0], [2.0], [3.0], [4.5]]), ())
    assert found.deciding_error is None
    assert math.isnan(found.half_width(found.effects[0]))


def test_units_are_those_that_people_read():
    assert parameter_value("material.seed.shear_modulus", 56.3e6) == "56.3 MPa"
    assert parameter_range("rig.outlet_height", 0.06, 0.08) == "60 … 80 mm"
    assert parameter_value("insertion.rate", 0.02) == "20 g/s"
    assert parameter_value("rig.slot_width", 0.09) == "90 mm"
    assert parameter_value("rig.lift_speed", 0.02) == "0.02 m/s"
    assert parameter_value("rig.speed_rpm", 15.0) == "15 rpm"
    assert parameter_value("rig.filled_volume", 8e-4) == "0.0008 m³"
    assert parameter_value("body.spheres", "coarse") == "coarse"
    assert parameter_label("pair.seed.rigid_sieve_plate.static_friction") == "static friction seed–rigid sieve plate"


@given(st.floats(min_value=-1e12, max_value=1e12, allow_subnormal=False))
def test_number_reads_back_within_its_digits(value):
    # Three significant digits round by at most half of the last: 5 in 1000.
    assert float(number(value, 3).replace("−", "-")) == pytest.approx(value, rel=5.01e-3)


@pytest.mark.parametrize("value", [None, math.nan, math.inf])
def test_missing_number_is_a_dash(value):
    assert number(value) == "–"
    assert p_value(value) == "–"
    assert percent(value) == "–"
    assert parameter_range("rig.outlet_height", 0.06, value) == "–"


def test_code_span_cannot_be_left():
    assert code("a`b") == "`a'b`"


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        (own_path("porosity", ""), 0.0025, "0.0025"),
        (own_path("porosity", ""), 0.41234, "0.412"),
        (own_path("porosity", ""), -3e-6, "−3.00e−06"),
        (own_path("porosity", ""), 0.0, "0.00"),
        (own_path("load", "N"), 24.6789, "24.68 N"),
        ("solid_fraction", 0.0031, "0.0031"),
        ("apex_height_m", 4e-6, "0.004 mm"),
        ("apex_height_m", 0.00123, "1.23 mm"),
        ("angle_of_repose_deg", 0.1234, "0.12°"),
        ("angle_of_repose_deg", math.nan, "–"),
    ],
)
def test_no_value_of_an_observable_is_rounded_away(name, value, text):
    assert observed(name, value) == text


def test_a_difference_has_its_sign():
    assert [with_sign(observed("apex_height_m", value)) for value in (0.002, -0.002, 0.0, math.nan)] == [
        *("+2.00 mm", "−2.00 mm", "+0.00 mm", "–")
    ]


def test_a_label_has_no_unit_in_it():
    names = ("apex_height_m", "bulk_density_kg_m3", "discharge_t10_s", "drum/dynamic_angle_deg", "stray_fraction")
    assert [observable_label(name) for name in names] == [
        *("apex height", "bulk density", "discharge t10", "dynamic angle, drum", "stray fraction")
    ]


def test_one_is_singular():
    assert [counted(n, "degree of freedom") for n in (1, 2)] == ["1 degree of freedom", "2 degrees of freedom"]
    assert [counted(n, "factor") for n in (0, 1)] == ["0 factors", "1 factor"]


def test_no_digits_are_made_up_for_a_large_value():
    assert observed(own_path("load", "N"), 269859940865.84) == "2.699e+11 N"
    assert observed(own_path("load", "N"), -999999.0) == "−999999.00 N"
