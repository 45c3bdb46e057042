"""Mean, interval and normality of replicates against SciPy, and what few or equal values give."""

import math

import numpy as np
import pytest
from scipy import stats

from doe.errors import StatisticsError
from doe.laboratory.replicates import summarise

VALUES = [0.52, 0.57, 0.55, 0.61, 0.49, 0.58, 0.60, 0.56, 0.54, 0.68]


def test_against_scipy():
    found = summarise(VALUES)
    low, high = stats.ttest_1samp(VALUES, 0.0).confidence_interval(0.95)
    assert (found.low, found.high) == pytest.approx((low, high), rel=1e-12)
    assert (found.mean, found.sd) == pytest.approx((np.mean(VALUES), np.std(VALUES, ddof=1)))
    assert (found.shapiro_w, found.shapiro_p) == pytest.approx(tuple(stats.shapiro(VALUES)))
    assert (found.least, found.largest, found.n) == (0.49, 0.68, 10)
    assert found.outlier_test == "Grubbs"


def test_an_outlier_is_named_and_kept():
    found = summarise([*VALUES, 1.5])
    assert found.outliers == (10,)
    assert found.mean == pytest.approx(np.mean([*VALUES, 1.5]))
    assert found.mean_without == pytest.approx(np.mean(VALUES))


def test_one_value_has_no_spread():
    found = summarise([3.0])
    assert (found.mean, found.n, found.mean_without) == (3.0, 1, 3.0)
    assert all(map(math.isnan, (found.sd, found.low, found.high, found.shapiro_p)))
    assert found.to_dict()["sd"] is None


def test_equal_values_have_a_sharp_mean_and_no_normality():
    found = summarise([0.2] * 4)
    assert (found.low, found.high, found.sd) == pytest.approx((0.2, 0.2, 0.0))
    assert math.isnan(found.shapiro_p)
    assert found.outliers == ()


@pytest.mark.parametrize("values", [[], [1.0, math.nan], [[1.0, 2.0]]])
def test_what_cannot_be_summed_up_is_refused(values):
    with pytest.raises(StatisticsError, match="finite"):
        summarise(values)
