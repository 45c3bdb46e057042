"""Fresh pours at a best fit: the Gaussian update in closed form, and a truth that no polynomial of the box follows."""

import numpy as np
import pytest

from doe.diagnose.decision.decide import diagnose
from doe.diagnose.emulation.emulator import fit_emulator
from doe.diagnose.emulation.fresh_pours import BASE_DF, FreshPours, anchored, newest, taught
from doe.diagnose.emulation.predictor import BIAS_LENGTH
from doe.diagnose.runs import BASE, Condition, Declared, Effect, Observed, Parameter, Runs

DECLARED = Declared(
    (Parameter("a", -1.0, 1.0),),
    (Effect("steep", (0.0,), (1.0,)), Effect("flat", (0.0,), (1.0,))),
    (Condition("one", ("x", "y")), Condition("two", ("z",))),
)
NOISE = 0.1


def truth(a, steep, flat):
    """`steep` acts from half its range on, as a pour that begins to hang does."""
    step = 1.0 / (1.0 + np.exp(-(steep - 0.5) / 0.08))
    return np.column_stack([a + step, 1.0 - a + 0.4 * flat]), (2.0 * a + 0.2 * steep + 0.2 * flat)[:, None]


def poured(generator, n, a, steep=0.0, flat=0.0):
    blocks = truth(*np.broadcast_arrays(np.full(n, a), steep, flat))
    return tuple(block + NOISE * generator.standard_normal(block.shape) for block in blocks)


def make_runs(generator):
    effect = np.repeat([BASE, 0, 1], [40, 30, 30])
    a, amplitude = generator.uniform(-1, 1, 100), generator.uniform(0, 1, 100)
    blocks = truth(a, amplitude * (effect == 0), amplitude * (effect == 1))
    noisy = tuple(block + NOISE * generator.standard_normal(block.shape) for block in blocks)
    return Runs(a[:, None], effect, np.column_stack([amplitude * (effect != BASE), np.zeros(100)]), noisy)


def emulated(generator):
    return fit_emulator(DECLARED, make_runs(generator), (np.zeros(2), np.zeros(1)))


def test_about_the_fit_the_pours_alone_tell_the_level():
    """Mean of nine pours with its standard error; scattered about the fit, they are first brought there."""
    generator = np.random.default_rng(0)
    bare = emulated(generator).predictor((0,))
    x, n = np.array([0.2, 0.6]), 9
    points = x + 0.1 * generator.uniform(-1, 1, (n, 2))
    points += x - points.mean(axis=0)
    at_points, at_fit = np.array([bare.mean(p) for p in points]), bare.mean(x)
    off = 0.3 + NOISE * generator.standard_normal((n, 3))
    values = at_points + off
    held = anchored(bare, points, (values[:, :2], values[:, 2:]))
    assert held.mean(x) == pytest.approx(at_fit + off.mean(axis=0))
    cuts = [2]
    for c, part in enumerate(np.split(off, cuts, axis=1)):
        pour = np.diag(bare.pour_covariance[c])
        pooled = (BASE_DF * pour + (n - 1) * part.var(axis=0, ddof=1)) / (BASE_DF + n - 1)
        assert np.diag(held.mean_covariance(x)[c]) == pytest.approx(np.maximum(pour, pooled) / n)


def test_what_the_pours_say_fades_with_the_distance():
    generator = np.random.default_rng(1)
    bare = emulated(generator).predictor((0,))
    x = np.array([0.0, 0.6])
    held = anchored(bare, np.tile(x, (12, 1)), poured(generator, 12, *x))
    assert bare.bias_variance(x)[0][0] > 5 * held.bias_variance(x)[0][0]
    far = np.array([-0.9, 0.95])
    distance = (((far - x) / (bare.high - bare.low)) ** 2).sum() / BIAS_LENGTH**2
    expected = held.bias_variance(x)[0] + (1 - np.exp(-distance)) * bare.bias_variance(far)[0]
    assert held.bias_variance(far)[0] == pytest.approx(expected)
    assert held.variance_shares(far)[0] > held.variance_shares(x)[0]


def test_one_pour_is_no_mean():
    generator = np.random.default_rng(2)
    bare = emulated(generator).predictor((0,))
    x = np.array([0.0, 0.6])
    blocks = poured(generator, 12, *x)
    held = anchored(bare, np.tile(x, (12, 1)), (blocks[0], np.where(np.arange(12)[:, None] == 0, blocks[1], np.nan)))
    assert held.mean(x)[2] == bare.mean(x)[2]
    assert held.mean_covariance(x)[1] == pytest.approx(bare.mean_covariance(x)[1])
    assert held.mean(x)[0] != bare.mean(x)[0]


def test_stated_errors_hold_about_the_fit():
    squares = {"bare": [], "held": []}
    for seed in range(40):
        generator = np.random.default_rng([3, seed])
        bare = emulated(generator).predictor((0,))
        x = np.array([generator.uniform(-0.5, 0.5), generator.uniform(0.3, 0.9)])
        held = anchored(bare, np.tile(x, (12, 1)), poured(generator, 12, *x))
        near = x + generator.uniform(-0.1, 0.1, 2)
        for name, model in (("bare", bare), ("held", held)):
            error = model.mean(near)[0] - truth(near[:1], near[1:], 0.0)[0][0, 0]
            squares[name].append((error**2, model.mean_covariance(near)[0][0, 0]))
    error, stated = np.array(squares["held"]).T
    assert error.mean() < 0.6 * np.array(squares["bare"])[:, 0].mean()
    # Mean of 40 squares of unit normals: 1 ± 0.22; the step is no Gaussian process, so a factor of two.
    assert (error / stated).mean() < 2.0


def fresh_at(generator, model, n=12):
    (a,), (amplitude,) = model.parameters, (one.value for one in model.amplitudes)
    blocks = poured(generator, n, a, **{model.label: amplitude})
    return FreshPours(model.members, np.full((n, 1), a), np.full((n, 1), amplitude), blocks)


def test_pours_at_the_best_fit_decide_what_the_emulator_could_not():
    """At the true amplitude the emulator misses the step by a third of it, and calls the truth unfit."""
    generator = np.random.default_rng(4)
    runs = make_runs(generator)
    data = Observed(poured(generator, 6, 0.1, 0.62), (np.zeros(2), np.zeros(1)))
    first = diagnose(DECLARED, runs, data, bootstrap=500)
    fresh = [fresh_at(generator, found) for found in first.models if found.members]
    second = diagnose(DECLARED, runs, data, bootstrap=500, fresh=fresh)
    spread = [v.effects[0].amplitudes[0].standard_error for v in (first, second)]
    assert second.kind == "effect:steep"
    assert spread[1] < spread[0]


def test_all_pours_of_single_effects_teach_and_the_newest_hold():
    generator = np.random.default_rng(5)
    runs = make_runs(generator)
    first, second, other = (
        FreshPours((e,), np.full((4, 1), 0.1 * k), np.full((4, 1), 0.5), poured(generator, 4, 0.1 * k))
        for k, e in enumerate((0, 0, 1))
    )
    assert newest([first, second, other]) == (second, other)
    grown = taught(runs, [first, second, other])
    assert grown.effect[-12:].tolist() == [0] * 8 + [1] * 4
    assert grown.theta[-12:, 0] == pytest.approx(np.repeat([0.0, 0.1, 0.2], 4))
    assert grown.amplitude[-1] == pytest.approx([0.5, 0.0])
    assert grown.blocks[0][-4:] == pytest.approx(other.blocks[0])
    pair = FreshPours((0, 1), np.zeros((4, 1)), np.full((4, 2), 0.1), first.blocks)
    assert taught(runs, [pair]) is runs
    assert pair.coded(DECLARED).tolist() == [[0.0, 0.1, 0.1]] * 4


def test_a_wider_scatter_at_the_fit_is_noise_of_the_data_too():
    generator = np.random.default_rng(6)
    bare = emulated(generator).predictor((0,))
    x = np.array([0.0, 0.6])
    wide = [3.0 * (b - b.mean(axis=0)) + b.mean(axis=0) for b in poured(generator, 200, *x)]
    spread = np.concatenate(anchored(bare, np.tile(x, (200, 1)), wide).spread)
    # 200 pours: the standard deviation to 5 %, and the base model's own to 10 %.
    assert spread == pytest.approx(3.0, rel=0.25)
    calm = anchored(bare, np.tile(x, (200, 1)), [0.1 * (b - b.mean(axis=0)) + b.mean(axis=0) for b in wide])
    assert np.concatenate(calm.spread) == pytest.approx(1.0)
    assert np.concatenate(bare.spread) == pytest.approx(1.0)
