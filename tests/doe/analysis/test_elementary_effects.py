"""Morris trajectories and elementary effects by closed forms: of a linear function, a product and a square."""

import numpy as np
import pytest
from scipy import stats
from statsmodels.stats.multitest import multipletests

from doe.analysis.elementary_effects import elementary_effects
from doe.designs import DESIGNS, DesignOptions, morris
from doe.designs.morris import LEVELS, STEP
from doe.errors import StatisticsError

NAMES = "ABCDE"
TRAJECTORIES = 12


@pytest.fixture(scope="module")
def design():
    return morris(5, TRAJECTORIES, seed=3)


def by_name(design, y):
    return {one.factor: one for one in elementary_effects(design, np.asarray(y)[:, None], NAMES).effects}


def test_a_trajectory_moves_every_factor_once_by_two_thirds_of_its_range(design):
    assert design.shape == (TRAJECTORIES * 6, 5)
    assert np.isin(design.round(9), np.linspace(-1, 1, LEVELS).round(9)).all()
    for path in design.reshape(TRAJECTORIES, 6, 5):
        moved = np.diff(path, axis=0)
        assert ((np.abs(moved) > 0).sum(axis=1) == 1).all()
        assert np.abs(moved).sum(axis=0) == pytest.approx(np.full(5, STEP))


def test_kept_trajectories_are_further_apart_than_drawn_ones():
    def spread(points):
        paths = points.reshape(-1, 6, 5)
        pairs = [(a, b) for k, a in enumerate(paths) for b in paths[:k]]
        return np.mean([np.linalg.norm(a[:, None] - b[None], axis=-1).sum() for a, b in pairs])

    kept = np.mean([spread(morris(5, 6, seed)) for seed in range(5)])
    drawn = np.mean(
        [spread(np.concatenate([morris(5, 2, 100 + 9 * seed + k)[:6] for k in range(6)])) for seed in range(5)]
    )
    assert kept > 1.02 * drawn


def test_of_a_linear_function_mu_star_is_the_coefficient_and_sigma_nothing(design):
    """On [0, 1]: y = Σ c_j u_j with u = (x + 1)/2, so every elementary effect of factor j is c_j."""
    c = np.array([4.0, -2.0, 1.0, 0.5, 0.0])
    found = by_name(design, 7 + (design + 1) / 2 @ c)
    for name, value in zip(NAMES, c, strict=True):
        one = found[name]
        assert (one.mu, one.mu_star, one.sigma) == (
            pytest.approx(value, abs=1e-12),
            pytest.approx(abs(value), abs=1e-12),
            0,
        )
    assert [found[name].p_holm < 0.05 for name in NAMES] == [True, True, True, True, False]


def test_of_a_product_the_effect_of_one_factor_is_the_level_of_the_other(design):
    """y = u_A u_B: e_A = u_B where A moves. Over the grid u_B is 0, 1/3, 2/3 or 1."""
    u = (design + 1) / 2
    found = by_name(design, u[:, 0] * u[:, 1])
    at = [path[int(np.abs(np.diff(path[:, 0])).argmax()), 1] for path in u.reshape(TRAJECTORIES, 6, 5)]
    assert found["A"].effects == pytest.approx(at)
    assert found["A"].mu == found["A"].mu_star == pytest.approx(np.mean(at))
    assert found["A"].sigma == pytest.approx(np.std(at, ddof=1))
    assert found["C"].mu_star == pytest.approx(0, abs=1e-12)


def test_a_square_about_the_middle_has_mu_star_but_no_mu(design):
    """y = x_A²: a step from -1 to 1/3 gives (1/9 - 1)/(2/3) = -4/3, from -1/3 to 1 gives +4/3, either way."""
    found = by_name(design, design[:, 0] ** 2)["A"]
    assert np.abs(found.effects) == pytest.approx(np.full(TRAJECTORIES, 4 / 3))
    assert found.mu_star == pytest.approx(4 / 3)
    assert abs(found.mu) < found.mu_star
    assert found.mu_star_half_width == 0
    assert found.p == pytest.approx(stats.ttest_1samp(found.effects, 0).pvalue)


def test_tests_and_intervals_are_those_of_other_programs(design):
    """Of mu by Student's t, all at once by Holm; of mu* about the sizes of the effects, signs left out."""
    u = (design + 1) / 2
    y = u @ [1.0, 0.4, 0.2, 0.0, 0.0] + u[:, 0] * u[:, 1] + np.random.default_rng(4).normal(0, 0.3, len(u))
    found = by_name(design, y)
    own = [found[name] for name in NAMES]
    assert [one.p for one in own] == pytest.approx([stats.ttest_1samp(one.effects, 0).pvalue for one in own])
    assert [one.p_holm for one in own] == pytest.approx(multipletests([one.p for one in own], method="holm")[1])
    for one in own:
        low, high = stats.ttest_1samp(np.abs(one.effects), 0).confidence_interval(0.95)
        assert (one.mu_star - one.mu_star_half_width, one.mu_star + one.mu_star_half_width) == pytest.approx(
            (low, high)
        )


def test_a_lost_run_takes_the_two_steps_beside_it(design):
    y = (design @ np.arange(5.0))[:, None] + np.array([0.5, -0.5])
    y[8] = np.nan  # in the second trajectory, after its second step
    found = elementary_effects(design, y, NAMES)
    assert (found.steps, found.lost) == (60, 2)
    assert sum(len(one.effects) for one in found.effects) == 58
    assert found.ranked[0].factor == "E"
    assert found.ranked[0].mu == pytest.approx(8)  # twice the coded coefficient


def test_a_design_without_steps_of_one_factor_is_refused_and_runs_come_in_whole_trajectories():
    with pytest.raises(StatisticsError, match="as in a Morris design"):
        elementary_effects(np.array([[-1.0, -1], [1, 1], [-1, -1]]), np.zeros((3, 1)), "AB")
    assert len(DESIGNS["morris"].points(5, DesignOptions()).coded) == 60
    assert len(DESIGNS["morris"].points(5, DesignOptions(runs=24)).coded) == 24
    with pytest.raises(StatisticsError, match=r"runs = 25: .* 6 runs; allowed: 24, 30, …"):
        DESIGNS["morris"].points(5, DesignOptions(runs=25))


def test_a_jump_to_the_next_trajectory_is_no_step():
    """Of one factor every jump moves it alone: ten trajectories of two runs have ten steps, and not nineteen."""
    design = morris(1, 10, seed=1)
    assert elementary_effects(design, design, "A").steps == 10


def test_factors_that_are_left_out_stay_in_every_step(design):
    y = (design @ np.array([1.0, 0.0, 100.0, 0.0, 0.0]))[:, None]
    whole = elementary_effects(design, y, NAMES)
    found = elementary_effects(design[:, :1], y, NAMES[:1], others=design[:, 1:])
    assert (found.steps, found.lost) == (TRAJECTORIES, 0)
    assert np.array_equal(found.effects[0].effects, whole.effects[0].effects)
    unknown = design[:, 1:].copy()
    unknown[np.flatnonzero(np.diff(design[:, 0]))[0]] = np.nan  # before a step of A: it may not be one of A alone
    assert elementary_effects(design[:, :1], y, NAMES[:1], others=unknown).steps == TRAJECTORIES - 1
