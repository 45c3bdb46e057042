"""Printed numbers, rounding, formulas, votes and the flight after an impact, each against what is known by hand."""

import math

import numpy as np
import pytest

from doe.audit.anova_table import consistency, read_lines, source_name
from doe.audit.printed import most_agreed, printed, rounding_slack
from doe.audit.restitution_formula import evaluated, flight, names_in
from doe.audit.study import AnovaLine
from doe.audit.verification import _targets as targets_of
from doe.audit.verification import implied_target
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


def test_errors_beyond_100_percent_imply_a_target_below_the_response_only():
    stated, responses = printed("30.0"), tuple(map(printed, ("70.0", "80.0", "33.0")))
    assert implied_target(responses, tuple(map(printed, ("133.3", "166.7", "5.0"))), stated) is None
    other = implied_target(responses, tuple(map(printed, ("180.0", "220.0", "32.0"))), stated)
    assert other is not None
    assert other.value == 25.0


def test_an_error_implies_a_target_below_the_response_and_one_above():
    """25.325 … 25.335 over 1 ± 6.965 … 6.975 %: the widest interval on either side."""
    below, above = targets_of(25.33, 0.005, printed("6.97"))
    assert below == pytest.approx((25.325 / 1.06975, 25.335 / 1.06965))
    assert above == pytest.approx((25.325 / 0.93035, 25.335 / 0.93025))


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
        ("Regression", "model"),
        ("Total Model", "model"),
        ("Residuals", "residual"),
        ("Residual Error", "residual"),
        ("Total Error", "residual"),
        ("Lack-of-Fit", "lack_of_fit"),
        ("Cor Total", "total"),
        ("Corrected Total", "total"),
        ("C. Total", "total"),
        ("Total SS", "total"),
        ("  2-Way Interaction", "interaction"),
        ("Crossproduct", "interaction"),
        ("Quadratic", "square"),
        ("FO(x1, x2)", "linear"),
        ("x1", "X1"),
        ("X1:X2", "X1*X2"),
        ("X2*X1", "X1*X2"),
        ("X1 by X2", "X1*X2"),
        ("X1*X1", "X1^2"),
        ("I(X1^2)", "X1^2"),
        ("X1 (Q)", "X1^2"),
        ("X1(150,200)", "X1"),
        ("(X1-175)*(X2-20)", "X1*X2"),
        ("(X1-175)*(X1-175)", "X1^2"),
        ("X1^2*X2", "x1_2_x2"),
        ("X3", "x3"),
        ("Curvature", "curvature"),
    ],
)
def test_lines_of_an_anova_are_known_by_their_usual_names(printed_name, name):
    assert source_name(printed_name, ("X1", "X2")) == name


def lines_of(*sources, factors=("Temp", "Rate"), df=None):
    degrees = df or [None] * len(sources)
    prints = [
        AnovaLine(source, df=None if n is None else printed(str(n))) for source, n in zip(sources, degrees, strict=True)
    ]
    return [(line.role, line.source) for line in read_lines(prints, factors)]


def test_letters_and_numbers_of_factors_are_those_that_the_table_gives_them():
    expert = lines_of("A-Temp", "B-Rate", "AB", "A²", "B^2")
    assert [source for _, source in expert] == ["Temp", "Rate", "Temp*Rate", "Temp^2", "Rate^2"]
    statistica = lines_of("(1)Temp (L)", "Temp (Q)", "(2)Rate(L)", "Rate(Q)", "1L by 2L")
    assert [source for _, source in statistica] == ["Temp", "Temp^2", "Rate", "Rate^2", "Temp*Rate"]
    # A letter that nothing explains could be any factor; 1L by 2Q is no term of second order.
    assert lines_of("A", "AB") == [("other", "a"), ("other", "ab")]
    assert lines_of("(1)Temp (L)", "(2)Rate (L)", "1L by 2Q")[2][0] == "other"
    assert lines_of("A-Temp", factors=("A", "B")) == [("term", "A")]


def test_the_uncorrected_total_of_spss_is_no_total():
    roles = [role for role, _ in lines_of("Corrected Model", "Temp", "Error", "Total", "Corrected Total")]
    assert roles == ["model", "term", "residual", "other", "total"]


def test_error_is_the_residual_unless_the_table_has_another():
    assert lines_of("Temp", "Error", "Total")[1] == ("residual", "residual")
    assert lines_of("Temp", "Error", "Lack-of-Fit", "Pure Error")[1] == ("residual", "residual")
    assert lines_of("Temp", "Error", "Pure Error", "Total Error")[1] == ("residual", "residual")
    assert lines_of("Temp", "Residual", "Lack of Fit", "Error")[3] == ("pure_error", "pure_error")
    assert lines_of("Model", "Lack of Fit", "Error", "Total", df=[5, 3, 4, 12])[2] == ("pure_error", "pure_error")
    assert lines_of("Model", "Lack of Fit", "Error", "Total", df=[5, 3, 7, 12])[2] == ("residual", "residual")


@pytest.mark.parametrize(
    "f, agrees",
    [("47.22", True), ("47.2", True), ("47.214", True), ("47.23", False), ("40.22", False), ("4.722", False)],
)
def test_f_is_the_quotient_of_the_prints_and_of_nothing_beside_them(f, agrees):
    """484.00/10.25: 483.995/10.255 … 484.005/10.245 by the mean squares, SS/df = 51.25/5 leaves 10.249 … 10.251."""
    line = AnovaLine("A", printed("484.00"), printed("1"), printed("484.00"), printed(f))
    error = AnovaLine("Residual", printed("51.25"), printed("5"), printed("10.25"))
    judged, role = consistency(read_lines([line, error], ("A",)))
    assert (judged[0, "f"].agrees, role) == (agrees, "residual")
    assert judged[0, "f"].interval == pytest.approx((483.995 / 10.251, 484.005 / 10.249))


def test_an_f_that_was_divided_by_hand_is_no_fault():
    """33.25/3 = 11.0833, printed 11.08: over 9.00 it gives 1.2311 by hand and 1.2315 unrounded."""
    for f in ("1.2311", "1.2315"):
        lack = AnovaLine("Lack of fit", printed("33.250"), printed("3"), printed("11.08"), printed(f))
        error = AnovaLine("Pure error", printed("18.000"), printed("2"), printed("9.00"))
        assert consistency(read_lines([lack, error], ()))[0][0, "f"].agrees
