"""Verification against SciPy, statsmodels and the paper's printed test."""

import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from statsmodels.stats.weightstats import CompareMeans, DescrStatsW

from doe.analysis.t_tests import Sample, equivalence_test, one_sample_test, pooled_test, welch_test
from doe.analysis.verification import relative_error_percent, sd_from_pooled_p, sd_from_welch_p, verify
from doe.errors import StatisticsError

# Processes 2022, 10, 185, Table 10: simulated angles of repose in degrees.
PAPER_RUNS = (25.96, 25.31, 23.47)
FIRST = np.random.default_rng(1).normal(24.0, 2.0, 7)
SECOND = np.random.default_rng(2).normal(25.0, 1.0, 12)


def verified(*arguments, **options):
    """Verify; the optional tests of the result are looked at where they must exist."""
    return verify(*arguments, **options)


@pytest.mark.parametrize("test, equal", [(welch_test, False), (pooled_test, True)])
def test_two_sample_tests_agree_with_scipy(test, equal):
    own = test(Sample.of(FIRST), Sample.of(SECOND))
    other = stats.ttest_ind(FIRST, SECOND, equal_var=equal)
    interval = other.confidence_interval(0.95)
    assert (own.t, own.p, own.df) == pytest.approx((other.statistic, other.pvalue, other.df))
    assert (own.low, own.high) == pytest.approx((interval.low, interval.high))


def test_one_sample_test_agrees_with_scipy():
    own = one_sample_test(Sample.of(FIRST), 24.68)
    other = stats.ttest_1samp(FIRST, 24.68)
    assert (own.t, own.p, own.df) == pytest.approx((other.statistic, other.pvalue, other.df))


@pytest.mark.parametrize("margin", [0.5, 2.0, 4.0])
def test_equivalence_agrees_with_statsmodels(margin):
    own = equivalence_test(welch_test(Sample.of(FIRST), Sample.of(SECOND)), margin)
    other = CompareMeans(DescrStatsW(FIRST), DescrStatsW(SECOND)).ttost_ind(-margin, margin, usevar="unequal")
    assert own.p == pytest.approx(other[0])


@settings(max_examples=50, deadline=None)
@given(difference=st.floats(-3, 3), sd=st.floats(0.1, 3), n=st.integers(2, 30), margin=st.floats(0.1, 4))
def test_equivalence_is_the_90_percent_interval_within_the_margin(difference, sd, n, margin):
    found = equivalence_test(welch_test(Sample(difference, sd, n), Sample(0.0, sd, n)), margin)
    # Exclude ties, where rounding decides.
    if min(abs(found.low + margin), abs(found.high - margin)) > 1e-9:
        assert found.equivalent == (-margin < found.low and found.high < margin)
    assert found.level == pytest.approx(0.9)


def test_the_printed_p_implies_a_standard_deviation_of_1_6():
    """p = 0.827 of the pooled test with n = 10 and mean 24.68 gives sd = 1.64 degrees; Welch's would need
    2.21.
    """
    pooled = sd_from_pooled_p(0.827, PAPER_RUNS, 24.68, 10)
    welch = sd_from_welch_p(0.827, PAPER_RUNS, 24.68, 10)
    assert pooled == pytest.approx(1.64, abs=0.005)
    assert welch == pytest.approx(2.21, abs=0.005)
    assert pooled_test(Sample.of(PAPER_RUNS), Sample(24.68, pooled, 10)).p == pytest.approx(0.827)
    assert welch_test(Sample.of(PAPER_RUNS), Sample(24.68, welch, 10)).p == pytest.approx(0.827)


def test_no_standard_deviation_gives_a_p_below_that_of_an_exact_measurement():
    with pytest.raises(StatisticsError, match="follows from no standard deviation"):
        sd_from_pooled_p(0.01, PAPER_RUNS, 24.68, 10)
    with pytest.raises(StatisticsError, match="follows from no standard deviation"):
        sd_from_welch_p(0.01, PAPER_RUNS, 24.68, 10)
    with pytest.raises(StatisticsError, match="between 0 and 1"):
        sd_from_pooled_p(1.0, PAPER_RUNS, 24.68, 10)


def test_the_papers_own_runs_cannot_tell():
    """Three runs with sd 1.3 degrees are neither different from 24.68 nor shown to be within 2 degrees."""
    found = verified(PAPER_RUNS, 24.68, 1.6, 10, margin=2.0)
    assert found.verdict == "cannot tell"
    assert found.welch.p > 0.5
    assert found.equivalence.p > 0.05
    # The paper prints 0.923 %; its own mean of 24.91 gives 0.932 %, the unrounded mean 0.945 %.
    assert found.relative_error_percent == pytest.approx(0.945, abs=0.0005)


def test_a_verdict_stands_on_the_intervals_of_scipy():
    """95 % for the difference, 90 % for two one-sided tests at 5 %."""
    found = verified(FIRST, SECOND.mean(), SECOND.std(ddof=1), SECOND.size)
    other = stats.ttest_ind(FIRST, SECOND, equal_var=False)
    for test, level in ((found.welch, 0.95), (found.equivalence, 0.90)):
        ends = other.confidence_interval(level)
        assert test.level == pytest.approx(level)
        assert (test.low, test.high) == pytest.approx((ends.low, ends.high))
    assert found.pooled.p == pytest.approx(stats.ttest_ind(FIRST, SECOND).pvalue)
    assert found.one_sample.p == pytest.approx(stats.ttest_1samp(FIRST, SECOND.mean()).pvalue)
    assert found.deciding is found.welch


def test_many_close_runs_are_equivalent():
    found = verified(24.9 + 1.5 * stats.norm.ppf((np.arange(20) + 0.5) / 20), 24.68, 1.6, 10)
    assert found.verdict == "equivalent"
    assert -2 < found.equivalence.low < found.equivalence.high < 2


def test_a_small_but_certain_difference_is_equivalent_and_said_to_be_significant():
    found = verified(25.2 + 0.1 * stats.norm.ppf((np.arange(20) + 0.5) / 20), 24.68, 0.1, 10)
    assert found.verdict == "equivalent"
    assert "significant but lies within" in found.statement


def test_far_runs_are_different():
    found = verified([18.0, 19.0, 17.5, 18.5], 24.68, 1.6, 10)
    assert found.verdict == "different"
    assert "95 % interval" in found.statement


def test_a_bare_printed_mean_is_tested_as_exact():
    found = verified([24.0, 25.0, 24.5, np.nan], 24.68, None, None)
    assert found.welch is None
    assert found.simulated.n == 3
    assert found.equivalence.p == pytest.approx(equivalence_test(found.one_sample, 2.0).p)


def test_a_single_measurement_is_taken_as_exact():
    found = verified([24.0, 25.0, 24.5], 24.68, 1.6, 1)
    assert (found.welch, found.pooled) == (None, None)
    assert found.deciding.p == pytest.approx(stats.ttest_1samp([24.0, 25.0, 24.5], 24.68).pvalue)


@pytest.mark.parametrize("runs", [[24.0], [24.0, 24.0, 24.0]])
def test_runs_without_spread_cannot_tell(runs):
    found = verified(runs, 24.68, None, None)
    assert found.verdict == "cannot tell"
    assert "without spread" in found.statement
    json.dumps(found.to_dict(), allow_nan=False)


def test_difference_tests_keep_their_error_rate():
    generator = np.random.default_rng(7)
    studies = 1000
    false = sum(
        verified(generator.normal(24.68, 4.0, 4), 24.68 + generator.normal(0, 1.6 / math.sqrt(10)), 1.6, 10).welch.p
        < 0.05
        for _ in range(studies)
    )
    # 99.9 % binomial limit at 5 %; the fixed target sd makes Welch slightly conservative.
    assert false <= stats.binom.ppf(0.999, studies, 0.05)
    assert false >= stats.binom.ppf(0.001, studies, 0.03)


def test_relative_error():
    assert relative_error_percent(24.91, 24.68) == pytest.approx(0.932, abs=0.0005)
    assert math.isnan(relative_error_percent(1.0, 0.0))


@pytest.mark.parametrize(
    "arguments, message",
    [
        (([np.nan], 24.68, 1.6, 10), "no valid run"),
        (([24.0, 25.0], 24.68, -1.0, 10), "target_sd = -1.0"),
        (([24.0, 25.0], 24.68, 1.6, 10, 0.0), "margin = 0.0"),
    ],
)
def test_bad_input_is_named(arguments, message):
    with pytest.raises(StatisticsError, match=message):
        verified(*arguments)
