"""The posterior: densities against SciPy's, and answers that have to come out; cross-validation on made-up pours."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats

from doe.analysis.covariance import log_t, shrunk_covariance
from doe.analysis.empirical_bayes import prior_along_axes, relative_sizes
from doe.analysis.squash import SQUASH, Squash
from doe.diagnose.emulator import (
    ANGLES,
    CURVATURE,
    Emulator,
    Lessons,
    Way,
    emulated,
    planar_weights,
    regression,
)
from doe.diagnose.posterior import (
    BEYOND,
    FITS,
    NOTHING,
    OUTSIDE,
    PAIRS,
    SPREADS,
    Data,
    Fit,
    gain_by_pours,
    multiples,
    posterior,
)
from doe.errors import StatisticsError
from doe.validation.cross_validation import NULLS, PlantedTruth, Teaching, cross_validated, joined
from doe.validation.limit import RISKS, DataKind
from tests.doe.validation.test_limit_ruler import D, sample_of, unit

SIZE = 2 * D
UNSQUASHED = Squash(np.zeros(D), np.full(D, 1e9))
"""So wide that it does nothing."""
SURE = 1e5
"""Deviations of a parameter at which two pours tell its slope for certain."""
BASE = 24


def emulator(shifts, freedom=200, pours=12, sensitivity=None, variance=25.0, ways=None, moved=SURE):
    """Of features of unit noise, with the base model at zero and effects shifting by ``shifts`` at amplitude 1."""
    m = len(shifts)
    rows = [np.zeros(3 + 2 * m)] * BASE
    z = [np.zeros(SIZE)] * BASE
    slope = np.zeros(SIZE) if sensitivity is None else sensitivity
    for k, sign in enumerate((-moved, moved)):
        rows[k] = sign * np.eye(3 + 2 * m)[1]
        z[k] = sign * slope
    for way, shift in enumerate(shifts.values()):
        rows += [np.eye(3 + 2 * m)[2 + way]] * pours
        z += [shift] * pours
    table = np.array(rows)
    table[:, 0] = 1.0
    tables = np.tile(table, (SIZE, 1, 1))
    mean, covariance = regression(
        tables, np.array(z).T, np.zeros(1), np.full(SIZE, variance), np.ones(m), np.ones(SIZE)
    )
    covariance[:, -1, -1] = 0.0  # the parameter's answer is known to be straight
    names = ways or tuple(Way(name, name) for name in shifts)
    return Emulator(
        names,
        1,
        mean,
        covariance,
        tables.swapaxes(1, 2) @ tables,
        np.ones(SIZE),
        freedom,
        (UNSQUASHED,) * 2,
        np.eye(SIZE),
        (1.0,) * m,
        np.zeros(m),
    )


def judged(taught, z, replicates=6, pairs=False):
    return posterior(taught, Data(z, replicates), temperature=1.0, pairs=pairs)


def t_of(d, scale, freedom):
    """SciPy's density where the covariance was ``scale`` by ``freedom`` degrees of freedom."""
    left = freedom - len(d) + 1
    return stats.multivariate_t.pdf(d, shape=scale * freedom / left, df=left)


def test_the_density_is_a_gaussian_integrated_over_the_covariance():
    """Over an inverse Wishart distribution, by 200 000 draws: what ν degrees of freedom leave of Σ = I."""
    freedom, draws = 9, 200_000
    covariances = stats.invwishart.rvs(freedom, freedom * np.eye(2), size=draws, random_state=1)
    places = np.array([[0.0, 0.0], [1.5, 0.5], [3.0, -1.0]])
    inverse, factor = np.linalg.inv(covariances), 1.0 / np.sqrt(np.linalg.det(covariances))
    each = factor[:, None] * np.exp(-0.5 * np.einsum("ki,nij,kj->nk", places, inverse, places))
    found = np.exp(log_t(places, np.ones((3, 2)), np.zeros((3, 2, 0)), freedom))
    # Three standard errors of the mean over the draws.
    assert found / found[0] == pytest.approx(each.mean(axis=0) / each[:, 0].mean(), rel=0.02)


def test_what_predictions_vary_by_is_what_the_noise_of_each_pour_does_to_them():
    """The mean is linear in z: a unit of noise in one feature of one pour moves two predictions by d and e, sum d e."""
    rng = np.random.default_rng(5)
    theta, a = rng.standard_normal(9), np.repeat([0.0, 1.0, 2.0], 3)
    table = np.column_stack([np.ones(9), theta, a, a**2 - a, theta**2 - 1.0])
    tables, pour = np.tile(table, (SIZE, 1, 1)), np.geomspace(0.25, 4.0, SIZE)
    z, prior = rng.standard_normal((9, SIZE)), (np.full(1, 0.5), np.linspace(0.1, 9.0, SIZE), np.ones(1), pour)
    mean, covariance = regression(tables, z.T, *prior)
    taught = emulator({"push": np.zeros(SIZE)})
    found = replace(taught, mean=mean, covariance=covariance, information=tables.swapaxes(1, 2) @ tables, pour=pour)
    asked = np.array([[1.0, 0.5, 1.5, 0.75, -0.75], [1.0, -1.0, 0.0, 0.0, 0.0]])
    expected = np.zeros((2, 2))
    for number in range(9):
        noisy = z + np.eye(9)[number][:, None] * np.sqrt(pour)
        moved = asked @ (regression(tables, noisy.T, *prior)[0] - mean).T
        expected += moved @ moved.T
    assert found.scatter(asked) == pytest.approx(expected)
    assert found.placed(asked[:1] * [1, 0, 1, 1, 0], np.array([[0.5]])) == pytest.approx(asked[:1])


def test_without_effects_it_is_the_ratio_of_two_densities():
    """Nothing against outside, by SciPy's multivariate t with a parameter."""
    rng = np.random.default_rng(0)
    slope, z = rng.standard_normal(SIZE), rng.standard_normal(SIZE)
    found = judged(emulator({}, freedom=30, sensitivity=slope), z)

    def density(more):
        scale = np.eye(SIZE) * (1.0 / 6.0 + 1.0 / 24.0 + more) + np.outer(slope, slope)
        return t_of(z, scale, 2 * 30)

    nothing, outside = NOTHING * density(0.0), OUTSIDE * np.mean([density(s**2) for s in SPREADS])
    assert found.nothing == pytest.approx(nothing / (nothing + outside), rel=1e-6)


def test_what_is_not_known_of_a_slope_is_noise():
    """By two pours, a deviation up and one down: variance 1/2 of the slope, in every feature."""
    rng = np.random.default_rng(1)
    slope, z = rng.standard_normal(SIZE), rng.standard_normal(SIZE)
    found = judged(emulator({}, freedom=30, sensitivity=slope, moved=1.0), z)

    def density(more):
        scale = np.eye(SIZE) * (1.0 / 6.0 + 1.0 / 24.0 + 1.0 / 2.0 + more) + np.outer(slope, slope)
        return t_of(z, scale, 2 * 30)

    nothing, outside = NOTHING * density(0.0), OUTSIDE * np.mean([density(s**2) for s in SPREADS])
    assert found.nothing == pytest.approx(nothing / (nothing + outside), rel=1e-6)


@pytest.mark.parametrize("excess", [0.0, 2.0])
def test_an_effect_by_conditioning_a_gaussian(excess):
    """Prediction by the joint normal of base, taught pours and data, evidence by SciPy's t; no regression in it."""
    shift, slope, prior, pours = 3.0 * unit(1, 7), 0.5 * unit(3), 4.0, 8
    z = 1.4 * unit(1, 7)
    taught = emulator({"push": shift}, freedom=50, pours=pours, sensitivity=slope, variance=prior)
    found = judged(replace(taught, excess=np.array([excess])), z)

    def log_t(mean, variance):
        scale = np.diag(variance) + np.outer(slope, slope)
        return t_of(z - mean, scale, 2 * 50)

    def predicted(a):
        wide = 1e7  # of the base model, which is flat
        here, there = np.array([a, a**2 - a]), np.array([1.0, 0.0])
        kernel = np.diag([prior, CURVATURE**2 * prior])
        seen = np.array([[wide + 1.0 / 24.0, wide], [wide, wide + there @ kernel @ there + 1.0 / pours]])
        between = np.array([wide, wide + here @ kernel @ there])
        weights = np.linalg.solve(seen, between)
        return weights[1] * shift, np.full(
            SIZE, wide + here @ kernel @ here - weights @ between + min(4.0, 1.0 + excess * a) / 6.0
        )

    base = 1.0 / 24.0
    # The base model is known better by the effect's pours, as far as these may be off it.
    base = 1.0 / (1.0 / base + 1.0 / (prior + 1.0 / pours))
    offset = base / (prior + 1.0 / pours) * shift
    weights = {
        "nothing": NOTHING * log_t(offset, np.full(SIZE, 1.0 / 6.0 + base)),
        "outside": OUTSIDE * np.mean([log_t(offset, np.full(SIZE, 1.0 / 6.0 + base + s**2)) for s in SPREADS]),
        "push": (1.0 - NOTHING - OUTSIDE - PAIRS) * np.mean([log_t(*predicted(a)) for a in multiples(BEYOND)]),
    }
    total = sum(weights.values())
    assert found.nothing == pytest.approx(weights["nothing"] / total, rel=1e-5)
    assert found.effects["push"] == pytest.approx(weights["push"] / total, rel=1e-5)


def test_probabilities_add_up_and_go_to_what_is_there():
    taught = emulator({"push": 4.0 * unit(0, 8), "pull": 4.0 * unit(3)})
    for z, answer in ((2.5 * unit(0, 8), "push"), (2.5 * unit(3), "pull")):
        found = judged(taught, z)
        assert found.best[0] == answer
        assert found.best[1] > 0.9
        assert found.nothing + found.outside + sum(found.effects.values()) == pytest.approx(1.0)
    assert judged(taught, np.zeros(SIZE)).nothing > 0.8
    assert judged(taught, 5.0 * unit(5, 11) - 3.0 * unit(2)).outside > 0.9


def test_the_best_amplitude_is_told():
    """Where signatures are expected to be of about this size, and so not far from proportional."""
    taught = emulator({"push": 4.0 * unit(0, 8)}, variance=1.0)
    for share in (0.3, 0.5, 1.0):
        found = judged(taught, share * 4.0 * unit(0, 8))
        (amplitude,) = found.fits["push"].amplitudes
        (level,) = found.levels
        assert level.amplitude == pytest.approx(share, rel=0.35)
        assert amplitude.low < share < amplitude.high
        assert not amplitude.at_end


def test_what_recalibration_can_do_is_nobodys_effect():
    """A shift along a parameter that may move by as much leaves nothing to explain."""
    shift = 3.0 * unit(0)
    free = judged(emulator({"push": 4.0 * unit(0, 1)}, sensitivity=shift), shift)
    fixed = judged(emulator({"push": 4.0 * unit(0, 1)}), shift)
    assert free.nothing > 0.8
    assert fixed.nothing < 1e-3


def test_few_degrees_of_freedom_make_the_answer_less_sure():
    """On average over the noise of the data, which fills all dimensions."""
    noise = np.sqrt(5.0 / 24.0) * np.random.default_rng(0).standard_normal((50, SIZE))

    def nothing(freedom):
        taught = emulator({"push": 4.0 * unit(0)}, freedom=freedom)
        return np.mean([np.log(judged(taught, 1.6 * unit(0) + one).nothing) for one in noise])

    assert nothing(5) > nothing(10_000) + 0.5


def test_data_with_more_scatter_say_less():
    taught = emulator({"push": 4.0 * unit(0)})
    z = 1.8 * unit(0)
    calm, wild = (posterior(taught, Data(z, 6, scatter), temperature=1.0) for scatter in (1.0, 3.0))
    assert wild.nothing > calm.nothing + 0.1


def test_what_an_instrument_may_be_off_by_is_nobodys_effect():
    taught = emulator({"push": 4.0 * unit(0, 1)})
    z = 3.0 * unit(0)
    doubted = posterior(taught, Data(z, 6, 1.0, 3.0 * unit(0)[:, None]), temperature=1.0)
    assert doubted.nothing > 0.8
    assert judged(taught, z).nothing < 1e-3


def planar(shifts):
    """An effect with a direction: ``shifts`` along +x, +y, −x, −y."""
    names = ("+x", "+y", "-x", "-y")
    ways = tuple(
        Way("tilt", f"tilt {one}", (2.0, 0.0), math.inf, angle) for one, angle in zip(names, ANGLES, strict=True)
    )
    return emulator(dict(zip(names, shifts, strict=True)), variance=1.0, ways=ways)


@pytest.mark.parametrize("degrees", [0.0, 90.0, 45.0, 200.0, 300.0])
def test_an_effect_in_the_plane_is_found_in_every_direction(degrees):
    """What answers as cos φ, sin φ and 1 is interpolated exactly: a leaning pile that is also flatter."""
    x, y, even = 3.0 * unit(0), 3.0 * unit(7), 1.0 * unit(3)
    taught = planar([even + x, even + y, even - x, even - y])
    towards = math.radians(degrees)
    z = 0.7 * (even + math.cos(towards) * x + math.sin(towards) * y)
    found = judged(taught, z)
    assert found.effects["tilt"] > 0.95
    along_x, along_y = (one.value for one in found.fits["tilt"].amplitudes)
    assert math.hypot(along_x, along_y) == pytest.approx(1.4, rel=0.35)
    off = math.degrees(math.atan2(along_y, along_x)) - degrees
    assert abs((off + 180.0) % 360.0 - 180.0) < 12.0


def test_weights_in_the_plane_interpolate():
    for angle in ANGLES:
        weights = planar_weights(angle)
        assert [weights[one] for one in ANGLES] == pytest.approx([float(one == angle) for one in ANGLES], abs=1e-12)
    assert sum(planar_weights(0.3).values()) == pytest.approx(1.0)


def test_two_effects_at_once_are_told_where_none_alone_explains():
    taught = emulator({"push": 4.0 * unit(0, 8), "pull": 4.0 * unit(3), "turn": 4.0 * unit(5)}, variance=1.0)
    found = judged(taught, 3.0 * unit(0, 8) + 3.0 * unit(3), pairs=True)
    assert found.best[0] == "push+pull"
    assert found.best[1] > 0.9
    assert [one.effect for one in found.fits["push+pull"].amplitudes] == ["push", "pull"]
    # Where one is enough, another one that could be seen is not there.
    alone = judged(taught, 3.0 * unit(0, 8), pairs=True)
    assert alone.best[0] == "push"
    assert alone.best[1] > 0.9


def test_pairs_share_their_prior_and_single_effects_the_rest():
    """Three of each, at temperature one: odds are those of the priors times those of the evidence."""
    taught = emulator({"push": 4.0 * unit(0, 8), "pull": 4.0 * unit(3), "turn": 4.0 * unit(5)}, variance=1.0)
    found = judged(taught, 2.0 * unit(0, 8) + 1.5 * unit(3) + 0.5 * unit(5), pairs=True)
    assert len(found.effects) == 6
    priors = {name: PAIRS / 3 if "+" in name else (1.0 - NOTHING - OUTSIDE - PAIRS) / 3 for name in found.effects}
    weights = {name: prior * math.exp(found.fits[name].log_evidence) for name, prior in priors.items()}
    weights["base"] = NOTHING * math.exp(found.fits["base"].log_evidence)
    odds = {name: found.effects.get(name, found.nothing) / weight for name, weight in weights.items()}
    assert list(odds.values()) == pytest.approx([odds["base"]] * 7)


@pytest.mark.parametrize(("size", "weighed"), [(0.8, False), (1.5, True)])
def test_an_effect_that_nobody_could_see_is_no_second_one(size, weighed):
    """At 1.6 times its reference amplitude it shifts means of six pours by √6 · 1.6 · size: 3.1 or 5.9, least is 4."""
    taught = emulator({"push": 4.0 * unit(0, 8), "faint": size * unit(3)}, variance=1.0)
    found = judged(taught, 3.0 * unit(0, 8) + 0.5 * unit(3), pairs=True)
    assert ("push+faint" in found.effects) == weighed


def test_two_effects_are_weighed_where_the_best_one_does_not_fit():
    """Although it is far more probable than something outside."""
    taught = emulator({"push": 8.0 * unit(0), "pull": 4.0 * unit(3), "turn": 4.0 * unit(5)}, variance=1.0, freedom=2000)
    z = 8.0 * unit(0) + 3.0 * unit(3)
    alone = judged(taught, z)
    assert alone.outside < 0.01
    assert alone.fits["push"].p < FITS
    assert judged(taught, z, pairs=True).best[0] == "push+pull"


def test_an_amplitude_ends_where_the_literature_does():
    free = emulator({"push": 2.0 * unit(0)}, variance=1.0)
    held = emulator({"push": 2.0 * unit(0)}, variance=1.0, ways=(Way("push", "push", (0.1,), 1.0),))
    z = 3.0 * unit(0)
    (far,), (near,) = (judged(one, z).fits["push"].amplitudes for one in (free, held))
    assert far.value > 1.0
    assert near.high <= 0.1
    assert near.at_end


def test_a_lower_temperature_is_less_sure():
    taught = emulator({"push": 4.0 * unit(0)})
    z = 2.0 * unit(0)
    sure, tempered = (posterior(taught, Data(z, 6), temperature=one).effects["push"] for one in (1.0, 0.5))
    assert 0.5 < tempered < sure


def test_data_far_off_every_model_are_unlikely_under_all():
    taught = emulator({"push": 4.0 * unit(0)}, variance=0.1)
    assert judged(taught, 5.0 * unit(4)).fits["push"].p < 1e-3
    assert judged(taught, 2.0 * unit(0)).fits["push"].p > 0.05


def test_how_unlikely_data_are_counts_the_pours_of_both_conditions():
    variance = 1.0 / 6.0 + 1.0 / BASE
    expected = stats.f.sf(0.7**2 / variance, SIZE, 2 * 12)  # the covariance of each is known by 12
    assert judged(emulator({}, freedom=12), 0.7 * np.ones(SIZE)).fits["base"].p == pytest.approx(expected, rel=1e-6)


def base_of(taught):
    return taught.at(taught.row()[None])


def test_the_base_model_is_known_better_by_pours_of_effects_that_hardly_move_it():
    still, moving = (emulator({"a": np.zeros(SIZE), "b": np.zeros(SIZE)}, variance=one) for one in (1e-3, 1e6))
    assert base_of(moving)[1] == pytest.approx(1.0 / 24.0, rel=1e-3)
    assert base_of(still)[1] == pytest.approx(1.0 / 48.0, rel=0.05)


def lessons_of(sample, ways):
    """Pours of ``sample`` as lessons; ``ways``: number and amplitude of a kind."""
    parts = []
    for kind, blocks in sample.pours.items():
        n = len(blocks[0])
        theta = {"friction_0 -": -1.5, "friction_0 +": 1.5}.get(kind, 0.0)
        way, amplitude = ways.get(kind, (-1, 0.0))
        parts.append(Lessons(np.full((n, 1), theta), np.full(n, way), np.full(n, amplitude), np.arange(n), blocks))
    return joined(parts)


def test_the_emulator_is_taught_by_pours():
    sample = sample_of(np.random.default_rng(0), {"push": 4.0 * unit(2), "half": 2.0 * unit(2)}, slopes=[unit(5)])
    found = emulated(lessons_of(sample, {"push": (0, 1.0), "half": (0, 0.5)}), [Way("push", "push")])
    # Three groups, for pours with a parameter moved are the base model's, and one parameter.
    assert found.freedom == 2 * 96 + 4 * 96 - 3 - 1
    z = {kind: found.seen(sample.pours[kind]) for kind in ("base", "push", "half")}
    for kind, amplitude in (("push", 1.0), ("half", 0.5)):
        mean, variance = found.at(found.row({0: amplitude})[None])
        assert mean[0] == pytest.approx(z[kind], abs=0.4)
        assert (variance > 0.0).all()
    # Lengths do not depend on the axes; four deviations are drawn in a little, and so is what they are measured by.
    assert np.linalg.norm(z["push"] - z["base"]) == pytest.approx(4.0, rel=0.2)
    assert np.linalg.norm(found.slopes) == pytest.approx(1.0, rel=0.25)
    assert found.reached == (1.0,)
    # What z stands for is what was poured.
    for kind in ("base", "push"):
        poured = np.concatenate([block.mean(axis=0) for block in sample.pours[kind]])
        assert found.features(z[kind]) == pytest.approx(poured, abs=0.15)


def test_parameters_that_move_in_every_pour_cost_no_pours_of_their_own():
    """Half of the pours of every kind with the parameter up, half down: slope and signature come out apart."""
    rng = np.random.default_rng(1)
    theta = np.tile([[1.0], [-1.0]], (60, 1))
    way = np.repeat([-1, 0], 60)
    features = theta * unit(5) + np.where(way == 0, 1.0, 0.0)[:, None] * 4.0 * unit(2)
    features = features + rng.standard_normal((120, SIZE))
    blocks = tuple(np.split(features, 2, axis=1))
    taught = emulated(Lessons(theta, way, (way == 0).astype(float), np.arange(120), blocks), [Way("push", "push")])
    assert np.linalg.norm(taught.slopes) == pytest.approx(1.0, rel=0.35)
    shift = taught.at(taught.row({0: 1.0})[None])[0] - base_of(taught)[0]
    assert np.linalg.norm(shift) == pytest.approx(4.0, rel=0.2)


def test_a_parameter_that_answers_bent_is_followed_where_it_was_poured_and_is_no_effect():
    """z = θ u₅ + 0.5 (θ² − 1) u₃ and an effect along u₃: data at θ = 2 lack it, and look like it from θ = ±1."""
    rng = np.random.default_rng(3)

    def pours_at(theta):
        features = theta * unit(5) + 0.5 * (theta**2 - 1.0) * unit(3)
        return features + rng.standard_normal((len(theta), SIZE))

    near, far = np.tile([[1.0], [-1.0]], (60, 1)), np.full((24, 1), 2.5)
    push = np.repeat([False, True], 60)
    measured = pours_at(np.full((600, 1), 2.0))
    found = {}
    for name, more in (("near", near[:0]), ("far", far)):
        theta, way = np.concatenate([near, more]), np.concatenate([push - 1, np.full(len(more), -1)])
        features = pours_at(theta) + np.where(way == 0, 1.0, 0.0)[:, None] * 3.0 * unit(3)
        blocks = tuple(np.split(features, 2, axis=1))
        lessons = Lessons(theta, way, (way == 0).astype(float), np.arange(len(way)), blocks)
        taught = emulated(lessons, [Way("push", "push")])
        found[name] = judged(taught, taught.seen(np.split(measured, 2, axis=1)))
    assert found["near"].best[1] > 0.9
    assert found["far"].nothing > 0.5
    near, far = (found[name].fits["base"] for name in ("near", "far"))
    # θ ~ N(0, 1) and six pours leave it an error of 0.3.
    assert far.theta[0] == pytest.approx(2.0, abs=0.3)
    assert near.theta[0] < far.theta[0] - 0.2
    # The slope there is √(1 + (2 · 0.5 · 2)²) = 2.2 and the bend 0.5, which their prior draws towards 1 and 0.
    assert np.linalg.norm(taught.slopes) == pytest.approx(1.0, rel=0.1)
    assert 1.4 < np.linalg.norm(far.slopes) < 2.2
    assert 0.25 < np.linalg.norm(taught.bends) < 0.5


def test_pours_that_scatter_more_under_an_effect_are_known_to():
    """Three times the variance at the reference amplitude, twice at half of it: x = 2, less for the tails drawn in."""
    rng = np.random.default_rng(2)
    way, amplitude = np.repeat([-1, 0, 0, 1], 60), np.repeat([0.0, 1.0, 0.5, 1.0], 60)
    deviation = np.sqrt(np.where(way == 0, 1.0 + 2.0 * amplitude, 1.0))
    features = amplitude[:, None] * unit(2) + deviation[:, None] * rng.standard_normal((240, SIZE))
    blocks = tuple(np.split(features, 2, axis=1))
    lessons = Lessons(np.zeros((240, 1)), way, amplitude, np.arange(240), blocks)
    taught = emulated(lessons, [Way("push", "push"), Way("pull", "pull")])
    # Of a normal feature of variance v, in units of the mean variance over all groups.
    g = np.linspace(-8.0, 8.0, 4001)
    still, half, whole = (
        float((SQUASH * np.arcsinh(math.sqrt(v / 1.75) * g / SQUASH)) ** 2 @ stats.norm.pdf(g)) for v in (1.0, 2.0, 3.0)
    )
    expected = ((whole / still - 1.0) + 0.5 * (half / still - 1.0)) / 1.25
    # 60 pours of 12 features in each group: some 5 % of a variance.
    assert taught.excess == pytest.approx([expected, 0.0], abs=0.2)
    noise = taught.noise(np.stack([taught.row(), taught.row({0: 0.5}), taught.row({0: 9.0})]))
    assert noise == pytest.approx([1.0, 1.0 + 0.5 * taught.excess[0], 4.0])


def test_a_pour_looked_at_again_tells_nothing_more():
    """A copy has all of the pour's noise, of which the model lets 5 % be its own: (1 + 0.95)/2 of one variance."""
    sample = sample_of(np.random.default_rng(0), {"push": 4.0 * unit(2)})
    lessons = lessons_of(sample, {"push": (0, 1.0)})
    copies = lessons.where(lessons.way == 0)
    again = replace(joined([lessons, copies]), pour=np.concatenate([lessons.pour, copies.pour]))
    one, other = (emulated(some, [Way("push", "push")], shrunk=False) for some in (lessons, again))
    assert one.freedom == other.freedom
    u, seen_again = (taught.at(taught.row({0: 1.0})[None])[1].sum() for taught in (one, other))
    assert seen_again == pytest.approx(0.975 * u, rel=0.01)


def test_what_cannot_teach_is_refused():
    sample = sample_of(np.random.default_rng(0), {"push": unit(0)}, pours=1)
    with pytest.raises(StatisticsError, match="push: 1 pours"):
        emulated(lessons_of(sample, {"push": (0, 1.0)}), [Way("push", "push")])
    with pytest.raises(StatisticsError, match="pull: 0 pours"):
        emulated(lessons_of(sample, {}), [Way("pull", "pull")])


def test_a_correlation_of_many_pours_is_kept_and_one_of_few_shrunk():
    """λ* = Σ Var(r)/Σ r², Var(r) the variance of a product of two standardised features over n − 1, by hand."""
    rng = np.random.default_rng(3)
    mixed = rng.standard_normal((400, 2)) @ np.linalg.cholesky([[1.0, 0.6], [0.6, 1.0]]).T * [2.0, 0.1]
    for n, least in ((400, 0.95), (8, 0.0)):
        x = mixed[:n]
        deviation = np.sqrt((x**2).mean(axis=0))
        products = (x / deviation).prod(axis=1)
        r = products.mean()
        share = min(1.0, products.var() / (n - 1) / r**2)
        assert 1.0 - share >= least
        expected = np.array([[1.0, (1.0 - share) * r], [(1.0 - share) * r, 1.0]]) * np.outer(deviation, deviation)
        assert shrunk_covariance(x) == pytest.approx(expected)


def test_the_scatter_of_groups_of_two_is_that_of_one_pour():
    """Each mean takes a degree of freedom: 31 groups of two pours tell a deviation to 1/√62."""
    rng = np.random.default_rng(6)
    way = np.repeat(np.arange(-1, 30), 2)
    values = 3.0 * rng.standard_normal((62, 1)) + 10.0 * way[:, None]
    lessons = Lessons(np.zeros((62, 0)), way, (way >= 0).astype(float), np.arange(62), (values,))
    taught = emulated(lessons, [Way(f"{k}", f"{k}") for k in range(30)])
    pairs = values.reshape(31, 2)
    assert taught.squashes[0].deviation == pytest.approx([np.sqrt(pairs.var(axis=1, ddof=1).mean())])
    assert taught.squashes[0].deviation == pytest.approx([3.0], rel=0.35)
    assert taught.freedom == 31


def test_signatures_of_noise_alone_are_not_believed():
    rng = np.random.default_rng(0)
    noise = np.full(18, 0.2)
    nothing, _ = prior_along_axes(np.sqrt(0.2) * rng.standard_normal((18, 90)), noise, np.ones(90))
    assert nothing.max() < 0.1 * 0.2
    along = rng.standard_normal((18, 1)) * 5.0 * np.eye(90)[:1]
    values, axes = prior_along_axes(along + np.sqrt(0.2) * rng.standard_normal((18, 90)), noise, np.ones(90))
    assert values.max() == pytest.approx((along**2).sum() / 18, rel=0.3)
    assert abs(axes[0, values.argmax()]) > 0.95
    assert np.sort(values)[-2] < 0.1 * 0.2


def truths(kinds):
    return [PlantedTruth(kind, "weak", 4.9) for kind in kinds]


@pytest.mark.parametrize("teaching", [Teaching(8, 0), Teaching(4, 12)])
def test_a_cross_validation_names_what_is_far_apart_and_nothing_where_nothing_is(teaching):
    """Two effects of 4 pours' deviations at right angles; data have half of it, 2 √6 = 4.9 σ."""
    shifts = {"a strong": 4.0 * unit(0), "a weak": 2.0 * unit(0), "b strong": 4.0 * unit(7), "b weak": 2.0 * unit(7)}
    sample = sample_of(np.random.default_rng(1), shifts)
    kinds = [DataKind(name, name, False) for name in "ab"]
    (found,) = cross_validated("scan", sample, kinds, [truths(kinds)], teaching, 10, np.random.default_rng(0))
    assert (found.sets, found.nulls) == (20, 10 * NULLS)
    assert found.right == 1.0
    assert found.named == (1.0,) * len(RISKS)
    assert set(found.by_effect) == {"a", "b"}
    assert (found.pours > 0.0) == (teaching.more > 0)
    assert max(found.false) <= 2


def test_a_cross_validation_of_effects_that_are_alike_is_a_guess():
    shifts = {f"{name} {size}": length * unit(0) for name in "ab" for size, length in (("strong", 4.0), ("weak", 2.0))}
    sample = sample_of(np.random.default_rng(1), shifts)
    kinds = [DataKind(name, name, False) for name in "ab"]
    (found,) = cross_validated("scan", sample, kinds, [truths(kinds)], Teaching(8, 0), 40, np.random.default_rng(0))
    assert 0.2 < found.right < 0.8
    assert found.named[RISKS.index(0.01)] < 0.2


def test_a_feature_that_hardly_ever_varies_does_not_spoil_the_answer():
    """Constant in the pours that teach, unlike in some that are data: it is left out, and every answer is a number."""
    shifts = {"a strong": 4.0 * unit(0), "a weak": 2.0 * unit(0)}
    sample = sample_of(np.random.default_rng(1), shifts)
    for blocks in sample.pours.values():
        blocks[0][:, 3] = 0.0
    sample.pours["base"][0][::40, 3] = 1.0
    kinds = [DataKind("a", "a", False)]
    (found,) = cross_validated("scan", sample, kinds, [truths(kinds)], Teaching(8, 0), 20, np.random.default_rng(0))
    assert found.named == (1.0,) * len(RISKS)


def test_a_signature_that_is_only_noise_is_believed_to_be_small():
    rng = np.random.default_rng(4)
    variances, noise = np.geomspace(10.0, 0.1, 40), np.full((12, 40), 0.1)
    signatures = rng.normal(size=(12, 40)) * np.sqrt(variances + 0.1)
    signatures[0] = rng.normal(size=40) * np.sqrt(0.1)
    scales = relative_sizes(signatures, noise, variances)
    assert scales[0] <= 0.03
    # The scale of 40 normal numbers has a standard error of √(2/40) = 0.22.
    assert np.all((scales[1:] > 0.4) & (scales[1:] < 2.0))


def test_what_pours_could_gain_by_hand():
    """Δ = 3 in one feature of variance 2, 1 of which more pours take away: ½ 9/1 − ½ 9/2; 8 more by an instrument."""

    def fit(z, prior=1.0):
        none = np.zeros((2, 1))
        known, noise = (np.zeros(1), np.eye(1), np.zeros(1), prior * np.eye(1)), np.full(2, 2.0)
        return Fit("", (), *known, none, np.array(z), noise, np.zeros(2), np.array(z), np.ones(2), 0.0, 0.5)

    taught = SimpleNamespace(slopes=np.zeros((2, 1)))
    plain, blurred = (Data(np.zeros(2), 1.0, instrument=np.diag([size, 0.0])) for size in (0.0, math.sqrt(8.0)))
    assert gain_by_pours(fit([3.0, 1.0]), fit([0.0, 1.0]), taught, plain) == pytest.approx(2.25)
    assert gain_by_pours(fit([3.0, 1.0]), fit([0.0, 1.0]), taught, blurred) == pytest.approx(0.5 - 0.45)
    # What a parameter can do as well is nothing that they differ by.
    turned = SimpleNamespace(slopes=np.array([[1e3], [0.0]]))
    assert gain_by_pours(fit([3.0, 1.0]), fit([0.0, 1.0]), turned, plain) == pytest.approx(0.0, abs=1e-4)
    # Unless bodies have told the parameter.
    told = gain_by_pours(fit([3.0, 1.0], 1e-12), fit([0.0, 1.0], 1e-12), turned, plain)
    assert told == pytest.approx(2.25, abs=1e-3)
