"""The joint posterior of several targets, against the closed form of linear models and against plain Monte Carlo."""

import dataclasses
import itertools

import numpy as np
import pytest
from scipy import stats

from doe.analysis.joint_posterior import CELLS, KEPT, joint_posterior
from doe.analysis.steepest_ascent import Region
from doe.analysis.surface import fit_surface
from doe.target import Target

SLOPES = {
    1: [[3.0]],
    2: [[3.0, 1.0], [1.0, -4.0]],
    3: [[3.0, 1.0, 0.0], [1.0, -4.0, 0.5], [0.0, 0.0, 2.0]],
    4: [[3.0, 1.0, 0.0, 0.0], [1.0, -4.0, 0.5, 0.0], [0.0, 0.0, 2.0, 1.0], [0.0, 1.0, 0.0, 3.0]],
}
CENTRES = (20.0, 50.0, 7.0, 100.0)


def region(k):
    half_width = np.array([2.0, 1.0, 0.5, 10.0])[:k]
    return Region(tuple("abcd"[:k]), np.array([10.0, 5.0, 1.0, 40.0])[:k], half_width, ())


def design(k):
    return np.array(list(itertools.product((-1.0, 0.0, 1.0), repeat=k)))


def linear(k, noise=0.0, seed=1):
    """A model c + a·x per row of ``SLOPES``, fitted to what it gives with ``noise``."""
    points, rng = design(k), np.random.default_rng(seed)
    values = [CENTRES[t] + points @ np.array(slope) for t, slope in enumerate(SLOPES[k])]
    return [fit_surface(points, v[:, None] + noise * rng.normal(size=(len(points), 3)), region(k)) for v in values]


def targets(k, inside, errors):
    """Targets that the coded point ``inside`` gives, with these standard errors (of nine measurements)."""
    means = np.array(CENTRES[:k]) + np.array(SLOPES[k]) @ np.array(inside)
    return [
        Target(f"y{t}", float(mean), 3.0 * error, 9) for t, (mean, error) in enumerate(zip(means, errors, strict=True))
    ]


@pytest.mark.parametrize("k", [1, 2, 3, 4])
def test_linear_models_give_the_normal_distribution_of_their_solution(k):
    """x = A⁻¹(T − c), covariance A⁻¹ S A⁻ᵀ."""
    inside, errors = np.array([0.2, -0.1, 0.3, 0.1])[:k], np.array([0.2, 0.2, 0.15, 0.3])[:k]
    found = joint_posterior(linear(k), targets(k, inside, errors))
    inverse = np.linalg.inv(np.array(SLOPES[k]))
    covariance = inverse @ np.diag(errors**2) @ inverse.T
    sd = np.sqrt(np.diag(covariance))
    half_width = region(k).half_width
    # The grid: a cell of the second pass is half a standard deviation at most (four factors), a cell widens it by 1/12.
    assert found.mean == pytest.approx(region(k).natural(inside), abs=0.01 * float(half_width.min()))
    assert found.sd == pytest.approx(sd * half_width, rel=0.03 if k < 4 else 0.05)
    assert found.correlation == pytest.approx(covariance / np.outer(sd, sd), abs=0.03)
    z = stats.norm.ppf(0.975)
    for end, sign in ((found.low, -1.0), (found.high, 1.0)):
        assert end == pytest.approx(
            region(k).natural(inside + sign * z * sd), abs=0.05 * float((sd * half_width).max())
        )
    assert found.share == pytest.approx(z * sd, rel=0.05)
    assert found.identified == tuple((z * sd < 0.5).tolist())
    assert found.misfit == pytest.approx(0.0, abs=1e-6)
    assert found.p == pytest.approx(1.0)
    means = [target.mean for target in targets(k, inside, errors)]
    assert found.predicted == pytest.approx(means, abs=0.02)
    assert found.predicted_sd == pytest.approx(errors, rel=0.05)


def test_densities_are_probabilities_in_equal_cells():
    found = joint_posterior(linear(3), targets(3, [0.2, -0.1, 0.3], [0.2, 0.2, 0.15]))
    assert found.density.shape == (3, KEPT)
    assert found.pair_density.shape == (3, KEPT, KEPT)
    assert found.density.sum(axis=1) == pytest.approx(1.0)
    for (i, j), pair in zip(itertools.combinations(range(3), 2), found.pair_density, strict=True):
        assert pair.sum(axis=1) == pytest.approx(found.density[i], abs=1e-12)
        assert pair.sum(axis=0) == pytest.approx(found.density[j], abs=1e-12)


def test_one_target_of_two_factors_leaves_the_direction_along_its_line_open():
    """What lies across a·x = T − c is normal with sd s/|a|; along it the density is the length of the line: flat."""
    models, goals = linear(2), targets(2, [0.0, 0.0], [0.1, 0.1])
    found = joint_posterior(models[:1], goals[:1])
    # 3 a + b = 0: over all of b, a runs from −1/3 to 1/3.
    assert found.share[1] == pytest.approx(0.95, abs=0.01)
    assert found.share[0] == pytest.approx(0.95 / 3.0, abs=0.02)
    assert found.identified == (True, False)
    both = joint_posterior(models, goals)
    assert both.identified == (True, True)
    assert (both.share < 0.1).all()


def test_brute_force_monte_carlo_gives_the_same_of_curved_models_with_errors():
    """Points drawn evenly over the cube, weighted by the likelihood; nothing of the code under test but the models."""
    k, rng = 3, np.random.default_rng(5)
    points = design(k)
    values = [
        20.0 + points @ [3.0, 1.0, 0.5] + 1.5 * points[:, 0] * points[:, 1],
        50.0 + points @ [1.0, -4.0, 1.0] - 2.0 * points[:, 1] ** 2,
    ]
    models = [fit_surface(points, v[:, None] + 0.8 * rng.normal(size=(27, 2)), region(k)) for v in values]
    goals = [Target("y0", 21.0, 1.2, 9), Target("y1", 49.0, 1.8, 9)]
    found = joint_posterior(models, goals)

    x = rng.uniform(-1.0, 1.0, (400_000, k))
    log = np.zeros(len(x))
    for model, goal in zip(models, goals, strict=True):
        s = np.sqrt(goal.sd**2 / goal.n + model.standard_error(x) ** 2)
        log += -0.5 * ((model.predict(x) - goal.mean) / s) ** 2 - np.log(s)
    weight = np.exp(log - log.max())
    weight /= weight.sum()
    mean = weight @ x
    sd = np.sqrt(weight @ (x - mean) ** 2)
    # Monte Carlo error of the mean: sd/√(effective number), a few thousandths.
    assert region(k).coded(found.mean) == pytest.approx(mean, abs=0.01)
    assert found.sd / region(k).half_width == pytest.approx(sd, rel=0.02)
    for j in range(k):
        order = np.argsort(x[:, j])
        ends = np.interp([0.025, 0.975], np.cumsum(weight[order]), x[order, j])
        assert [region(k).coded(end)[j] for end in (found.low, found.high)] == pytest.approx(ends, abs=0.02)


def test_a_model_that_knows_one_end_better_is_integrated_with_its_error():
    """One factor, by sums over 20 001 places: N(T; ŷ, s²) with s three times as large at one end as at the other."""
    points = np.repeat([[-1.0], [-0.9], [-0.8], [1.0]], 3, axis=0)
    values = 20.0 + points[:, 0] + 2.0 * np.random.default_rng(3).standard_normal(12)
    model, goal = fit_surface(points, values[:, None], region(1), ["a"]), Target("y0", 21.0, 0.6, 9)
    found = joint_posterior([model], [goal])
    x = np.linspace(-1.0, 1.0, 20_001)[:, None]
    ends = model.standard_error(np.array([[-1.0], [1.0]]))
    assert ends[1] / ends[0] > 1.3
    s2 = goal.standard_error**2 + model.standard_error(x) ** 2
    weight = np.exp(-0.5 * (model.predict(x) - goal.mean) ** 2 / s2) / np.sqrt(s2)
    weight /= weight.sum()
    mean = weight @ x[:, 0]
    # Cells of 1/200: 1e-5 of the region in the mean, as much in the rest.
    assert region(1).coded(found.mean) == pytest.approx(mean, abs=2e-4)
    assert found.sd / 2.0 == pytest.approx(np.sqrt(weight @ (x[:, 0] - mean) ** 2), rel=1e-3)
    y = weight @ model.predict(x)
    variance = weight @ ((model.predict(x) - y) ** 2 + model.standard_error(x) ** 2)
    assert (found.predicted, found.predicted_sd) == (
        pytest.approx(y, abs=1e-3),
        pytest.approx(np.sqrt(variance), rel=1e-3),
    )
    # Nothing of the region is ruled out.
    assert (found.axis_low, found.axis_high) == (pytest.approx([8.0]), pytest.approx([12.0]))


def test_targets_that_no_setting_gives_have_a_small_chance():
    model = linear(2)[0]
    one, other = Target("y0", 21.0, 0.6, 9), Target("y1", 22.0, 0.6, 9)
    found = joint_posterior([model, model], [one, other])
    # The best lies halfway, each target 0.5/0.2 standard errors off.
    assert found.misfit == pytest.approx(2 * 2.5**2)
    assert found.p == pytest.approx(stats.chi2.sf(12.5, 2))
    assert found.p < 0.01
    far = joint_posterior([model, model], [one, dataclasses.replace(other, mean=500.0)])
    assert far.p < 1e-12
    assert np.isfinite(far.density).all()


def test_a_target_without_an_error_is_hit_by_a_thin_sheet():
    model = linear(1)[0]
    found = joint_posterior([model], [Target("y0", 20.9)])
    assert found.mean == pytest.approx(region(1).natural([0.3]), abs=2e-3)
    assert 0.0 < found.share[0] < 0.01
    assert found.p > 0.5


def test_targets_without_errors_of_three_factors_leave_what_their_sheets_leave():
    """Exact models: 3a + b = 0.5 and a − 4b + c/2 = 0 cross in a line, on which b = 0.5 − 3a and c = 4 − 26a."""
    models, goals = linear(3), targets(3, [0.15, 0.05, 0.1], [0.0, 0.0, 0.0])
    goals = [Target(goal.observable, goal.mean) for goal in goals]
    two = joint_posterior(models[:2], goals[:2])
    # Over all of c, −1 … 1, a runs from 3/26 to 5/26 and b from 4/26 to −2/26; 95 % of each in equal tails.
    assert two.share == pytest.approx([0.95 / 26, 0.95 * 3 / 26, 0.95], rel=0.06)
    assert two.p > 0.9
    three = joint_posterior(models, goals)
    assert region(3).coded(three.mean) == pytest.approx([0.15, 0.05, 0.1], abs=1e-2)
    assert (three.share < 0.03).all()
    assert three.p > 0.9


def test_more_factors_than_the_grid_is_for_are_left_out():
    k = max(CELLS) + 1
    points = np.array(list(itertools.product((-1.0, 0.0, 1.0), repeat=k)))
    box = Region(tuple("abcde"), np.zeros(k), np.ones(k), ())
    model = fit_surface(points, np.ones((len(points), 1)) + points[:, :1], box)
    assert joint_posterior([model], [Target("y", 1.0, 0.1, 9)]) is None
