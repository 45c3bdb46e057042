"""Box–Cox: against SciPy's likelihood for a mean alone, against planted powers, and where there is no profile."""

import numpy as np
import pytest
from scipy import stats

from doe.analysis.model_adequacy import POWERS, box_cox, residual_sums
from doe.analysis.surface import fit_surface
from doe.designs import box_behnken, factorial
from tests.doe.analysis.textbook import region


def test_sums_of_a_mean_alone_are_scipys_likelihood():
    """scipy.stats.boxcox_llf is -n/2 ln(SS/n) up to the scaling by the geometric mean, a constant of the data."""
    y = np.random.default_rng(1).lognormal(2.0, 0.7, 60)
    sums = residual_sums(np.ones((60, 1)), y, POWERS)
    ours = -30 * np.log(sums)
    theirs = np.array([stats.boxcox_llf(power, y) for power in POWERS])
    assert ours - theirs == pytest.approx(np.full(POWERS.size, ours[0] - theirs[0]), abs=1e-8)
    assert POWERS[sums.argmin()] == pytest.approx(stats.boxcox_normmax(y, method="mle"), abs=0.025)  # half a step


@pytest.mark.parametrize("power, name", [(0.0, "ln y"), (-1.0, "1/y"), (0.5, "√y")])
def test_a_planted_scale_is_found(power, name):
    design = np.vstack([box_behnken(3, 5)] * 2).astype(float)
    linear = 4 + design @ [1.0, 0.5, -0.7] + 0.02 * np.random.default_rng(2).standard_normal(34)
    y = np.exp(linear) if power == 0 else linear ** (1 / power)
    found = box_cox(fit_surface(design, y, region("ABC"), ["A", "B", "C"]))
    assert found.low <= power <= found.high
    assert found.best == pytest.approx(power, abs=0.2)
    assert found.suggestion == name


def test_a_response_on_its_right_scale_stays_as_it_is():
    design = np.vstack([factorial(3)] * 3).astype(float)
    y = 20 + 5 * design[:, 0] + np.random.default_rng(3).standard_normal(24)
    found = box_cox(fit_surface(design, y, region("ABC"), ["A", "B", "C"]))
    assert found.low <= 1 <= found.high
    assert found.suggestion == "none"


def test_interval_is_that_of_the_f_statistic():
    """Montgomery 2017, eq. 15.2: SS* = SS(best) (1 + t^2/df)."""
    design = np.vstack([factorial(3)] * 3).astype(float)
    y = 20 + 5 * design[:, 0] + np.random.default_rng(3).standard_normal(24)
    found = box_cox(fit_surface(design, y, region("ABC"), ["A", "B", "C"]))
    at_ends = np.interp([found.low, found.high], found.powers, found.log_sum_of_squares)
    limit = found.log_sum_of_squares.min() + np.log1p(stats.t.ppf(0.975, 20) ** 2 / 20)
    step = np.abs(np.diff(found.log_sum_of_squares)).max()
    assert (at_ends <= limit).all()
    assert (at_ends > limit - step).all()


@pytest.mark.parametrize("values, why", [(lambda d: d[:, 0], "positive"), (lambda d: np.full(len(d), 2.0), "varies")])
def test_no_profile_where_there_can_be_none(values, why):
    design = box_behnken(3, 5).astype(float)
    found = box_cox(fit_surface(design, values(design), region("ABC")))
    assert why in found.note
    assert found.powers.size == 0
