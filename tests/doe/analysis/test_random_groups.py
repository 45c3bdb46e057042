"""Variance components and tests beside them against expected mean squares, R's nlme and aov, and statsmodels."""

import warnings

import numpy as np
import pytest
import statsmodels.api as sm
from scipy import stats

from doe.analysis.named_factors import columns_of
from doe.analysis.random_groups import fit_random
from doe.analysis.surface import Blocks
from doe.designs import factorial
from doe.designs.optimal import codes
from doe.errors import StatisticsError
from explorer.design.analysis import AnalyseOrder, run_analyse
from explorer.errors import CommandError
from tests.doe.analysis.test_named_factors import SHEETS
from tests.doe.analysis.textbook import region

TWO = ((), ())


def analysed(name, **order):
    return run_analyse(AnalyseOrder(str(SHEETS / f"{name}.csv"), **order)).analysis.random


def told(fit):
    return {one.source: one for one in fit.tests}


def blocks_of(group):
    return Blocks(tuple(f"g{k}" for k in range(max(group) + 1)), np.asarray(group)[:, None])


def split_plot(seed, plots=12, spread=2.0):
    """A is constant in a whole plot of four runs, B changes within; as many plots at each level of A."""
    random = np.random.default_rng(seed)
    plot = np.repeat(np.arange(plots), 4)
    coded = np.column_stack([np.where(plot % 2, 1.0, -1.0), np.tile([-1.0, 1, -1, 1], plots)])
    y = 5 + coded @ [0.5, 1.0] + spread * random.standard_normal(plots)[plot] + random.standard_normal(4 * plots)
    return coded, y, plot


@pytest.mark.parametrize("seed", range(4))
def test_balanced_split_plot_is_that_of_the_expected_mean_squares(seed):
    """E(MS plots) = s² + 4 s_u²; A against the plots, B and A*B against what is within (Montgomery 2017, ch. 14)."""
    coded, y, plot = split_plot(seed)
    found = fit_random(coded, y[:, None], region("AB"), TWO, blocks_of(plot), "interactions")
    means = np.bincount(plot, weights=y) / 4
    a = coded[::4, 0]
    of_a = 4 * 12 * (means @ a / 12) ** 2
    plots = (4 * ((means - means.mean()) ** 2).sum() - of_a) / 10
    of_b, of_ab = (48 * (y @ column / 48) ** 2 for column in (coded[:, 1], coded.prod(axis=1)))
    within = (((y - means[plot]) ** 2).sum() - of_b - of_ab) / 34
    assert found.components[1].variance == pytest.approx(within, rel=1e-9)
    assert found.components[0].variance == pytest.approx((plots - within) / 4, rel=1e-9)
    tested = told(found)
    for term, f, df in (("A", of_a / plots, 10), ("B", of_b / within, 34), ("A*B", of_ab / within, 34)):
        assert (tested[term].f, tested[term].df_error) == (pytest.approx(f), pytest.approx(df))
        assert tested[term].p == pytest.approx(stats.f.sf(f, 1, df))
    # A coefficient by t has the p of its term by F; the mean has the error of the plots.
    mean, *coefficients = found.coefficients
    assert [one.p for one in coefficients] == pytest.approx([tested[one.term].p for one in coefficients])
    assert (mean.standard_error, mean.df) == (pytest.approx(np.sqrt(plots / 48)), pytest.approx(10))
    assert mean.p == pytest.approx(2 * stats.t.sf(abs(y.mean()) / np.sqrt(plots / 48), 10))
    assert [one.share for one in found.components] == pytest.approx(
        [(plots - within) / (plots + 3 * within), 4 * within / (plots + 3 * within)]
    )
    # What is predicted of a group, its own effect included, is on average nearer to its runs than without.
    shrunk = (plots - within) / plots * (means - y.mean() - a * (means @ a) / 12)
    assert found.effects == pytest.approx(shrunk)
    assert found.predicted_in_group - found.predicted == pytest.approx(shrunk[plot])
    # By the deviance of both variances, of which 34 ln s² + 10 ln(s² + 4 s_u²) is what they share.
    least = 34 * (np.log(within) + 1) + 10 * (np.log(plots) + 1)
    whole = (34 * within + 10 * plots) / 44
    assert found.p_groups == pytest.approx(stats.chi2.sf(44 * (np.log(whole) + 1) - least, 1) / 2, rel=1e-6)


def test_intervals_hold_what_the_closed_form_of_the_deviance_holds():
    """Balanced: 34 ln s² + 34 MSE/s² + 10 ln v + 10 MSP/v with v = s² + 4 s_u², by brute force over both variances."""
    coded, y, plot = split_plot(1)
    found = fit_random(coded, y[:, None], region("AB"), TWO, blocks_of(plot), "interactions")
    s2 = found.components[1].variance
    v = s2 + 4 * found.components[0].variance

    def deviance(within, between):
        total = within + 4 * between
        return 34 * (np.log(within) + s2 / within) + 10 * (np.log(total) + v / total)

    least = deviance(s2, (v - s2) / 4)
    other = np.geomspace(1e-3, 1e3, 40001)
    for which, component in enumerate(found.components[::-1]):
        for end in (component.low, component.high):
            assert end > 0
            found_there = deviance(end, other) if which == 0 else deviance(other, end)
            # 3.8415: the 95 % point of chi-squared with one degree of freedom (tables).
            assert found_there.min() - least == pytest.approx(3.8415, abs=2e-4)


def test_a_split_plot_in_blocks_is_that_of_r():
    """> summary(aov(Y ~ B + N * V + Error(B:V), MASS::oats))       # plots: V 1.48534 on 2 and 10, MS 601.33056
    # within: N 37.68565 on 3 and 45, N:V 0.30282 on 6 and 45, MS 177.08333
    """
    found = analysed("oats", response="Y", random="plot", block="B", order="interactions")
    tested = told(found)
    for term, f, df, df_error in (("A", 1.48534, 2, 10), ("B", 37.68565, 3, 45), ("A*B", 0.30282, 6, 45)):
        assert tested[term].f == pytest.approx(f, rel=2e-5)
        assert (tested[term].df, tested[term].df_error) == (df, pytest.approx(df_error))
    assert found.components[0].variance == pytest.approx((601.33056 - 177.08333) / 4, rel=1e-6)
    assert found.components[1].variance == pytest.approx(177.08333, rel=1e-7)


def test_randomised_blocks_are_those_of_r():
    """> m <- lme(effort ~ Type, random = ~ 1 | Subject, ergoStool); VarCorr(m)       # sd 1.332465, 1.100294574
    > anova(m, type = "marginal")                                                   # F 22.355640584 on 3 and 24
    """
    found = analysed("ergoStool", random="Subject")
    assert [one.sd for one in found.components] == pytest.approx([1.332465, 1.100294574], rel=1e-6)
    assert told(found)["A"].f == pytest.approx(22.355640584, rel=1e-7)
    assert told(found)["A"].df_error == pytest.approx(24)
    assert sum(one.effect for one in found.means) == pytest.approx(0, abs=1e-12)


def test_unequal_groups_are_those_of_r():
    """> s <- transform(petrol, SG = (SG - 45)/15, VP = (VP - 5)/5, V10 = (V10 - 250)/100, EP = (EP - 325)/125)
    > m <- lme(Y ~ SG + VP + V10 + EP, random = ~ 1 | No, s); -2 * logLik(m); summary(m)$tTable; ranef(m)

    Its iteration stops within 4e-4 of the variances; the deviance is flat there.
    """
    found = analysed("petrol", response="Y", random="No", order="linear")
    assert found.deviance == pytest.approx(124.880009884, abs=1e-6)
    assert found.deviance <= 124.880009884
    assert [one.variance for one in found.components] == pytest.approx([2.08810705374, 3.50493071346], rel=1e-3)
    assert [one.value for one in found.coefficients] == pytest.approx(
        [18.98920682188, 3.29095923769, 2.72930496936, -15.42435484024, 19.64715438501], rel=1e-4
    )
    assert [one.standard_error for one in found.coefficients] == pytest.approx(
        [1.396844661551, 2.204337960918, 2.602940491074, 3.996683600525, 0.698480796043], rel=1e-3
    )
    theirs = {"A": -0.0594595332573, "C": 1.9206175322738, "F": 0.5693934225516, "J": 0.0763526628927}
    assert [found.effects[found.groups.index(name)] for name in theirs] == pytest.approx(
        list(theirs.values()), rel=1e-3
    )


@pytest.mark.parametrize("seed", range(3))
def test_unbalanced_runs_are_those_of_statsmodels(seed):
    random = np.random.default_rng(seed)
    group = random.integers(9, size=50)
    coded = random.uniform(-1, 1, (50, 2))
    y = 3 + coded @ [1, -1] + 1.5 * random.standard_normal(9)[group] + random.standard_normal(50)
    found = fit_random(coded, y[:, None], region("AB"), TWO, blocks_of(group), "linear")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it warns of its own steps
        theirs = sm.MixedLM(y, sm.add_constant(coded), groups=group).fit(reml=True, gtol=1e-10)
    assert found.components[1].variance == pytest.approx(theirs.scale, rel=1e-4)
    assert found.components[0].variance == pytest.approx(float(np.asarray(theirs.cov_re)[0, 0]), rel=1e-3)
    assert [one.value for one in found.coefficients] == pytest.approx(theirs.fe_params, rel=1e-4)
    assert found.deviance <= -2 * theirs.llf + 1e-8
    assert found.deviance == pytest.approx(-2 * theirs.llf, abs=1e-5)


def test_degrees_of_freedom_of_unbalanced_names_are_those_of_the_full_matrices():
    """Satterthwaite for either axis of the term, with ½ tr(P V_i P V_j); together by Fai and Cornelius 1996."""
    random = np.random.default_rng(5)
    # The first name stands in groups of its own, the others side by side: one is told between groups, one within.
    group, name = np.repeat(np.arange(8), 4), np.tile([1, 2, 2, 1], 8)
    name[:14] = 0
    y = 2.0 * random.standard_normal(8)[group] + name + random.standard_normal(32)
    coded = codes(3)[name][:, None]
    found = fit_random(coded, y[:, None], region("A"), (("a", "b", "c"),), blocks_of(group))
    between, within = (one.variance for one in found.components)
    x, z = columns_of((3,), ("A",)).matrix(coded), np.eye(8)[group]
    inverse = np.linalg.inv(within * np.eye(32) + between * z @ z.T)
    covariance = np.linalg.inv(x.T @ inverse @ x)
    p = inverse - inverse @ x @ covariance @ x.T @ inverse
    parts = (np.eye(32), z @ z.T)
    information = [[0.5 * np.trace(p @ one @ p @ other) for other in parts] for one in parts]
    values, axes = np.linalg.eigh(covariance[1:, 1:])
    df = []
    for value, axis in zip(values, axes.T, strict=True):
        weights = inverse @ x @ covariance[:, 1:] @ axis
        slope = np.array([weights @ one @ weights for one in parts])
        df.append(2 * value**2 / (slope @ np.linalg.solve(information, slope)))
    assert max(df) > 1.1 * min(df)
    expected = sum(one / (one - 2) for one in df)
    (tested,) = found.tests
    assert tested.df_error == pytest.approx(2 * expected / (expected - 2), rel=1e-5)
    estimate = covariance @ x.T @ inverse @ y
    assert tested.f == pytest.approx(estimate[1:] @ np.linalg.solve(covariance[1:, 1:], estimate[1:]) / 2, rel=1e-6)
    assert tested.p == pytest.approx(stats.f.sf(tested.f, 2, tested.df_error))


def test_groups_that_do_not_scatter_leave_least_squares():
    """Between plots less than within: the component is 0, and every test has the error of all runs."""
    random = np.random.default_rng(3)
    coded = np.tile(factorial(2), (6, 1)).astype(float)
    y = random.standard_normal(24)
    group = np.repeat(np.arange(6), 4)
    y -= (np.bincount(group, weights=y) / 4)[group]  # all means alike
    found = fit_random(coded, y[:, None], region("AB"), TWO, blocks_of(group), "linear")
    assert (found.components[0].variance, found.components[0].low, found.p_groups) == (0.0, 0.0, 1.0)
    assert found.components[0].high > 0
    theirs = sm.OLS(y, sm.add_constant(coded)).fit()
    for term, p in zip("AB", theirs.pvalues[1:], strict=True):
        assert told(found)[term].df_error == pytest.approx(21)
        assert told(found)[term].p == pytest.approx(p)


def test_means_of_names_have_the_error_of_their_own_contrast():
    """Balanced groups with each name once: an effect is told against what is within, a mean against both."""
    random = np.random.default_rng(8)
    coded, group = np.tile(codes(3), 10)[:, None], np.repeat(np.arange(10), 3)
    y = 5 + 2 * random.standard_normal(10)[group] + np.tile([0, 1, 2], 10) + 0.5 * random.standard_normal(30)
    found = fit_random(coded, y[:, None], region("A"), (("a", "b", "c"),), blocks_of(group))
    within = found.components[1].variance
    assert [one.standard_error for one in found.means] == pytest.approx([np.sqrt(within * 2 / 30)] * 3)
    assert found.means[0].high - found.means[0].mean > 2 * np.sqrt(found.components[0].variance / 10)


def test_what_cannot_be_answered_is_refused():
    coded, y, plot = split_plot(0, plots=2)
    with pytest.raises(
        StatisticsError, match="8 valid runs in 2 groups are too few to separate A from one another and from the groups"
    ):
        fit_random(coded, y[:, None], region("AB"), TWO, blocks_of(plot), terms=("A",))
    coded, y, plot = split_plot(0)
    with pytest.raises(StatisticsError, match="without scatter"):
        fit_random(coded, (coded @ [1.0, 2])[:, None], region("AB"), TWO, blocks_of(plot), "linear")
    with pytest.raises(CommandError, match="--target: not allowed with --random plot; allowed: --block plot"):
        analysed("oats", response="Y", random="plot", target=100.0)
    with pytest.raises(CommandError, match="--random Plot: no such column for blocks; the other columns are B, plot"):
        analysed("oats", response="Y", random="Plot")
