"""The posterior: densities against SciPy's, and answers that have to come out; the replay on made-up pours."""

import numpy as np
import pytest
from scipy import stats

from doe.diagnose.limit import RISKS, Kind
from doe.diagnose.posterior import AMPLITUDES, NOTHING, OUTSIDE, SPREADS, posterior
from doe.diagnose.replay import NULLS, Teaching, Truth, replay
from doe.diagnose.shared_emulator import (
    CURVATURE,
    SQUASH,
    Emulator,
    Group,
    Squash,
    Way,
    emulated,
    regression,
    signature_prior,
)
from doe.errors import StatisticsError
from tests.doe.test_ruler import D, sample_of, unit

SIZE = 2 * D
UNSQUASHED = Squash(np.zeros(D), np.full(D, 1e9))
"""So wide that it does nothing."""


def emulator(shifts, freedom=200, pours=12, sensitivity=None, two_sided=False, variance=25.0):
    """Of features of unit noise, with the base model at zero and effects shifting by ``shifts`` at amplitude 1."""
    numbers = np.array([24.0, *(pours for _ in shifts)])
    means = np.stack([np.zeros(SIZE), *shifts.values()])
    ways, ones = np.arange(len(shifts)), np.ones(len(shifts))
    mean, covariance = regression(ways, ones, numbers, means, np.full(SIZE, variance), len(shifts))
    parameters = np.zeros((SIZE, 0)) if sensitivity is None else sensitivity[:, None]
    names = tuple(Way(name, name, two_sided) for name in shifts)
    return Emulator(names, mean, covariance, parameters, freedom, (UNSQUASHED,) * 2, np.eye(SIZE))


def test_without_effects_it_is_the_ratio_of_two_densities():
    """Nothing against outside, by SciPy's multivariate t with a parameter."""
    rng = np.random.default_rng(0)
    slope, z = rng.standard_normal(SIZE), rng.standard_normal(SIZE)
    found = posterior(emulator({}, freedom=30, sensitivity=slope), z, 6)

    def density(more):
        scale = np.eye(SIZE) * (1.0 / 6.0 + 1.0 / 24.0 + more) + np.outer(slope, slope)
        return stats.multivariate_t.pdf(z, shape=scale, df=30)

    nothing, outside = NOTHING * density(0.0), OUTSIDE * np.mean([density(s**2) for s in SPREADS])
    assert found.nothing == pytest.approx(nothing / (nothing + outside), rel=1e-6)


def test_an_effect_by_conditioning_a_gaussian():
    """Prediction by the joint normal of base, taught pours and data, evidence by SciPy's t; no regression in it."""
    shift, slope, prior, pours = 3.0 * unit(1, 7), 0.5 * unit(3), 4.0, 8
    z = 1.4 * unit(1, 7)
    found = posterior(emulator({"push": shift}, freedom=50, pours=pours, sensitivity=slope, variance=prior), z, 6)

    def log_t(mean, variance):
        scale = np.diag(variance) + np.outer(slope, slope)
        return stats.multivariate_t.pdf(z - mean, shape=scale, df=50)

    def predicted(a):
        wide = 1e7  # of the base model, which is flat
        here, there = np.array([a, a**2 - a]), np.array([1.0, 0.0])
        kernel = np.diag([prior, CURVATURE**2 * prior])
        seen = np.array([[wide + 1.0 / 24.0, wide], [wide, wide + there @ kernel @ there + 1.0 / pours]])
        between = np.array([wide, wide + here @ kernel @ there])
        weights = np.linalg.solve(seen, between)
        return weights[1] * shift, np.full(SIZE, wide + here @ kernel @ here - weights @ between + 1.0 / 6.0)

    base = 1.0 / 24.0
    # The base model is known better by the effect's pours, as far as these may be off it.
    base = 1.0 / (1.0 / base + 1.0 / (prior + 1.0 / pours))
    offset = base / (prior + 1.0 / pours) * shift
    weights = {
        "nothing": NOTHING * log_t(offset, np.full(SIZE, 1.0 / 6.0 + base)),
        "outside": OUTSIDE * np.mean([log_t(offset, np.full(SIZE, 1.0 / 6.0 + base + s**2)) for s in SPREADS]),
        "push": (1.0 - NOTHING - OUTSIDE) * np.mean([log_t(*predicted(a)) for a in AMPLITUDES]),
    }
    total = sum(weights.values())
    assert found.nothing == pytest.approx(weights["nothing"] / total, rel=1e-5)
    assert found.effects["push"] == pytest.approx(weights["push"] / total, rel=1e-5)


def test_probabilities_add_up_and_go_to_what_is_there():
    taught = emulator({"push": 4.0 * unit(0, 8), "pull": 4.0 * unit(3)})
    for z, answer in ((2.0 * unit(0, 8), "push"), (2.0 * unit(3), "pull")):
        found = posterior(taught, z, 6)
        assert found.best[0] == answer
        assert found.best[1] > 0.9
        assert found.nothing + found.outside + sum(found.effects.values()) == pytest.approx(1.0)
    assert posterior(taught, np.zeros(SIZE), 6).nothing > 0.8
    assert posterior(taught, 5.0 * unit(5, 11) - 3.0 * unit(2), 6).outside > 0.9


def test_the_best_amplitude_is_told():
    """Where signatures are expected to be of about this size, and so not far from proportional."""
    taught = emulator({"push": 4.0 * unit(0, 8)}, variance=1.0)
    for share in (0.3, 0.5, 1.0):
        fit = posterior(taught, share * 4.0 * unit(0, 8), 6).fits["push"]
        assert fit.amplitude == pytest.approx(share, rel=0.35)


def test_what_recalibration_can_do_is_nobodys_effect():
    """A shift along a parameter that may move by as much leaves nothing to explain."""
    shift = 3.0 * unit(0)
    free = posterior(emulator({"push": 4.0 * unit(0, 1)}, sensitivity=shift), shift, 6)
    fixed = posterior(emulator({"push": 4.0 * unit(0, 1)}), shift, 6)
    assert free.nothing > 0.8
    assert fixed.nothing < 1e-3


def test_few_degrees_of_freedom_make_the_answer_less_sure():
    """On average over the noise of the data, which fills all dimensions."""
    noise = np.sqrt(5.0 / 24.0) * np.random.default_rng(0).standard_normal((50, SIZE))

    def nothing(freedom):
        taught = emulator({"push": 4.0 * unit(0)}, freedom=freedom)
        return np.mean([np.log(posterior(taught, 1.6 * unit(0) + one, 6).nothing) for one in noise])

    assert nothing(5) > nothing(10_000) + 0.5


def test_a_mirror_image_is_an_effects_as_well():
    taught = emulator({"tilt": 4.0 * unit(0)}, two_sided=True)
    assert posterior(taught, -2.0 * unit(0), 6).effects["tilt"] > 0.9
    up, down = (taught.at(0, np.array([a]))[0][0] for a in (0.7, -0.7))
    base = taught.base()[0]
    assert up - base == pytest.approx(base - down)


def test_the_base_model_is_known_better_by_pours_of_effects_that_hardly_move_it():
    still = emulator({"a": np.zeros(SIZE), "b": np.zeros(SIZE)}, variance=1e-3)
    moving = emulator({"a": np.zeros(SIZE), "b": np.zeros(SIZE)}, variance=1e6)
    assert moving.base()[1] == pytest.approx(1.0 / 24.0, rel=1e-3)
    assert still.base()[1] == pytest.approx(1.0 / 48.0, rel=0.05)


def test_the_emulator_is_taught_by_pours():
    sample = sample_of(np.random.default_rng(0), {"push": 4.0 * unit(2), "half": 2.0 * unit(2)}, sensitivity=unit(5))
    pours, name = sample.pours, sample.parameters[0]
    groups = [Group(0, 1.0, pours["push"]), Group(0, 0.5, pours["half"])]
    found = emulated(pours["base"], [(pours[f"{name} -"], pours[f"{name} +"])], [Way("push", "push", False)], groups)
    assert found.freedom == 2 * 96 + 96 + 96 - 3
    z = {kind: found.seen(pours[kind]) for kind in ("base", "push", "half")}
    for kind, amplitude in (("push", 1.0), ("half", 0.5)):
        mean, variance = found.at(0, np.array([amplitude]))
        assert mean[0] == pytest.approx(z[kind], abs=0.4)
        assert (variance > 0.0).all()
    # Lengths do not depend on the axes; four deviations are drawn in a little, and so is what they are measured by.
    assert np.linalg.norm(z["push"] - z["base"]) == pytest.approx(4.0, rel=0.2)
    assert np.linalg.norm(found.parameters) == pytest.approx(1.0, rel=0.25)


def test_what_cannot_teach_is_refused():
    sample = sample_of(np.random.default_rng(0), {"push": unit(0)}, pours=1)
    with pytest.raises(StatisticsError, match="push: 1 pours"):
        emulated(sample.pours["base"], [], [Way("push", "push", False)], [Group(0, 1.0, sample.pours["push"])])
    with pytest.raises(StatisticsError, match="push: no pours"):
        emulated(sample.pours["base"], [], [Way("push", "push", False)], [])


def test_signatures_of_noise_alone_are_not_believed():
    rng = np.random.default_rng(0)
    noise = np.full(18, 0.2)
    nothing, _ = signature_prior(np.sqrt(0.2) * rng.standard_normal((18, 90)), noise)
    assert nothing.max() < 0.1 * 0.2
    along = rng.standard_normal((18, 1)) * 5.0 * np.eye(90)[:1]
    values, axes = signature_prior(along + np.sqrt(0.2) * rng.standard_normal((18, 90)), noise)
    assert values.max() == pytest.approx((along**2).sum() / 18, rel=0.3)
    assert abs(axes[0, values.argmax()]) > 0.95
    assert np.sort(values)[-2] < 0.1 * 0.2


def test_a_rare_large_count_is_drawn_in():
    squash = Squash(np.zeros(1), np.ones(1))
    small, large = squash(np.array([[0.1]])), squash(np.array([[100.0]]))
    assert small[0, 0] == pytest.approx(0.1, rel=1e-3)
    assert large[0, 0] == pytest.approx(SQUASH * np.arcsinh(100.0 / SQUASH))


def truths(kinds):
    return [Truth(kind, "weak", 4.9) for kind in kinds]


@pytest.mark.parametrize("teaching", [Teaching(8, 0), Teaching(4, 12)])
def test_a_replay_names_what_is_far_apart_and_nothing_where_nothing_is(teaching):
    """Two effects of 4 pours' deviations at right angles; data have half of it, 2 √6 = 4.9 σ."""
    shifts = {"a strong": 4.0 * unit(0), "a weak": 2.0 * unit(0), "b strong": 4.0 * unit(7), "b weak": 2.0 * unit(7)}
    sample = sample_of(np.random.default_rng(1), shifts)
    kinds = [Kind(name, name, False) for name in "ab"]
    found = replay("scan", sample, kinds, truths(kinds), teaching, 10, np.random.default_rng(0))
    assert (found.sets, found.nulls) == (20, 10 * NULLS)
    assert found.right == 1.0
    assert found.named == (1.0,) * len(RISKS)
    assert set(found.by_effect) == {"a", "b"}
    assert (found.pours > 0.0) == (teaching.more > 0)
    assert max(found.false) <= 2


def test_a_replay_of_effects_that_are_alike_is_a_guess():
    shifts = {f"{name} {size}": length * unit(0) for name in "ab" for size, length in (("strong", 4.0), ("weak", 2.0))}
    sample = sample_of(np.random.default_rng(1), shifts)
    kinds = [Kind(name, name, False) for name in "ab"]
    found = replay("scan", sample, kinds, truths(kinds), Teaching(8, 0), 40, np.random.default_rng(0))
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
    found = replay("scan", sample, kinds, truths(kinds), Teaching(8, 0), 20, np.random.default_rng(0))
    assert found.named == (1.0,) * len(RISKS)
