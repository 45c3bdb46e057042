"""The ruler: strengths of made-up effects whose shift, noise and sensitivity are known."""

import numpy as np
import pytest

from doe.analysis.covariance import shrunk_covariance
from doe.errors import StatisticsError
from doe.validation.limit import fold_shifts, metric_of, product, ruler_of, strength_of
from doe.validation.reference import SIDE, ReferencePours

D, POURS = 6, 96
IDLE = np.zeros((1, 2 * D))
"""What one parameter does that does nothing."""


def sample_of(rng, shifts, pours=POURS, slopes=IDLE, scale=1.0):
    """Pours of unit noise (times ``scale``) in two conditions of ``D`` features; a shift is that of both.

    ``slopes``: what each parameter does per standard deviation.
    """

    def blocks(shift, number):
        return tuple(scale * (rng.standard_normal((number, D)) + part) for part in np.split(shift, 2))

    kinds = {"base": blocks(np.zeros(2 * D), 2 * pours)}
    kinds |= {name: blocks(shift, pours) for name, shift in shifts.items()}
    for k, slope in enumerate(slopes):
        kinds |= {f"friction_{k} -": blocks(-SIDE * slope, pours), f"friction_{k} +": blocks(SIDE * slope, pours)}
    return ReferencePours(kinds, tuple(f"friction_{k}" for k in range(len(slopes))))


def unit(*places):
    """Unit vector along ``places``."""
    one = np.zeros(2 * D)
    one[list(places)] = 1.0
    return one / np.linalg.norm(one)


def strengths(sample, names, replicates=6):
    ruler = ruler_of(sample, replicates)
    return [strength_of(sample, name, ruler) for name in names]


def test_strength_is_the_shift_in_standard_errors_whatever_the_units():
    """|δ| = 5 pours' standard deviations: 5 √6 standard errors of six pours."""
    for scale in (1.0, 1e-6):
        sample = sample_of(np.random.default_rng(1), {"push": 5.0 * unit(0, 3, 8)}, scale=scale)
        (found,) = strengths(sample, ["push"])
        assert abs(found.value - 5.0 * np.sqrt(6.0)) < 3.0 * found.error
        # √(6 (1/96 + 1/192)) of the means and, in quadrature, value/√(2 · 381) of the covariance; 3 deviations of 7 df.
        assert found.error == pytest.approx(0.54, rel=0.8)


def test_the_square_is_free_of_what_noise_adds():
    """The mean square of no effect at all is zero; the plain one would be 12 · 6 (1/16 + 1/32) = 6.75."""
    squares = []
    for seed in range(150):
        sample = sample_of(np.random.default_rng(seed), {"nothing": np.zeros(2 * D)}, pours=16)
        shifts = metric_of(sample).white(fold_shifts(sample, "nothing"))
        squares.append(product(shifts, shifts))
    error = np.std(squares) / np.sqrt(len(squares))
    assert abs(np.mean(squares)) < 3.0 * error
    assert error < 0.3


SLOPES = 0.15 * np.random.default_rng(7).standard_normal((4, 2 * D))


@pytest.mark.parametrize(
    "push, slopes", [(3.0 * unit(1, 7), ()), (10.0 * unit(1, 7), ()), (7.0 * SLOPES.sum(axis=0), SLOPES)]
)
def test_the_stated_error_is_that_of_repeated_references(push, slopes):
    """Also where it is the covariance's (a strong push), and where it is that of what four parameters do."""
    found = [
        strengths(sample_of(np.random.default_rng(seed), {"push": push}, 32, slopes), ["push"])[0] for seed in range(60)
    ]
    spread = np.std([one.value for one in found])
    assert 0.7 < np.mean([one.error for one in found]) / spread < 1.4


def test_what_recalibration_can_do_counts_for_little():
    """Along a parameter of sensitivity J the noise is 1/n + J²: d² = a² / (1/n + J²); across it, d² = n a²."""
    pushes = {"along": 4.0 * unit(0, 1), "across": 4.0 * unit(4, 9)}
    sample = sample_of(np.random.default_rng(5), pushes, slopes=[2.0 * unit(0, 1)])
    along, across = strengths(sample, ["along", "across"])
    assert along.value == pytest.approx(4.0 / np.sqrt(1.0 / 6.0 + 4.0), abs=0.2)
    assert across.value == pytest.approx(4.0 * np.sqrt(6.0), rel=0.06)


def test_twice_the_pours_are_root_two_stronger():
    sample = sample_of(np.random.default_rng(8), {"push": 3.0 * unit(2)})
    (six,), (twelve,) = strengths(sample, ["push"]), strengths(sample, ["push"], 12)
    assert twelve.value / six.value == pytest.approx(np.sqrt(2.0), rel=0.02)


def test_correlations_are_shrunk_away_where_there_are_few_rows():
    """Ten rows of twenty unrelated features: a plain covariance has no inverse, this one has, and keeps variances."""
    rows = np.random.default_rng(0).standard_normal((10, 20))
    found = shrunk_covariance(rows)
    assert np.linalg.eigvalsh(found).min() > 0.05
    assert np.diag(found) == pytest.approx((rows**2).mean(axis=0))


def test_strong_correlations_stay_where_there_are_many_rows():
    rng = np.random.default_rng(0)
    common = rng.standard_normal((2000, 1))
    rows = common + 0.5 * rng.standard_normal((2000, 4))
    assert shrunk_covariance(rows)[0, 1] == pytest.approx(1.0, abs=0.1)


def test_too_few_pours_are_refused():
    sample = sample_of(np.random.default_rng(0), {"push": unit(0)}, pours=5)
    with pytest.raises(StatisticsError, match="push: 5 valid pours"):
        fold_shifts(sample, "push")


def test_a_feature_that_never_varies_is_left_out():
    rng = np.random.default_rng(0)
    blocks = {name: (np.column_stack([rng.standard_normal(9), np.full(9, 3.0)]),) for name in ("base", "push")}
    assert [block.shape[1] for block in ReferencePours(blocks, ()).varying().pours["push"]] == [1]
