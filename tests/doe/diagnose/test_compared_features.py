"""Which features are compared, and how scatter, instruments and gaps of the data enter."""

import numpy as np
import pytest
from scipy import stats

from doe.analysis.squash import SQUASH
from doe.diagnose.compared_features import BIAS_ERROR, Instrument, MeasuredFeatures, weighed
from doe.diagnose.emulator import Lessons, Way
from doe.errors import StatisticsError

NAMES = ("height", "width", "area", "lean")
D = len(NAMES)
WAYS = (Way("push", "push"),)


def lessons(rng, conditions=1, number=40):
    """The base model at zero, and an effect of four deviations in the first feature."""
    n = 2 * number
    way = np.repeat([-1, 0], number)
    blocks = [rng.standard_normal((n, D)) for _ in range(conditions)]
    for block in blocks:
        block[:, 0] += 4.0 * (way == 0)
    return Lessons(np.zeros((n, 0)), way, (way == 0).astype(float), np.arange(n), tuple(blocks))


def data(values, name="low", **more):
    return MeasuredFeatures(name, "scan", NAMES, values, np.zeros(D), scalars=1, **more)


def test_what_is_not_there_or_never_varies_is_left_out():
    rng = np.random.default_rng(0)
    taught, values = lessons(rng), rng.standard_normal((6, D))
    taught.blocks[0][:, 1] = 5.0
    values[:4, 2] = np.nan
    found = weighed(taught, WAYS, [data(values)])
    assert found.names == (("height", "lean"),)
    assert found.left_out == ("low: width", "low: area")
    assert len(found.blocks[0]) == 6


def test_a_replicate_with_a_gap_and_a_pour_with_a_gap_are_left_out():
    rng = np.random.default_rng(0)
    taught, values = lessons(rng), rng.standard_normal((6, D))
    values[0, 3] = np.nan
    taught.blocks[0][3, 2] = np.nan
    found = weighed(taught, WAYS, [data(values)])
    assert len(found.blocks[0]) == 5
    assert found.data.replicates == 5
    assert found.emulator.freedom == 80 - 1 - 2


def test_data_without_a_number_that_can_be_compared_are_refused():
    rng = np.random.default_rng(0)
    with pytest.raises(StatisticsError, match="low: no measured number varies"):
        weighed(lessons(rng), WAYS, [data(np.full((6, D), np.nan))])


def test_a_laboratory_that_scatters_more_is_believed_less():
    rng = np.random.default_rng(1)
    values = rng.standard_normal((6, D)) + np.array([1.3, 0.0, 0.0, 0.0])
    wild = values + 4.0 * (values - values.mean(axis=0))
    calm, loose = (weighed(lessons(np.random.default_rng(0)), WAYS, [data(v)]) for v in (values, wild))
    assert calm.data.scatter < 2.0
    assert loose.data.scatter > 5.0
    assert loose.posterior.effects["push"] < calm.posterior.effects["push"]


def test_the_scatter_of_the_data_is_told_on_average():
    """Twice the deviation of a pour, of which far features are drawn in alike on both sides; 40 sets of 20 numbers."""
    taught, rng = lessons(np.random.default_rng(0), number=200), np.random.default_rng(6)
    taught.blocks[0][200:, 0] -= 4.0  # an effect that does nothing
    found = [weighed(taught, WAYS, [data(2.0 * rng.standard_normal((6, D)))]).data.scatter for _ in range(40)]
    g = np.linspace(-8.0, 8.0, 4001)
    far, near = (((SQUASH * np.arcsinh(v * g / SQUASH)) ** 2 @ stats.norm.pdf(g)) for v in (2.0, 1.0))
    # √(2/800) leaves 5 % of it, and what is known of Σ somewhat less.
    assert np.mean(found) == pytest.approx(far / near, rel=0.1)


def test_a_pile_that_came_down_in_a_lump_is_no_evidence_against_a_model():
    """Under the declared model, of which one pile of twelve is five deviations off in 15 of 45 features."""
    rng, names = np.random.default_rng(0), tuple(f"height {k}" for k in range(45))
    way = np.repeat([-1, 0], 60)
    blocks = tuple(rng.standard_normal((120, 45)) + 0.5 * (way == 0)[:, None] for _ in range(2))
    taught = Lessons(np.zeros((120, 0)), way, (way == 0).astype(float), np.arange(120), blocks)
    piles = rng.standard_normal((2, 6, 45))
    lump, wrong = piles.copy(), piles.copy()
    lump[0, 3, ::3] += SQUASH * np.sinh(5.0 / SQUASH)
    wrong[0, :, ::3] += 1.0

    def p_of(piles):
        conditions = [
            MeasuredFeatures(name, "scan", names, block, np.zeros(45), scalars=1)
            for name, block in zip(("low", "high"), piles, strict=True)
        ]
        return weighed(taught, WAYS, conditions).asked_of_typical(["base"]).posterior.fits["base"].p

    assert p_of(piles) > 0.1
    assert p_of(lump) > 0.1
    assert p_of(wrong) < 0.01


def test_more_pours_in_a_condition_count_for_more():
    """The noise of the mean of every condition comes out as one, whatever its pours."""
    rng = np.random.default_rng(2)
    taught = lessons(rng, conditions=2)
    found = weighed(taught, WAYS, [data(rng.standard_normal((3, D))), data(rng.standard_normal((12, D)), "high")])
    assert found.data.replicates == pytest.approx(7.5)
    sizes = [np.linalg.norm(found.emulator.whitening[:, k : k + D], axis=0).mean() for k in (0, D)]
    assert sizes[1] / sizes[0] == pytest.approx(2.0, rel=0.25)
    means = weighed(
        taught, WAYS, [data(rng.standard_normal((3, D)), mean_of=4), data(rng.standard_normal((12, D)), "high")]
    )
    assert means.data.replicates == pytest.approx(12.0)


def test_a_scanner_s_bias_is_taken_off_and_doubted():
    rng = np.random.default_rng(3)
    bias = np.array([0.0, 0.0, 3.0, 0.0])
    values = rng.standard_normal((6, D)) + bias
    axis = np.array([[0.0, 0.0, 0.0, 0.4], [0.0, 0.0, 0.0, 0.0]])
    raw = weighed(lessons(np.random.default_rng(0)), WAYS, [data(values)])
    freed = weighed(lessons(np.random.default_rng(0)), WAYS, [data(values)], [Instrument(bias, axis)])
    assert raw.posterior.fits["base"].p < 0.01
    assert freed.posterior.fits["base"].p > 0.05
    # Two directions: the bias by three tenths of it, and the axis along x; along y it does nothing here.
    assert freed.data.instrument.shape == (D, 2)
    sizes = sorted(np.linalg.norm(np.linalg.solve(freed.emulator.whitening, freed.data.instrument), axis=0))
    assert sizes == pytest.approx([0.4, BIAS_ERROR * 3.0], rel=0.35)


def test_a_stated_error_widens_its_own_number():
    rng = np.random.default_rng(4)
    values = rng.standard_normal((6, D)) + np.array([0.0, 2.0, 0.0, 0.0])
    stated = MeasuredFeatures("low", "scalars", NAMES, values, np.array([0.0, 2.0, 0.0, 0.0]), scalars=D)
    certain, doubtful = (weighed(lessons(np.random.default_rng(0)), WAYS, [one]) for one in (data(values), stated))
    assert doubtful.posterior.fits["base"].p > 5.0 * certain.posterior.fits["base"].p
