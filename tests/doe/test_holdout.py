"""Holdout errors by hand, and the skill of models that are right, half right and wrong."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from doe.errors import StatisticsError
from doe.holdout import OVERALL, HoldoutCondition, MeasuredReplicates, _drawn_means, holdout_errors


def compared(names, measured, before, after, stated=0.0, mean_of=1):
    data = MeasuredReplicates("c", names, measured, np.full(len(names), stated), mean_of)
    return HoldoutCondition(data, before, after)


def condition(bias_before, bias_after, seed=0, n=8, m=20, names=("angle", "height"), scale=(1.0, 0.01)):
    generator = np.random.default_rng(seed)

    def pours(count, bias):
        return (10 + np.asarray(bias) + generator.standard_normal((count, len(names)))) * np.asarray(scale)

    return compared(names, pours(n, 0.0), pours(m, bias_before), pours(m, bias_after))


def test_errors_by_hand():
    """Means 2 and 5: before off by 3. s^2/n: 2/2 and 2/2, so the floor is sqrt(2); after is exact."""
    two, five = np.array([[1.0], [3.0]]), np.array([[4.0], [6.0]])
    rows = holdout_errors([compared(("x",), two, five, two)])
    assert [row.observable for row in rows] == ["x", OVERALL]
    assert (rows[0].before, rows[0].after) == (pytest.approx(3.0), pytest.approx(0.0))
    assert rows[0].noise_floor == pytest.approx(np.sqrt(2))
    assert rows[0].skill == pytest.approx(1 - (0 - 2) / (9 - 2))
    # Overall: in standard deviations of a pour, here sqrt(2) on both sides.
    assert rows[1].before == pytest.approx(3 / np.sqrt(2))


def test_the_standard_deviation_of_a_pour_is_pooled():
    """By hand: squares 2 of two measured pours and 0 of two simulated ones, two degrees of freedom: s = 1."""
    measured, constant = np.array([[1.0], [3.0]]), np.array([[4.0], [4.0]])
    row = holdout_errors([compared(("x",), measured, measured, constant)])[-1]
    assert row.after == pytest.approx(2.0)
    assert row.noise_floor == pytest.approx(1.0)


@pytest.mark.parametrize(("n", "m"), [(3, 8), (6, 8), (6, 32)])
def test_few_pours_do_not_make_a_right_model_look_wrong(n, m):
    """E[t^2] = f/(f - 2) with f = n + m - 2, for a mean square over normal observables; by s_meas f would be n - 1."""
    names = tuple(f"x{k}" for k in range(11))
    data = [condition(0.0, 0.0, seed, n, m, names, np.ones(11)) for seed in range(200)]
    ratios = [holdout_errors([one], samples=2)[-1].ratio for one in data]
    f = n + m - 2
    # 2200 values of t^2 with a standard deviation of about 2 leave 0.05; the floor's own scatter adds as much.
    assert np.mean(np.square(ratios)) == pytest.approx(f / (f - 2), abs=0.15)


def test_observables_join_over_conditions():
    rows = holdout_errors([condition(3.0, 0.0, seed=1), condition(4.0, 0.0, seed=2, names=("angle",), scale=(1.0,))])
    assert [row.observable for row in rows] == ["angle", "height", OVERALL]
    assert rows[0].before == pytest.approx(np.sqrt((9 + 16) / 2), abs=0.8)
    json.dumps([row.to_dict() for row in rows], allow_nan=False)


@pytest.mark.parametrize(("bias", "skill"), [(0.0, 1.0), (1.5, 0.75), (3.0, 0.0)])
def test_skill_of_a_model_that_is_right_half_right_and_unchanged(bias, skill):
    """Bias 3 before; after it: 1 - bias^2/9. The mean of 60 holdouts, free of noise on both sides."""
    found = [holdout_errors([condition(3.0, bias, seed)], samples=200, seed=seed)[-1] for seed in range(60)]
    assert np.mean([row.skill for row in found]) == pytest.approx(skill, abs=0.06)
    # Two observables with eight pours each: a percentile interval of 95 % covers somewhat less.
    assert np.mean([row.skill_low <= skill <= row.skill_high for row in found]) > 0.75


def test_a_right_model_is_at_the_noise_floor_and_covers():
    found = [holdout_errors([condition(3.0, 0.0, seed)], samples=200, seed=seed)[-1] for seed in range(100)]
    # Mean of after^2/noise^2 is f/(f - 2) with 26 df. 200 values of t^2 leave 0.11.
    assert np.mean([row.ratio**2 for row in found]) == pytest.approx(26 / 24, abs=0.3)
    # 1600 measured pours, in groups that share their simulated mean.
    assert np.mean([row.coverage_after for row in found]) == pytest.approx(0.90, abs=0.03)
    assert np.mean([row.coverage_before for row in found]) < 0.25


def test_a_base_model_within_the_noise_has_no_skill_to_gain():
    data = condition(0.0, 0.0)
    row = holdout_errors([replace(data, before=data.measured.values)])[-1]
    assert np.isnan(row.skill)
    assert row.to_dict()["skill_low"] is None


def test_too_few_pours_and_no_data_are_refused():
    data = condition(0.0, 0.0)
    with pytest.raises(StatisticsError, match="at least 1, 2 and 2"):
        holdout_errors([replace(data, before=data.before[:1])])
    with pytest.raises(StatisticsError, match="measured 0, "):
        holdout_errors([replace(data, measured=replace(data.measured, values=data.measured.values[:0]))])
    with pytest.raises(StatisticsError, match="no condition"):
        holdout_errors([])


def test_a_single_reading_has_the_scatter_of_pours_and_its_instrument():
    """By hand: the mean of two pours of variance 2 and u² = 3 make a deviation of 2; the pours' mean has 2/2."""
    before, after = np.array([[4.0], [6.0]]), np.array([[1.0], [3.0]])
    rows = holdout_errors([compared(("x",), np.array([[4.0]]), before, after, stated=np.sqrt(3.0), mean_of=2)])
    assert (rows[0].before, rows[0].after) == (pytest.approx(1.0), pytest.approx(2.0))
    assert rows[0].noise_floor == pytest.approx(np.sqrt(4.0 + 1.0))
    assert rows[1].after == pytest.approx(1.0)


def test_single_readings_of_a_right_model_are_at_the_noise_floor_and_covered():
    rng = np.random.default_rng(3)
    found = []
    for seed in range(300):
        reading = np.sqrt(1.0 + 0.5**2) * rng.standard_normal((1, 2))
        pours = [rng.standard_normal((20, 2)) for _ in range(2)]
        found.append(holdout_errors([compared(("a", "b"), reading, *pours, stated=0.5)], samples=50, seed=seed)[-1])
    # The floor is by 20 pours; 600 squares of a normal number leave 0.06 of their mean.
    assert np.mean([row.ratio**2 for row in found]) == pytest.approx(19.0 / 17.0, abs=0.18)
    assert np.mean([row.coverage_after for row in found]) == pytest.approx(0.9, abs=0.04)


def test_each_model_is_freed_from_its_own_noise():
    """By hand: s²/n of the data 1, of the base model 4, of the final one 0; 4² − 5 before and 0 − 1 after."""
    measured, constant = np.array([[1.0], [3.0]]), np.array([[2.0], [2.0]])
    row = holdout_errors([compared(("x",), measured, np.array([[4.0], [8.0]]), constant)])[0]
    assert row.skill == pytest.approx(1.0 - (0.0 - 1.0) / (16.0 - 5.0))
    assert row.noise_floor == pytest.approx(1.0)
    assert row.ratio == pytest.approx(0.0)


def test_the_interval_of_the_skill_is_that_of_the_resamples():
    """A reading of error u that the final model meets, far from the base model's: (b² − 2f)(1 − skill) is u² (Z² − 2)
    in the resamples, Z² chi-squared with one degree of freedom. The base model's own noise, (10 u)², is not in it.
    """
    u, b = 0.1, 1000.0
    before, after = b * u + u * np.array([[-10.0], [10.0]]), np.zeros((2, 1))
    rows = holdout_errors([compared(("x",), np.zeros((1, 1)), before, after, stated=u)], samples=20_000)
    for row in rows:
        # b² is resampled to 2 %; 20 000 draws leave 0.08 of the 97.5 % quantile of 5.02.
        for skill, share in ((row.skill_low, 0.975), (row.skill_high, 0.025)):
            assert (1.0 - skill) * b**2 == pytest.approx(stats.chi2.ppf(share, 1) - 2.0, abs=0.35)


def test_the_resamples_scatter_as_the_means_do():
    """Means of plain resamples of n = 3 scatter by (n − 1)/n of the floor that is subtracted from them: 8 < 12."""
    values = np.array([0.0, 6.0, 6.0])
    means = _drawn_means(values, 200_000, np.random.default_rng(0))
    # The variance of 200 000 means is good to 1 %.
    assert means.var() == pytest.approx(values.var(ddof=1) / 3.0, rel=0.01)
    assert means.mean() == pytest.approx(values.mean(), abs=0.02)


@pytest.mark.parametrize(("inside", "outside"), [(10.9, 11.0), (-10.9, -11.0)])
def test_a_measured_pour_is_covered_within_the_interval_of_one_more_pour(inside, outside):
    """Pours 0 and 2: mean 1, s² = 2, t(0.95, 1) = 6.3138; 6.3138 √(2 (1 + 1/2)) = 10.936."""
    pours, far = np.array([[0.0], [2.0]]), np.array([[1000.0], [1002.0]])
    (row, _) = holdout_errors([compared(("x",), 1.0 + np.array([[inside], [outside]]), far, pours)])
    assert (row.coverage_before, row.coverage_after) == (0.0, 0.5)


@pytest.mark.parametrize(("off", "covered"), [(12.5, 1.0), (12.7, 0.0)])
def test_a_single_mean_is_covered_within_its_share_of_the_scatter_and_its_instrument(off, covered):
    """The mean of four pours with u² = 2.5: 6.3138 √(2 (1/4 + 1/2) + 2.5) = 12.628."""
    pours = np.array([[0.0], [2.0]])
    one = compared(("x",), np.array([[1.0 + off]]), pours, pours, stated=np.sqrt(2.5), mean_of=4)
    assert holdout_errors([one])[0].coverage_after == covered


def test_means_of_several_pours_scatter_as_their_number_says():
    """By hand: means 1 and 3 of four pours have squares of 2 about theirs, 8 of single ones; 1 and 3 are single pours:
    s² = (8 + 2)/2 = 5, that of a mean 5/4. Pours of 2 ± 1: 6.3138 √(2 (1/4 + 1/2)) = 7.733 hold a mean of four.
    """
    measured, pours = np.array([[1.0], [3.0]]), np.array([[1.0], [3.0]])
    row = holdout_errors([compared(("x",), measured, pours + 10.0, pours, mean_of=4)])[-1]
    assert row.before == pytest.approx(10.0 / np.sqrt(5.0 / 4.0))
    far = compared(("x",), np.array([[9.7], [9.8]]), pours, pours, mean_of=4)
    assert holdout_errors([far])[0].coverage_after == 0.5


def test_means_of_several_pours_are_covered_as_often_as_single_ones():
    rng = np.random.default_rng(8)
    found = []
    for seed in range(300):
        means, pours = rng.standard_normal((3, 10, 2)).mean(axis=1), rng.standard_normal((20, 2))
        found.append(holdout_errors([compared(("a", "b"), means, pours, pours, mean_of=10)], samples=2, seed=seed)[-1])
    # 600 groups of three that share their simulated mean.
    assert np.mean([row.coverage_after for row in found]) == pytest.approx(0.9, abs=0.04)


def test_what_never_varies_counts_in_its_own_unit():
    same = np.full((2, 1), 2.0)
    row = holdout_errors([compared(("x",), same, same + 3.0, same)])[-1]
    assert (row.before, row.after, row.skill) == (3.0, 0.0, 1.0)
    assert np.isnan(row.ratio)


def test_the_deviation_of_replicates_is_their_own_and_of_a_single_one_what_is_stated():
    several = MeasuredReplicates("c", ("x",), np.array([[1.0], [3.0]]), np.array([9.0]))
    assert several.deviation == pytest.approx([np.sqrt(2.0)])
    assert replace(several, values=several.values[:1]).deviation == pytest.approx([9.0])
