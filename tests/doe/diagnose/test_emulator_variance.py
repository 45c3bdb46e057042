"""The variance that the emulator states of its predictions, against their errors; which pours share a mean."""

import numpy as np
import pytest

from doe.analysis.empirical_bayes import prior_along_axes
from doe.diagnose.compared_features import Instrument, weighed
from doe.diagnose.emulator import BEND, Lessons, Way, emulated
from tests.doe.diagnose.test_compared_features import WAYS, D, data, lessons

SIZES, EFFECTS = (8, 8, 8), 9
WEIGHTS = (0.4, 0.4, 2.2)


def lessons_of(blocks, way):
    """Pours ``blocks`` at the reference amplitudes of the ways ``way``, −1 for the base model."""
    return Lessons(np.zeros((len(way), 0)), way, (way >= 0).astype(float), np.arange(len(way)), blocks)


def pours_of(rng, signatures, way):
    """Pours with unit noise; each effect shifts the features by its row of ``signatures``."""
    shifts = np.concatenate([signatures, np.zeros((1, signatures.shape[1]))])[way]
    values = shifts + rng.standard_normal(shifts.shape)
    return tuple(np.split(values, np.cumsum(SIZES)[:-1], axis=1))


def errors_over_variance(weights, runs=60):
    """n_d, and squared errors of the predicted base model and effects over their stated variance, of every axis.

    Of the emulator with wide priors, so that errors are those of means.
    """
    rng, found = np.random.default_rng(8), []
    ways = [Way(f"{k}", f"{k}") for k in range(EFFECTS)]
    way = np.concatenate([np.full(200, -1), np.repeat(np.arange(EFFECTS), 4)])
    for _ in range(runs):
        signatures = np.zeros((EFFECTS, sum(SIZES)))
        for k in range(EFFECTS):  # Each in one condition, so that axes hardly mix conditions.
            first = sum(SIZES[: k % 3])
            signatures[k, first : first + SIZES[k % 3]] = 1.5 * rng.standard_normal(SIZES[k % 3])
        taught = emulated(lessons_of(pours_of(rng, signatures, way), way), ways, weights, shrunk=False)
        mean, variance = taught.at(np.stack([taught.row(), *(taught.row({k: 1.0}) for k in range(EFFECTS))]))
        for k, one, u in zip(range(-1, EFFECTS), mean, variance, strict=True):
            truth = taught.seen(pours_of(rng, signatures, np.full(500, k)))
            found.append((taught.pour, (one - truth) ** 2 / u))
    n, ratio = (np.concatenate(column) for column in zip(*found, strict=True))
    return n, ratio


def test_the_stated_variance_follows_the_weights_of_the_conditions():
    """Axes of conditions with many measured pours are predicted as far off, of what is stated, as those with few."""
    n, ratio = errors_over_variance(WEIGHTS)
    assert n.mean() == pytest.approx(1.0)
    few, many = n < 0.7, n > 1.5
    assert min(few.sum(), many.sum()) > 500
    # With a unit variance for all it is 4, three times as much. It is no 1, because axes turn to where noise is large.
    assert 0.7 < ratio[many].mean() / ratio[few].mean() < 1.8
    assert ratio.mean() == pytest.approx(1.0, rel=0.2)


def test_equal_weights_leave_a_pour_of_unit_variance():
    way = np.concatenate([np.full(24, -1), np.repeat(np.arange(2), 4)])
    pours = pours_of(np.random.default_rng(0), np.zeros((2, sum(SIZES))), way)
    assert emulated(lessons_of(pours, way), [Way("0", "0"), Way("1", "1")]).pour == pytest.approx(np.ones(sum(SIZES)))


def test_pours_with_a_parameter_far_off_share_no_mean_with_the_others():
    """A bend Q moves them by 5.25 Q: neither the scatter of a pour nor an effect's origin may take it for noise."""
    rng = np.random.default_rng(1)
    way = np.concatenate([np.full(32, -1), np.zeros(8, int)])
    theta = np.concatenate([np.tile([-1.0, 1.0], 12), np.full(8, 2.5), np.tile([-1.0, 1.0], 4)])[:, None]
    slope, bend = 2.0, 4.0 * BEND
    block = rng.standard_normal((40, D)) + (slope * theta + bend * (theta**2 - 1.0)) * np.eye(D)[0]
    some = Lessons(theta, way, (way >= 0).astype(float), np.arange(40), (block,))
    assert len(set(some.groups().tolist())) == 3
    taught = emulated(some, WAYS)
    assert taught.squashes[0].deviation == pytest.approx(np.ones(D), rel=0.35)
    assert taught.freedom == 40 - 3 - 1
    # All pours but the far ones are at a bend of zero, and the effect does nothing.
    assert taught.squashes[0].centre == pytest.approx(np.zeros(D), abs=0.7)
    still, pushed = (taught.features(taught.at(row[None])[0][0]) for row in (taught.row(), taught.row({0: 1.0})))
    assert pushed - still == pytest.approx(np.zeros(D), abs=1.0)


def test_views_of_the_base_model_s_pours_tell_no_more_of_a_parameter():
    """Twelve pours, and the same seen displaced: an exact shift of each, known far better than six new pours tell."""
    rng, shift = np.random.default_rng(6), 3.0 * np.eye(D)[1]
    theta, block = np.tile([-1.0, 1.0], 6)[:, None], rng.standard_normal((12, D))
    views, names = np.arange(1, 4), ["push", "view 1", "view 2", "view 3"]
    pushed = rng.standard_normal((6, D)) + 4.0 * np.eye(D)[2]
    way = np.concatenate([np.full(12, -1), np.zeros(6, int), np.repeat(views, 12)])
    blocks = (np.concatenate([block, pushed, *(block + number * shift for number in views)]),)
    pour = np.concatenate([np.arange(18), *[np.arange(12)] * 3])
    thetas = np.concatenate([theta, np.zeros((6, 1)), *[theta] * 3])
    seen, ways = Lessons(thetas, way, (way >= 0).astype(float), pour, blocks), [Way(name, name) for name in names]
    one, other = emulated(seen.where(way < 1), ways[:1], shrunk=False), emulated(seen, ways, shrunk=False)
    # As independent pours they would leave it a quarter. Tails that are drawn in make the shift a little uneven.
    assert 0.7 < other.covariance[:, 1, 1].sum() / one.covariance[:, 1, 1].sum() < 1.0
    step = other.row({1: 1.0}) - other.row()
    assert other.at(step[None])[1].sum() < 0.2 * D * (1.0 / 12.0 + 1.0 / 12.0)


def test_an_axis_of_a_scanner_that_stayed_in_place_is_off_equally_everywhere():
    """The same error in two conditions is one error; of a scanner that was set up anew, there are two."""
    rng = np.random.default_rng(3)
    taught = lessons(np.random.default_rng(0), conditions=2)
    error = Instrument(np.zeros(D), np.array([[0.0, 0.0, 0.0, 2.0], [0.0, 0.0, 0.0, 0.0]]))
    off = np.array([0.0, 0.0, 0.0, 2.0])

    def said(second, sign, turned=False):
        """p of the base model, and the number of errors."""
        values = [rng.standard_normal((6, D)) * 0.3 + off, rng.standard_normal((6, D)) * 0.3 + sign * off]
        found = weighed(
            taught,
            WAYS,
            [data(values[0], axis=(0.0, 0.0)), data(values[1], "high", axis=second, turned=turned)],
            [error, error],
        )
        return found.posterior.fits["base"].p, found.data.instrument.shape[1]

    in_place, anew = (0.0, 0.0), (0.1, 0.0)
    assert said(in_place, 1.0)[1] == 1
    assert said(anew, 1.0)[1] == 2
    assert said(in_place, 1.0)[0] > 0.1
    # One scanner that is off cannot be off to opposite sides.
    assert said(in_place, -1.0)[0] < 1e-3
    assert said(anew, -1.0)[0] > 0.1
    # Under a rig that is turned it is off to the other side, in the rig's frame.
    assert said(in_place, -1.0, turned=True)[0] > 0.1
    # Where no axis is stated, the centre of each volume stands for it.
    assert said(None, 1.0)[1] == 2


def test_noise_of_unequal_size_is_not_believed_either():
    """The largest eigenvalue that noise alone produces: with nine tenths of the weight on half of the features."""
    rng, pour = np.random.default_rng(0), np.repeat([1.8, 0.2], 30)
    noise = np.full(25, 0.2)
    most = [
        prior_along_axes(np.sqrt(0.2 * pour) * rng.standard_normal((25, 60)), noise, pour)[0].max() for _ in range(40)
    ]
    assert np.mean([one > 0.1 * 0.2 * 1.8 for one in most]) < 0.3
