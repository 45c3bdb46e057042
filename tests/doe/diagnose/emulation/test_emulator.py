"""The emulator on polynomials that it must recover, and its errors against brute force."""

from dataclasses import replace

import numpy as np
import pytest

from doe.diagnose.emulation.emulator import fit_emulator
from doe.diagnose.emulation.lack_of_fit import lack_of_fit_variance
from doe.diagnose.emulation.terms import monomials
from doe.diagnose.runs import BASE, Condition, Declared, Effect, Parameter, Runs
from doe.errors import StatisticsError

DECLARED = Declared(
    (Parameter("a", 0.0, 2.0), Parameter("b", -1.0, 1.0)),
    (Effect("one", (0.0,), (5.0,)), Effect("two", (-1.0, -1.0), (1.0, 1.0)), Effect("never", (0.0,), (1.0,))),
    (Condition("first", ("x", "y")), Condition("second", ("z",))),
)
NO_FLOORS = (np.zeros(2), np.zeros(1))


def means(theta, effect, amplitude):
    a, b = theta[:, 0] - 1, theta[:, 1]
    s = amplitude[:, 0] / 5 * (effect == 0)
    u, v = (amplitude * (effect == 1)[:, None]).T
    first = np.column_stack([3 + a + 2 * b - a * b + 4 * s, 1 - a**2 + s + s**2 + 0.5 * u * v + u])
    return first, (2 * a + b + s * a - 3 * s + u - 2 * v)[:, None]


def make_runs(noise=0.1, seed=0, base=40, own=30):
    generator = np.random.default_rng(seed)
    effect = np.concatenate([np.full(base, BASE), np.repeat([0, 1], own)])
    n = len(effect)
    theta = np.column_stack([generator.uniform(0, 2, n), generator.uniform(-1, 1, n)])
    amplitude = np.where(
        (effect == 0)[:, None], generator.uniform(0, 5, (n, 2)) * [1, 0], generator.uniform(-1, 1, (n, 2))
    )
    amplitude[effect == BASE] = 0
    first, second = means(theta, effect, amplitude)
    first, second = (m + noise * generator.standard_normal(m.shape) for m in (first, second))
    second[::7] = np.nan
    return Runs(theta, effect, amplitude, (first, second))


def test_an_exact_polynomial_is_recovered():
    emulator = fit_emulator(DECLARED, make_runs(noise=0.0), (np.full(2, 0.1), np.full(1, 0.1)))
    theta, low = np.array([1.4, -0.3]), emulator.predictor((0, 1)).low
    x = np.array([0.4, -0.3, 0.5, -0.2, 0.6])
    one = np.concatenate(means(theta[None], np.array([0]), np.array([[2.5, 0.0]])), axis=1)[0]
    two = np.concatenate(means(theta[None], np.array([1]), np.array([[-0.2, 0.6]])), axis=1)[0]
    base = np.concatenate(means(theta[None], np.array([BASE]), np.zeros((1, 2))), axis=1)[0]
    assert emulator.predictor((0,)).mean(x[:3]) == pytest.approx(one, abs=1e-9)
    assert emulator.predictor((0, 1)).mean(x) == pytest.approx(one + two - base, abs=1e-9)
    assert len(low) == 5
    assert emulator.simulated_effects == (0, 1)
    assert emulator.blocks[0].r2 == pytest.approx(1)
    with pytest.raises(StatisticsError, match="never"):
        emulator.predictor((2,))


def test_extrapolation_is_refused():
    model = fit_emulator(DECLARED, make_runs(), NO_FLOORS).predictor((0,))
    with pytest.raises(StatisticsError, match="outside the simulated box"):
        model.mean(np.array([0.0, 0.0, 1.5]))
    with pytest.raises(StatisticsError, match="outside the simulated box"):
        model.mean(np.array([1.2, 0.0, 0.5]))


def test_too_few_base_runs_are_refused():
    with pytest.raises(StatisticsError, match="5 base runs"):
        fit_emulator(DECLARED, make_runs(base=5), NO_FLOORS)


def test_noise_and_its_prediction_error_are_those_put_in():
    """Standardised errors of the mean at a fixed point over 60 sets of runs are standard normal."""
    x = np.array([0.3, -0.4, 0.5])
    truth = np.concatenate(means(np.array([[1.3, -0.4]]), np.array([0]), np.array([[2.5, 0.0]])), axis=1)[0]
    z, variances = [], []
    for seed in range(60):
        emulator = fit_emulator(DECLARED, make_runs(noise=0.5, seed=seed), NO_FLOORS)
        model = emulator.predictor((0,))
        sd = np.sqrt(np.concatenate([np.diag(c) for c in model.mean_covariance(x)]))
        z.append((model.mean(x) - truth) / sd)
        variances.append(np.diag(emulator.blocks[0].noise.covariance))
    # 180 values, partly dependent: four standard errors of a mean square of one are 0.42. Terms chosen by the runs
    # themselves leave out weak ones, which adds some bias, so the limit above is wider.
    assert 0.6 < np.mean(np.square(z)) < 1.6
    assert np.mean(variances) == pytest.approx(0.25, rel=0.06)


def test_leave_one_out_is_that_of_refits():
    runs = make_runs(noise=0.5, base=30, own=0)
    emulator = fit_emulator(DECLARED, runs, NO_FLOORS)
    values, errors = runs.blocks[0], []
    design = monomials(np.column_stack([runs.theta[:, 0] - 1, runs.theta[:, 1]]), emulator.base_exponents)
    for i in range(len(values)):
        keep = np.arange(len(values)) != i
        errors.append(values[i] - design[i] @ np.linalg.lstsq(design[keep], values[keep], rcond=None)[0])
    scatter = ((values - values.mean(axis=0)) ** 2).sum(axis=0)
    assert emulator.blocks[0].r2 == pytest.approx(1 - np.square(errors).sum(axis=0) / scatter)


def test_lack_of_fit_finds_the_bias_of_a_straight_line_on_a_parabola():
    """y = x^2 on x = -1, 0, 1, ten runs each: the mean is fitted, bias 1/3, -2/3, 1/3, mean square 2/9."""
    generator = np.random.default_rng(0)
    x = np.repeat([-1.0, 0.0, 1.0], 10)
    design = np.column_stack([np.ones(30), x])
    values = (x**2 + 0.1 * generator.standard_normal(30))[:, None]
    hat = design @ np.linalg.inv(design.T @ design) @ design.T
    bent = lack_of_fit_variance(x[:, None], values, values - hat @ values, np.diag(hat))
    # Noise of 0.1 per run moves the three means by 0.03, the mean square by about 10 %.
    assert bent == pytest.approx([2 / 9], rel=0.15)
    straight = values - (x**2)[:, None]
    assert lack_of_fit_variance(x[:, None], straight, straight - hat @ straight, np.diag(hat)) == [0.0]
    distinct = np.arange(30.0)[:, None]
    assert lack_of_fit_variance(distinct, values, values - hat @ values, np.diag(hat)) == [0.0]


def with_jams(runs, effect, size, seed=1):
    """Every fourth run of ``effect`` jams, which adds ``size`` times the amplitude to the first summary."""
    generator = np.random.default_rng(seed)
    jams = (runs.effect == effect) & (generator.uniform(size=len(runs.effect)) < 0.25)
    first = runs.blocks[0].copy()
    first[jams, 0] += size * runs.amplitude[jams, 0] / 5
    return replace(runs, blocks=(first, runs.blocks[1]))


def test_an_effect_that_strays_answers_for_it_alone():
    """Jams of one effect widen that effect's own prediction in that summary, and leave the base as it was."""
    clean = make_runs(noise=0.1)
    still, jammed = (fit_emulator(DECLARED, runs, NO_FLOORS) for runs in (clean, with_jams(clean, 0, 50.0)))
    # Noise of 0.1 alone: what summaries share is less than it.
    assert all((block.excess < 0.01).all() for block in still.blocks)
    excess = jammed.blocks[0].excess
    assert np.argwhere(excess > 0.01).tolist() == [[0, 0]]
    # A quarter of the runs is 50 too high at full amplitude: variance 50² · 1/4 · 3/4, known to a half from 7 jams.
    assert excess[0, 0] == pytest.approx(469, rel=0.6)
    theta = np.array([0.4, -0.3])
    apart = jammed.predictor(()).mean(theta) - still.predictor(()).mean(theta)
    assert apart == pytest.approx(0, abs=0.1)
    covariance = jammed.predictor((0,)).mean_covariance
    assert np.sqrt(covariance(np.append(theta, 1.0))[0][0, 0]) > 10
    assert covariance(np.append(theta, 0.0))[0][0, 0] == pytest.approx(
        still.predictor(()).mean_covariance(theta)[0][0, 0], rel=0.6
    )


def test_a_bias_that_no_single_summary_shows_is_shared():
    """A wave that no candidate has, of 0.8 of a pour: the mean over summaries sees it, and noise brings none."""
    shared = {bias: [] for bias in (0.0, 0.4)}
    for bias, found in shared.items():
        for seed in range(30):
            runs = make_runs(noise=0.5, seed=seed)
            level = np.where(runs.effect == 0, runs.amplitude[:, 0] / 5, 0.0)
            wave = bias * np.sin(3 * np.pi * level)
            runs = replace(runs, blocks=tuple(block + wave[:, None] for block in runs.blocks))
            found.append(fit_emulator(DECLARED, runs, NO_FLOORS).blocks[0].excess[0].mean())
    assert np.median(shared[0.0]) < 0.05
    assert np.mean(shared[0.4]) > np.mean(shared[0.0]) + 0.05
