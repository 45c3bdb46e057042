"""Screening against statsmodels, the paper's printed table, and simulated truth."""

import json
import math

import numpy as np
import pandas as pd
import pytest
import statsmodels.formula.api as smf
from scipy import stats
from statsmodels.stats.anova import anova_lm
from statsmodels.stats.multitest import multipletests

from doe.analysis.screening import FALLBACK, SIGNIFICANT, analyse_screening, select_factors
from doe.designs import plackett_burman
from doe.errors import StatisticsError

DESIGN = plackett_burman(28)
FACTORS = [f"X{i}" for i in range(1, 25)]
DUMMIES = ["D1", "D2", "D3"]
NAMES = FACTORS + DUMMIES

# Processes 2022, 10, 185, Table 6: sums of squares, F and p of X1..X24 (error: three dummy columns).
PAPER_SS = np.array(
    [
        (1.80, 0.3214, 0.2721, 56.52, 0.0001, 0.3214, 63.12, 0.7957, 3.98, 3.28, 0.7426, 0.3432),
        (0.0146, 2.02, 1.57, 41.29, 4.35, 2.04, 0.1317, 0.4784, 1.71, 3.76, 0.1889, 3.29),
    ]
).ravel()
PAPER_F = np.array(
    [
        (3.95, 0.7051, 0.5968, 123.97, 0.0001, 0.7051, 138.46, 1.75, 8.74, 7.19, 1.63, 0.7529),
        (0.0321, 4.43, 3.45, 90.56, 9.55, 4.48, 0.2888, 1.05, 3.75, 8.25, 0.4144, 7.22),
    ]
).ravel()
PAPER_P = np.array(
    [
        (0.1411, 0.4627, 0.4961, 0.0016, 0.9918, 0.4627, 0.0013, 0.2782, 0.0597, 0.0750, 0.2917, 0.4494),
        (0.8692, 0.1260, 0.1601, 0.0025, 0.0537, 0.1247, 0.6283, 0.3810, 0.1482, 0.0640, 0.5656, 0.0746),
    ]
).ravel()


def planted(effects, sigma, replicates, seed=0):
    """Return responses 24 + sum effect/2 x + noise, shape (28, replicates)."""
    generator = np.random.default_rng(seed)
    truth = np.full(28, 24.0)
    for name, effect in effects.items():
        truth += effect / 2 * DESIGN[:, NAMES.index(name)]
    return truth[:, None] + sigma * generator.standard_normal((28, replicates))


def screen(values, dummies):
    """Analyse responses of the 28-run design."""
    return analyse_screening(DESIGN, NAMES, values, dummies)


def by_name(screening):
    return {effect.name: effect for effect in screening.effects}


def test_the_papers_sums_of_squares_give_the_papers_f_and_p():
    """The paper prints no rows, but any complete design with its sums of squares must give its F and p."""
    # The printed F of X7 fixes the residual mean square, 63.12/138.46, which the three dummies share equally.
    residual = 63.12 / 138.46
    effects = dict(zip(NAMES, np.sqrt(np.append(PAPER_SS, [residual] * 3) / 7), strict=True))
    screening = screen(planted(effects, 0.0, 1), DUMMIES)
    for effect, ss, f, p in zip(screening.effects[:24], PAPER_SS, PAPER_F, PAPER_P, strict=True):
        assert effect.sum_of_squares == pytest.approx(ss, rel=1e-9)
        # The printed sums of squares carry 3 to 4 significant digits, or one digit for X5.
        assert effect.by_dummies.f == pytest.approx(f, rel=6e-3, abs=2e-4)
        assert effect.by_dummies.p == pytest.approx(p, rel=2e-2, abs=5e-3)
    assert screening.significant(adjust="none") == ("X7", "X4", "X16")
    assert screening.error_source == "dummies"


def test_complete_replicated_screening_agrees_with_statsmodels():
    values = planted({"X7": 2.0, "X4": -1.0}, 1.0, 3)
    screening = screen(values, DUMMIES)
    frame = pd.DataFrame(np.repeat(DESIGN, 3, axis=0), columns=NAMES).assign(y=values.ravel())
    # All 27 columns saturate the 28 rows, so the residual of this fit is pure error.
    fit = smf.ols("y ~ " + " + ".join(NAMES), frame).fit()
    for effect in screening.effects:
        assert effect.effect == pytest.approx(2 * fit.params[effect.name], abs=1e-10)
        assert effect.by_replicates.standard_error == pytest.approx(2 * fit.bse[effect.name])
        assert effect.by_replicates.p == pytest.approx(fit.pvalues[effect.name], rel=1e-8)
        low, high = fit.conf_int().loc[effect.name]
        assert screening.half_width(effect) == pytest.approx(high - low)
    factors = [effect.by_replicates for effect in screening.effects[:24]]
    for method, own in (("holm", "p_holm"), ("bonferroni", "p_bonferroni")):
        adjusted = multipletests([one.p for one in factors], method=method)[1]
        assert [getattr(one, own) for one in factors] == pytest.approx(adjusted)
    means = pd.DataFrame(DESIGN, columns=NAMES).assign(y=values.mean(axis=1))
    table = anova_lm(smf.ols("y ~ " + " + ".join(FACTORS), means).fit(), typ=3)
    for effect in screening.effects[:24]:
        assert effect.sum_of_squares == pytest.approx(table.loc[effect.name, "sum_sq"], rel=1e-8, abs=1e-10)
        assert effect.by_dummies.p == pytest.approx(table.loc[effect.name, "PR(>F)"], rel=1e-7)
    assert sum(effect.contribution_percent for effect in screening.effects) == pytest.approx(100)


def test_missing_rows_and_replicates_agree_with_statsmodels():
    values = planted({"X7": 3.0}, 1.0, 3)
    values[4] = values[20] = np.nan
    values[9, 1] = np.nan
    screening = screen(values, DUMMIES)
    means = pd.DataFrame(DESIGN, columns=NAMES).assign(y=pd.DataFrame(values).mean(axis=1)).dropna()
    fit = smf.ols("y ~ " + " + ".join(FACTORS), means).fit()
    for effect in screening.effects[:24]:
        assert effect.effect == pytest.approx(2 * fit.params[effect.name], abs=1e-9)
        assert effect.by_dummies.p == pytest.approx(fit.pvalues[effect.name], rel=1e-7)
    assert screening.missing_rows == (4, 20)
    assert screening.dummy_error.df == 1
    assert screening.pure_error.df == 26 * 2 - 1
    poured = np.delete(values, [4, 20], axis=0)
    squares = np.nansum((poured - np.nanmean(poured, axis=1, keepdims=True)) ** 2)
    assert screening.pure_error.sigma == pytest.approx(math.sqrt(squares / 51))
    assert screening.runs == 77
    assert math.isnan(by_name(screening)["D1"].effect)
    assert "Rows 5, 21" in screening.notes[0]


def test_unequal_replicates_give_the_variance_of_the_contrast():
    """Var(effect) = sigma^2 sum c_r^2/n_r with c = ±1/14: here 27 rows of 2 runs and one of 1."""
    values = planted({}, 1.0, 2)
    values[0, 0] = np.nan
    screening = screen(values, DUMMIES)
    expected = screening.pure_error.sigma * math.sqrt((27 / 2 + 1) / 14**2)
    assert screening.effects[0].by_replicates.standard_error == pytest.approx(expected)


def test_what_the_factors_leave_is_the_lack_of_fit_of_statsmodels():
    """Rows of one, two and three runs: the factors' model of all runs against a mean of its own for every row."""
    values = planted({"X7": 2.0}, 1.0, 3) + (DESIGN[:, 6] * DESIGN[:, 3])[:, None]
    values[:9, 1] = values[:5, 2] = np.nan
    frame = pd.DataFrame(np.repeat(DESIGN, 3, axis=0), columns=NAMES)
    frame = frame.assign(row=np.repeat(np.arange(28), 3), y=values.ravel()).dropna()
    factors, rows = (smf.ols(f"y ~ {terms}", frame).fit() for terms in (" + ".join(FACTORS), "C(row)"))
    f, p, _ = rows.compare_f_test(factors)
    found = screen(values, DUMMIES)
    assert (found.unexplained_f, found.unexplained_p) == (pytest.approx(f), pytest.approx(p))


@pytest.mark.parametrize("missing", [[1, 5, 9, 13], [1, 5, 9]])
def test_missing_rows_that_mix_up_the_factors_are_refused(missing):
    """Four rows are more than the three dummies can spare; rows 2, 6, 10 agree or mirror each other in the
    dummies.
    """
    values = planted({}, 1.0, 2)
    values[missing] = np.nan
    found = (
        rf"without rows 2, .* the {28 - len(missing)} valid rows cannot separate 24 factors .* repeat one, or declare"
    )
    with pytest.raises(StatisticsError, match=found):
        screen(values, DUMMIES)


def test_factors_that_the_design_itself_mixes_up_are_refused():
    design = np.column_stack([DESIGN[:, :2], DESIGN[:, 1]])
    found = (
        r"^responses: the 28 valid rows cannot separate 3 factors and the mean; declare an untestable factor a dummy$"
    )
    with pytest.raises(StatisticsError, match=found):
        analyse_screening(design, ["X1", "X2", "X3"], np.arange(28.0)[:, None], [])


def test_an_untestable_factor_may_serve_as_a_dummy():
    values = planted({"X7": 5.0}, 1.0, 2)
    values[[1, 5, 9, 13]] = np.nan
    screening = screen(values, [*DUMMIES, "X12", "X15", "X24"])
    assert screening.significant()[0] == "X7"
    assert screening.dummy_error.df == 2


def test_three_missing_rows_leave_no_error_between_rows():
    values = planted({}, 1.0, 1)
    values[[0, 1, 2]] = np.nan
    screening = screen(values, DUMMIES)
    assert screening.dummy_error is None
    assert screening.error_source is None
    assert screening.significant() == ()


def test_margins_are_those_of_the_design_in_units_of_sigma():
    """5 % and Bonferroni-24 margins: 0.55 and 0.91 sigma for 2 seeds per row; 1.20 and 3.81 for the dummies
    alone.
    """
    screening = screen(planted({}, 1.0, 2), DUMMIES)
    pure, dummy = screening.pure_error, screening.dummy_error
    assert pure.margin / pure.sigma == pytest.approx(0.55, abs=0.005)
    assert pure.margin_bonferroni / pure.sigma == pytest.approx(0.91, abs=0.005)
    assert dummy.margin / dummy.sigma == pytest.approx(1.20, abs=0.005)
    assert dummy.margin_bonferroni / dummy.sigma == pytest.approx(3.81, abs=0.005)
    for error in (pure, dummy):
        for change, alpha in (
            (error.smallest_detectable_effect, 0.05),
            (error.smallest_detectable_effect_bonferroni, 0.05 / 24),
        ):
            # Two-sided, seen with a chance of 0.8; the far tail is negligible.
            t = stats.nct(error.df, change / error.standard_error)
            assert t.sf(stats.t.isf(alpha / 2, error.df)) == pytest.approx(0.8, abs=1e-3)
    assert dummy.t_limit == pytest.approx(3.182, abs=5e-4)
    assert dummy.t_limit_bonferroni == pytest.approx(10.07, abs=5e-3)


def test_planted_effects_are_found_in_order():
    screening = analyse_screening(DESIGN, NAMES, planted({"X7": 6.0, "X16": -4.0, "X4": 5.0}, 1.0, 3), DUMMIES)
    assert screening.significant() == ("X7", "X4", "X16")
    assert screening.unexplained_p > 0.001


def test_noise_only_keeps_the_error_rates():
    """2 x 150 noise studies: each p uniform, and Holm's family-wise rate, within binomial limits."""
    raw = family = 0
    studies = 150
    for seed in range(studies):
        screening = screen(planted({}, 1.0, 2, seed), DUMMIES)
        raw += len(screening.significant(adjust="none"))
        family += bool(screening.significant())
    # Limits at 99.99 %, because the 24 tests of a study share one error and so scatter a little more.
    low, high = stats.binom.interval(0.9999, studies * 24, 0.05)
    assert low <= raw <= high
    assert family <= stats.binom.ppf(0.999, studies, 0.05)


def test_an_interaction_shows_in_the_dummies():
    values = planted({}, 0.5, 3) + 4 * (DESIGN[:, 6] * DESIGN[:, 3])[:, None]
    screening = screen(values, DUMMIES)
    assert screening.unexplained_p < 1e-6
    assert any("interactions leak" in note for note in screening.notes)


def test_constant_response_tests_nothing_and_says_so():
    screening = screen(np.full((28, 2), 24.1), DUMMIES)
    assert screening.significant() == ()
    assert all(effect.effect == 0 for effect in screening.effects)
    assert any("same in every row" in note for note in screening.notes)
    assert any("seed" in note for note in screening.notes)


def test_selection_fills_up_from_the_fallback_and_skips_what_cannot_be_tested():
    screening = screen(planted({"X9": 5.0, "X12": 8.0}, 1.0, 3), DUMMIES)
    chosen = select_factors(screening, 3, fallback=["X4", "X9", "X7", "X16"], exclude=["X12", "X4"])
    assert [(c.name, c.reason) for c in chosen] == [("X9", SIGNIFICANT), ("X7", FALLBACK), ("X16", FALLBACK)]


def test_selection_skips_what_was_given_up_for_one_target_and_estimated_for_another():
    first = screen(planted({"X9": 5.0}, 1.0, 3), [*DUMMIES, "X12"])
    further = {"other": screen(planted({"X12": 8.0}, 1.0, 3), DUMMIES)}
    chosen = select_factors(first, 2, fallback=["X7"], exclude=["X12"], further=further)
    assert [c.name for c in chosen] == ["X9", "X7"]


def test_a_factor_of_several_targets_stands_where_it_acts_most():
    first, second = (screen(planted(effects, 1.0, 3), DUMMIES) for effects in ({"X9": 8.0, "X4": 4.0}, {"X9": 2.0}))
    for one, further in ((first, {"other": second}), (second, {"other": first})):
        assert [chosen.name for chosen in select_factors(one, 2, further=further)] == ["X9", "X4"]
    assert select_factors(second, 2, further={"other": first})[1].reason == f"{SIGNIFICANT} in other"


def test_selection_refuses_a_short_fallback_and_unknown_names():
    screening = screen(np.full((28, 2), 24.0), DUMMIES)
    with pytest.raises(StatisticsError, match="leaves 2 of 4 factors"):
        select_factors(screening, 4, fallback=["X4", "X7"])
    with pytest.raises(StatisticsError, match="'D1' is not a factor"):
        select_factors(screening, 3, fallback=["D1"])


@pytest.mark.parametrize(
    "change, message",
    [
        ({"responses": np.ones((27, 2))}, r"responses has shape \(27, 2\)"),
        ({"responses": np.full((28, 2), np.nan)}, "no valid run"),
        ({"responses": np.full((28, 2), np.inf)}, "infinite"),
        ({"names": NAMES[:-1]}, "names has 26 entries"),
        ({"dummies": ["D9"]}, "'D9'"),
        ({"design": 2 * DESIGN}, "levels from -1 to"),
    ],
)
def test_bad_input_is_named(change, message):
    arguments = {
        "design": DESIGN,
        "names": NAMES,
        "responses": planted({}, 1.0, 2),
        "dummies": DUMMIES,
    } | change
    with pytest.raises(StatisticsError, match=message):
        analyse_screening(**arguments)


def test_the_result_is_plain_json():
    result = screen(planted({"X7": 3.0}, 1.0, 2), DUMMIES).to_dict()
    assert json.loads(json.dumps(result, allow_nan=False))["effects"][6]["by_replicates"]["p_holm"] < 0.05


def test_the_small_design_over_assumptions_is_analysed_alike():
    design = plackett_burman(12)
    names = ["height", "rate", "speed", "seed_share", "thickness", "spheres", "D1", "D2", "D3", "D4", "D5"]
    values = 24 + 3 * design[:, [0]] + np.random.default_rng(3).standard_normal((12, 3))
    screening = analyse_screening(design, names, values, names[6:])
    assert screening.significant() == ("height",)
    assert screening.dummy_error is not None
    assert screening.dummy_error.df == 5
