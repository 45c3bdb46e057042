"""Factors that are names against R, statsmodels and closed forms."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import stats
from statsmodels.formula.api import ols
from statsmodels.stats.anova import anova_lm

from doe.analysis.models import corrected_aic
from doe.analysis.named_factors import MOST_COMBINATIONS, columns_of, fit_named
from doe.analysis.optimum import ResponseTarget
from doe.analysis.surface import Blocks
from doe.designs.optimal import codes
from doe.errors import StatisticsError
from explorer.design.analysis import AnalyseOrder, run_analyse
from tests.doe.analysis.textbook import region

SHEETS = Path(__file__).parents[1] / "against_r"
NAMES = ("w", "x", "y", "z")


def analysed(name, **order):
    return run_analyse(AnalyseOrder(str(SHEETS / f"{name}.csv"), **order)).analysis.named


def rows_of(fit):
    return {row.source: (row.sum_of_squares, row.df, row.f, row.p) for row in fit.rows}


def test_two_factors_of_names_are_those_of_r():
    """> options(contrasts = c("contr.sum", "contr.poly")); m <- lm(breaks ~ wool * tension, warpbreaks)
    > drop1(m, . ~ ., test = "F")          # wool 450.666667, 2 of 2034.259259, 2 of 1002.777778; F, p below
    > summary(m)$sigma                     # 10.9402840372
    > summary(m)$coefficients              # tension1 8.240741 ± 2.105459 (L), tension2 -1.759259 (M)
    """
    found = analysed("warpbreaks", order="interactions")
    rows = rows_of(found)
    assert rows["A"] == pytest.approx((450.6666667, 1, 3.76529, 0.05821298), rel=1e-6)
    assert rows["B"] == pytest.approx((2034.2592593, 2, 8.49805, 0.00069262), rel=1e-5)
    assert rows["A*B"] == pytest.approx((1002.7777778, 2, 4.18907, 0.02104419), rel=1e-6)
    assert found.sigma == pytest.approx(10.9402840372)
    means = {(one.factor, one.name): one for one in found.means}
    assert means["B", "L"].effect == pytest.approx(8.24074074074)
    assert means["B", "L"].standard_error == pytest.approx(2.10545864463)
    assert means["B", "L"].p == pytest.approx(2.85849832378e-04)
    assert means["B", "M"].p == pytest.approx(0.40753660759)
    assert means["A", "A"].mean == pytest.approx(28.14814814815 + 2.88888888889)
    # Without numbers a cell of the full model is the mean of its runs.
    assert [group.mean for group in found.groups] == pytest.approx(
        [44.556, 24, 24.556, 28.222, 28.778, 18.778], abs=1e-3
    )


def test_a_number_beside_names_in_unequal_groups_is_that_of_r():
    """> a <- MASS::anorexia; a$x <- (a$Prewt - 82)/12; m <- lm(Postwt ~ x * Treat, a)     # with contr.sum
    > drop1(m, . ~ ., test = "F"); summary(m)$sigma; sum((resid(m)/(1 - hatvalues(m)))^2)
    > predict(m, data.frame(x = 0, Treat = levels(a$Treat)), interval = "confidence")
    """
    found = analysed("anorexia", order="interactions")
    rows = rows_of(found)
    assert rows["A"] == pytest.approx((503.4196445, 1, 11.67951, 0.00108665), rel=1e-5)
    assert rows["B"] == pytest.approx((697.9215864, 2, 8.09601, 0.00071708), rel=1e-5)
    assert rows["A*B"] == pytest.approx((466.4783165, 2, 5.41123, 0.00666559), rel=1e-5)
    assert found.sigma == pytest.approx(6.56527169854)
    assert found.press == pytest.approx(3666.09310916)
    assert [(one.mean, one.low, one.high) for one in found.groups] == [
        pytest.approx((85.1117368134, 82.6522421870, 87.5712314398)),
        pytest.approx((81.0483414695, 78.4696367659, 83.6270461732)),
        pytest.approx((89.3763042183, 86.0972877175, 92.6553207190)),
    ]
    # With every interaction the slope of a name is that of its own runs alone.
    slopes = {one.names[0]: one.coefficients[1] for one in found.groups}
    assert slopes["CBT"] == pytest.approx(6.4920934033543 + 3.6836860435846)
    assert slopes["Cont"] == pytest.approx(6.4920934033543 - 8.1023074476652)


def unbalanced(seed=0, n=60):
    """Runs with a number, four names, two names, and a block; more of some than of others."""
    random = np.random.default_rng(seed)
    x, four, two, day = (
        random.uniform(-1, 1, n),
        random.integers(4, size=n),
        random.integers(2, size=n),
        random.integers(3, size=n),
    )
    y = 5 + x - x**2 + np.array([0, 1, -1, 0.5])[four] * (1 + x) + 0.4 * two + 2 * day + random.standard_normal(n)
    coded = np.column_stack([x, codes(4)[four], codes(2)[two]])
    frame = pd.DataFrame({"y": y, "x": x, "f": four, "t": two, "d": day})
    blocks = Blocks(("mon", "tue", "wed"), day[:, None])
    return coded, y[:, None], blocks, frame


def test_the_whole_model_and_its_limits_are_those_of_statsmodels():
    coded, y, _, frame = unbalanced()
    found = fit_named(coded, y, region("ABC"), ((), NAMES, ("no", "yes")), "linear")
    theirs = ols("y ~ x + C(f,Sum) + C(t,Sum)", frame).fit()
    assert rows_of(found)["model"] == pytest.approx((theirs.ess, theirs.df_model, theirs.fvalue, theirs.f_pvalue))
    first = next(one for one in found.means if (one.factor, one.name) == ("B", "w"))
    assert (first.effect, first.standard_error, first.p) == pytest.approx(
        (theirs.params["C(f, Sum)[S.0]"], theirs.bse["C(f, Sum)[S.0]"], theirs.pvalues["C(f, Sum)[S.0]"])
    )
    contrast = np.zeros(len(theirs.params))
    contrast[[list(theirs.params.index).index(name) for name in ("Intercept", "C(f, Sum)[S.0]")]] = 1.0
    mean = theirs.t_test(contrast)
    assert (first.low, first.high) == pytest.approx(tuple(mean.conf_int()[0]))
    # p of the largest of all runs is 0.05 at the limit, with one degree of freedom less than the error's.
    assert 2 * 60 * stats.t.sf(found.outlier_limit, theirs.df_resid - 1) == pytest.approx(0.05)


@pytest.mark.parametrize("seed", range(3))
def test_joint_tests_and_predictions_are_those_of_statsmodels(seed):
    coded, y, blocks, frame = unbalanced(seed)
    levels = ((), NAMES, ("no", "yes"))
    found = fit_named(coded, y, region("ABC"), levels, "quadratic", blocks=blocks)
    theirs = ols("y ~ x*C(f,Sum) + x*C(t,Sum) + C(f,Sum)*C(t,Sum) + I(x**2) + C(d,Sum)", frame).fit()
    table = anova_lm(theirs, typ=3)
    rows = rows_of(found)
    for ours, other in {
        "A": "x", "B": "C(f, Sum)", "C": "C(t, Sum)", "A*B": "x:C(f, Sum)", "A*C": "x:C(t, Sum)",
        "B*C": "C(f, Sum):C(t, Sum)", "A^2": "I(x ** 2)",
    }.items():  # fmt: skip
        assert rows[ours] == pytest.approx(tuple(table.loc[other, ["sum_sq", "df", "F", "PR(>F)"]]), rel=1e-7)
    assert found.predicted == pytest.approx(theirs.fittedvalues.to_numpy())
    assert found.r_squared == pytest.approx(theirs.rsquared)
    assert found.r_squared_adjusted == pytest.approx(theirs.rsquared_adj)
    assert found.studentized == pytest.approx(theirs.get_influence().resid_studentized_external)
    assert found.press == pytest.approx((theirs.get_influence().resid_press ** 2).sum())
    for group in found.groups:
        at = pd.DataFrame(
            {"x": 0.0, "f": NAMES.index(group.names[0]), "t": int(group.names[1] == "yes"), "d": range(3)}
        )
        assert group.mean == pytest.approx(theirs.predict(at).mean())  # the mean of all blocks
    assert sum(group.runs for group in found.groups) == len(y)


def test_one_factor_of_names_is_the_closed_form_of_one_way():
    values = np.array([[3.0, 4, 5], [6, 8, np.nan], [1, 2, 3], [7, 7, 8]])
    found = fit_named(codes(4)[:, None], values, region("A"), (NAMES,))
    means, counts = np.nanmean(values, axis=1), (~np.isnan(values)).sum(axis=1)
    between = float(counts @ (means - np.nanmean(values)) ** 2)
    within = float(np.nansum((values - means[:, None]) ** 2))
    rows = rows_of(found)
    assert rows["A"][:3] == pytest.approx((between, 3, between / 3 / (within / 7)))
    assert [one.effect for one in found.means] == pytest.approx(means - means.mean())
    assert found.means[1].high - found.means[1].mean == pytest.approx(2.364624 * np.sqrt(within / 7 / 2), rel=1e-6)


def test_settings_of_a_name_are_where_its_own_line_meets_the_target():
    """y = a + b x per name: x = (T - a)/b, outside low … high for one of them."""
    a, b = np.array([4.0, 5, 6, 20]), np.array([1.0, 2, -1, 0.5])
    points = np.array([(x, code) for x in np.linspace(-1, 1, 5) for code in codes(4)])
    place = np.rint((points[:, 1] + 1) / 2 * 3).astype(int)
    y = a[place] + b[place] * points[:, 0] + 1e-6 * np.random.default_rng(0).standard_normal(20)
    target = ResponseTarget(5.5, 0.0, np.array([50.0, 0.0]))
    found = fit_named(
        points, y[:, None], region("AB", np.array([50.0, 0]), np.array([10.0, 1])), ((), NAMES), target=target
    )
    settings = [group.setting for group in found.groups]
    assert [one.reached for one in settings] == [False, True, True, False]
    assert [float(one.point[0]) for one in settings[1:3]] == pytest.approx([50 + 10 * 0.25, 50 + 10 * 0.5], abs=1e-4)
    assert float(settings[0].point[0]) == 60.0  # nearest in value
    natural = found.groups[1].coefficients_natural
    assert natural[:2] == pytest.approx([5 - 2 * 5, 0.2], abs=1e-4)


def test_a_target_of_names_alone_is_given_by_those_that_are_compatible_with_it():
    values = np.array([[3.0, 4, 5], [6, 8, 7], [1, 2, 3], [7, 7, 8]])
    target = ResponseTarget(7.0, 0.0, np.zeros(1))
    found = fit_named(codes(4)[:, None], values, region("A"), (NAMES,), target=target)
    inside = [one.low <= 7.0 <= one.high for one in found.groups]
    assert [group.setting.reached for group in found.groups] == inside == [False, True, False, True]


def test_reduction_drops_whole_terms_and_keeps_what_products_stand_on():
    coded, y, _, frame = unbalanced(1, 200)
    found = fit_named(coded, y, region("ABC"), ((), NAMES, ("no", "yes")), "quadratic", reduction="p")
    assert {"A", "B", "A*B"} <= set(found.terms)
    found = fit_named(coded, y, region("ABC"), ((), NAMES, ("no", "yes")), "quadratic", reduction="aicc")
    theirs = ols("y ~ x*C(f,Sum)", frame).fit()
    ours = fit_named(coded, y, region("ABC"), ((), NAMES, ("no", "yes")), terms=("A*B",))
    assert ours.terms == ("A", "B", "A*B")
    assert ours.sigma**2 * ours.df_residual == pytest.approx(theirs.ssr)
    assert found.reduced.criterion <= corrected_aic(theirs.ssr, int(theirs.df_resid), 200)


def test_what_the_runs_cannot_tell_is_refused_by_name():
    points = np.array([(x, x) for x in codes(3)] * 3)
    with pytest.raises(StatisticsError, match="9 valid runs do not tell A, B apart"):
        fit_named(points, np.arange(9.0)[:, None], region("AB"), (NAMES[:3], NAMES[:3]), "linear")
    with pytest.raises(StatisticsError, match="leave no error for 4 columns"):
        fit_named(codes(4)[:, None], np.arange(4.0)[:, None], region("A"), (NAMES,))
    with pytest.raises(StatisticsError, match="B has named levels and therefore no square"):
        columns_of((0, 3), ("A", "B", "B^2"))


def test_a_response_that_never_changes_gives_no_test():
    found = fit_named(np.repeat(codes(3), 3)[:, None], np.full((9, 1), 0.1), region("A"), (NAMES[:3],))
    assert found.sigma == 0
    assert np.isnan([found.r_squared, *(row.p for row in found.rows)]).all()


def test_of_many_combinations_of_names_those_that_were_run_are_listed():
    random = np.random.default_rng(0)
    coded = codes(4)[random.integers(4, size=(60, 4))]
    found = fit_named(coded, random.standard_normal((60, 1)), region("ABCD"), (NAMES,) * 4, "linear")
    assert len(found.groups) == len(np.unique(coded, axis=0)) <= 60 < MOST_COMBINATIONS < 4**4
    assert sum(group.runs for group in found.groups) == 60


def test_combinations_that_nobody_ran_are_not_written_out():
    """4^14 of them would take gigabytes."""
    random = np.random.default_rng(0)
    coded = codes(4)[random.integers(4, size=(60, 14))]
    found = fit_named(coded, random.standard_normal((60, 1)), region("ABCDEFGHIJKLMN"), (NAMES,) * 14, "linear")
    assert len(found.groups) == 60
