"""Printed numbers, rounding, formulas, votes and the flight after an impact, each against what is known by hand."""

import math

import numpy as np
import pytest

from doe.audit.printed import most_agreed, printed, rounding_slack
from doe.audit.restitution_formula import evaluated, flight, names_in
from doe.audit.anova_table import source_name
from doe.errors import AuditError


@pytest.mark.parametrize(
    "text, value, half",
    [
        ("24.68", 24.68, 0.005),
        ("346", 346.0, 0.5),
        ("0.50", 0.5, 0.005),
        ("-219.08", -219.08, 0.005),
        ("\u2212249", -249.0, 0.5),
        ("1.2e-3", 1.2e-3, 5e-5),
    ],
)
def test_a_print_stands_for_what_rounds_to_it(text, value, half):
    print_ = printed(text)
    assert (print_.value, print_.half) == (value, pytest.approx(half, rel=1e-12))
    assert print_.agrees(value + 0.99 * half)
    assert not print_.agrees(value + 1.01 * half)
    assert print_.agrees(value + 1.5 * half, slack=0.6 * half)


def test_a_bound_holds_what_is_beyond_it():
    assert printed("<0.0001").agrees(2e-5)
    assert not printed("<0.0001").agrees(2e-4)
    assert printed(">100").agrees(120.0)
    assert not printed(">100").agrees(80.0)


@pytest.mark.parametrize("text", ["1e300", "-1e31", "1e-300"])
def test_a_size_that_no_quantity_has_is_refused(text):
    with pytest.raises(AuditError, match="is out of range"):
        printed(text)


@pytest.mark.parametrize("text", ["", "24,68", "nan", "inf", "about 3", "1e9999", "--1", "0x10"])
def test_what_is_no_printed_number_is_refused(text):
    with pytest.raises(AuditError, match="is not a printed number"):
        printed(text)


def test_slack_of_a_sum_and_of_a_product():
    halves = np.full(3, 0.5)
    slack = rounding_slack(lambda x: np.array([x.sum(), x[0] * 10]), np.array([1.0, 2.0, 3.0]), halves)
    # Three standard deviations of three uniform errors, √(3 · 3 · 0.25) = 1.5, here the worst case as well.
    assert slack == pytest.approx([1.5, 5.0])
    many = rounding_slack(lambda x: np.array([x.sum()]), np.zeros(100), np.full(100, 0.5))
    assert many == pytest.approx([math.sqrt(3 * 100) * 0.5])


def test_rounding_of_inputs_stays_within_the_slack():
    rng = np.random.default_rng(0)
    truth = rng.uniform(1, 2, (500, 12))

    def variance(y):
        return np.array([y.var(ddof=1)])

    off = [abs(variance(np.round(y, 2)) - variance(y))[0] for y in truth]
    slacks = [rounding_slack(variance, np.round(y, 2), np.full(12, 0.005))[0] for y in truth]
    assert np.mean(np.array(off) <= slacks) > 0.99
    assert np.median(slacks) < 10 * np.median(off)


def test_the_majority_names_the_unknown_and_the_outlier():
    low, high, held = most_agreed([((1.0, 2.0),), ((1.5, 2.5),), ((1.6, 3.0), (8.0, 9.0)), ((8.5, 9.5),)], 0.0)
    assert (low, high) == (1.6, 2.0)
    assert held == (True, True, True, False)
    low, high, _ = most_agreed([((1.0, 2.0),), ((5.0, 6.0),)], near=5.4)
    assert (low, high) == (5.0, 6.0)


def test_formulas():
    assert evaluated("E / (2 * G) - 1", {"E": 147.6, "G": 56.3}) == pytest.approx(0.31083, abs=1e-5)
    assert evaluated("tan(radians(sigma))", {"sigma": 45.0}) == pytest.approx(1.0)
    assert evaluated("-a ** 2 + pi", {"a": 2.0}) == pytest.approx(math.pi - 4)
    assert math.isnan(evaluated("1 / x", {"x": 0.0}))
    assert math.isnan(evaluated("sqrt(x)", {"x": -1.0}))
    assert math.isnan(evaluated("10 ** 1000", {}))
    assert math.isnan(evaluated("x ** 0.5", {"x": -8.0}))
    assert names_in("L / (2 * H) + sqrt(L) * pi") == ("L", "H")


@pytest.mark.parametrize(
    "formula",
    [
        "__import__('os')",
        "a.b",
        "a[0]",
        "lambda: 1",
        "f(1)",
        "sqrt(1, 2)",
        "'x'",
        "a and b",
        "True",
        "1 +",
        "",
        "b",
        "(" * 150 + "1" + ")" * 150,
        "1j",
    ],
)
def test_nothing_but_arithmetic_is_carried_out(formula):
    with pytest.raises(AuditError, match="formula"):
        evaluated(formula, {"a": 1.0})


def test_the_flight_after_a_horizontal_rebound_gives_l_over_2h():
    e = 0.57
    horizontal = flight(e, e, 45.0, 0.2, 0.2)
    assert horizontal.vy == pytest.approx(0.0, abs=1e-15)
    assert horizontal.distance / (2 * horizontal.fall) == pytest.approx(e, rel=1e-12)
    # v (k + e)/2 across, v (e − k)/2 up, from v = √(2 g H): by hand for k = 1.
    v = math.sqrt(2 * 9.81 * 0.2)
    free = flight(e, 1.0, 45.0, 0.2, 0.2)
    assert (free.vx, free.vy) == (pytest.approx(v * 0.785), pytest.approx(-v * 0.215))
    time = v / 9.81 * (-0.215 + math.sqrt(0.215**2 + 1))
    assert free.distance == pytest.approx(v * 0.785 * time)


def test_a_flight_keeps_its_energy_along_the_plate():
    """Perfectly elastic and frictionless: the speed after the impact is that before."""
    found = flight(1.0, 1.0, 30.0, 0.3, 0.1)
    assert math.hypot(found.vx, found.vy) == pytest.approx(found.impact_speed, rel=1e-12)


@pytest.mark.parametrize(
    "printed_name, name",
    [
        ("X1X2", "X1*X2"),
        ("X1 × X2", "X1*X2"),
        ("X1²", "X1^2"),
        ("X2^2", "X2^2"),
        ("Lack of fit", "lack_of_fit"),
        ("Pure Error", "pure_error"),
        ("Sum", "total"),
        ("model", "model"),
    ],
)
def test_lines_of_an_anova_are_known_by_their_usual_names(printed_name, name):
    assert source_name(printed_name, ("X1", "X2")) == name
