"""Numbers and units of a report: as people read them, and intervals as SciPy computes them."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from explorer.report.findings import half_width, interval_of_mean, mean_and_sd
from explorer.report.units_for_people import code, number, p_value, parameter_label, parameter_range, parameter_value


def test_intervals_agree_with_scipy():
    values = [24.1, 22.8, 27.3, 25.0, 23.2]
    mean, sd = mean_and_sd(values)
    low, high = stats.t.interval(0.95, 4, loc=mean, scale=stats.sem(values))
    assert (mean - interval_of_mean(sd, 5), mean + interval_of_mean(sd, 5)) == pytest.approx((low, high))
    assert interval_of_mean(None, 1) is None
    assert mean_and_sd([]) == (None, None)


def test_half_width_is_none_without_an_error():
    effect = {"by_dummies": None, "by_replicates": None}
    assert half_width({"pure_error": None, "dummy_error": None}, effect) is None


def test_units_are_those_that_people_read():
    assert parameter_value("material.seed.shear_modulus", 56.3e6) == "56.3 MPa"
    assert parameter_range("rig.outlet_height", 0.06, 0.08) == "60 … 80 mm"
    assert parameter_value("insertion.rate", 0.02) == "20 g/s"
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


def test_code_span_cannot_be_left():
    assert code("a`b") == "`a'b`"
