"""The posterior: densities against SciPy's, and answers that have to come out; the replay on made-up pours."""

import numpy as np
import pytest
from scipy import stats

from doe.diagnose.limit import RISKS, Kind
from doe.diagnose.posterior import NOTHING, OUTSIDE, SPREADS, Models, Taught, posterior, taught_by
from doe.diagnose.replay import NULLS, replay
from doe.errors import StatisticsError
from tests.doe.test_ruler import D, sample_of, unit

SIZE = 2 * D


def models(shifts, freedom=200, pours=12, sensitivity=None, covariance=None):
    """Models of unit noise (or ``covariance``) about zero."""
    return Models(
        base=np.zeros(SIZE),
        base_pours=24,
        covariance=np.eye(SIZE) if covariance is None else covariance,
        freedom=freedom,
        sensitivity=np.zeros((SIZE, 0)) if sensitivity is None else sensitivity[:, None],
        effects=tuple(Taught(name, shift, pours, False) for name, shift in shifts.items()),
    )


def test_without_effects_it_is_the_ratio_of_two_densities():
    """Nothing against outside, by SciPy's multivariate t with correlated features and a parameter."""
    rng = np.random.default_rng(0)
    root = rng.standard_normal((SIZE, SIZE))
    covariance, slope = root @ root.T + np.eye(SIZE), rng.standard_normal(SIZE)
    z = rng.standard_normal(SIZE)
    found = posterior(models({}, freedom=30, sensitivity=slope, covariance=covariance), z, 6)

    def density(more):
        scale = covariance * (1.0 / 6.0 + 1.0 / 24.0 + more) + np.outer(slope, slope)
        return stats.multivariate_t.pdf(z, shape=scale, df=30)

    nothing, outside = NOTHING * density(0.0), OUTSIDE * np.mean([density(s**2) for s in SPREADS])
    assert found.nothing == pytest.approx(nothing / (nothing + outside), rel=1e-6)


def test_an_effect_of_known_amplitude_by_hand():
    """One effect, one parameter, against the mean over amplitudes of SciPy's densities."""
    from doe.diagnose.posterior import AMPLITUDES

    shift, slope = 3.0 * unit(1, 7), 0.5 * unit(3)
    z = 1.4 * unit(1, 7)
    found = posterior(models({"push": shift}, freedom=50, pours=8, sensitivity=slope), z, 6)

    def density(d, variance):
        return stats.multivariate_t.pdf(d, shape=variance * np.eye(SIZE) + np.outer(slope, slope), df=50)

    ground = 1.0 / 6.0 + 1.0 / 24.0
    weights = {
        "nothing": NOTHING * density(z, ground),
        "outside": OUTSIDE * np.mean([density(z, ground + s**2) for s in SPREADS]),
        "push": (1.0 - NOTHING - OUTSIDE)
        * np.mean([density(z - a * shift, 1.0 / 6.0 + (1.0 - a) ** 2 / 24.0 + a**2 / 8.0) for a in AMPLITUDES]),
    }
    total = sum(weights.values())
    assert found.nothing == pytest.approx(weights["nothing"] / total, rel=1e-6)
    assert found.effects["push"] == pytest.approx(weights["push"] / total, rel=1e-6)


def test_probabilities_add_up_and_go_to_what_is_there():
    taught = models({"push": 4.0 * unit(0, 8), "pull": 4.0 * unit(3)})
    for z, answer in ((2.0 * unit(0, 8), "push"), (2.0 * unit(3), "pull")):
        found = posterior(taught, z, 6)
        assert found.best[0] == answer
        assert found.best[1] > 0.9
        assert found.nothing + found.outside + sum(found.effects.values()) == pytest.approx(1.0)
    assert posterior(taught, np.zeros(SIZE), 6).nothing > 0.8
    assert posterior(taught, 5.0 * unit(5, 11) - 3.0 * unit(2), 6).outside > 0.9


def test_what_recalibration_can_do_is_nobodys_effect():
    """A shift along a parameter that may move by as much leaves nothing to explain."""
    shift = 3.0 * unit(0)
    free = posterior(models({"push": 4.0 * unit(0, 1)}, sensitivity=shift), shift, 6)
    fixed = posterior(models({"push": 4.0 * unit(0, 1)}), shift, 6)
    assert free.nothing > 0.8
    assert fixed.nothing < 1e-3


def test_few_degrees_of_freedom_make_the_answer_less_sure():
    """On average over the noise of the data, which fills all dimensions."""
    noise = np.sqrt(5.0 / 24.0) * np.random.default_rng(0).standard_normal((50, SIZE))

    def nothing(freedom):
        taught = models({"push": 4.0 * unit(0)}, freedom=freedom)
        return np.mean([np.log(posterior(taught, 1.6 * unit(0) + one, 6).nothing) for one in noise])

    assert nothing(5) > nothing(10_000) + 0.5


def test_a_mirror_image_is_an_effects_as_well():
    one = Taught("tilt", 4.0 * unit(0), 12, True)
    found = posterior(Models(np.zeros(SIZE), 24, np.eye(SIZE), 200, np.zeros((SIZE, 0)), (one,)), -2.0 * unit(0), 6)
    assert found.effects["tilt"] > 0.9


def test_models_are_taught_by_pours():
    sample = sample_of(np.random.default_rng(0), {"push": 4.0 * unit(2)}, sensitivity=unit(5))
    found = taught_by(sample, [("push", "push", False)])
    assert found.effects[0].shift == pytest.approx(4.0 * unit(2), abs=0.5)
    assert found.sensitivity[:, 0] == pytest.approx(unit(5), abs=0.3)
    assert np.diag(found.covariance) == pytest.approx(1.0, abs=0.3)
    assert found.freedom == 2 * 96 + 96 - 2
    few = sample_of(np.random.default_rng(0), {"push": unit(0)}, pours=1)
    with pytest.raises(StatisticsError, match="push: 1 pours"):
        taught_by(few, [("push", "push", False)])


def test_a_replay_names_what_is_far_apart_and_nothing_where_nothing_is():
    """Two effects of 4 pours' deviations at right angles; data have half of it, 2 √6 = 4.9 σ."""
    shifts = {"a strong": 4.0 * unit(0), "a weak": 2.0 * unit(0), "b strong": 4.0 * unit(7), "b weak": 2.0 * unit(7)}
    sample = sample_of(np.random.default_rng(1), shifts)
    kinds = [Kind(name, name, False) for name in "ab"]
    found = replay("scan", sample, kinds, kinds, 8, 10, np.random.default_rng(0))
    assert (found.sets, found.nulls) == (20, 10 * NULLS)
    assert found.right == 1.0
    assert found.named == (1.0,) * len(RISKS)
    assert set(found.by_effect) == {"a", "b"}


def test_a_replay_of_effects_that_are_alike_is_a_guess():
    shifts = {f"{name} {size}": length * unit(0) for name in "ab" for size, length in (("strong", 4.0), ("weak", 2.0))}
    sample = sample_of(np.random.default_rng(1), shifts)
    kinds = [Kind(name, name, False) for name in "ab"]
    found = replay("scan", sample, kinds, kinds, 8, 40, np.random.default_rng(0))
    assert 0.2 < found.right < 0.8
    assert found.named[RISKS.index(0.01)] < 0.2


def test_a_feature_that_hardly_ever_varies_does_not_spoil_the_answer():
    """Constant in the pours that teach, unlike in some that are data: it is left out, and every answer is a number."""
    shifts = {"a strong": 4.0 * unit(0), "a weak": 2.0 * unit(0)}
    sample = sample_of(np.random.default_rng(1), shifts)
    for blocks in sample.pours.values():
        blocks[0][:, 3] = 0.0
    sample.pours["base"][0][::40, 3] = 1.0
    kinds = [Kind("a", "a", False)]
    found = replay("scan", sample, kinds, kinds, 8, 20, np.random.default_rng(0))
    assert found.named == (1.0,) * len(RISKS)
