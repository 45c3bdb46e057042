"""The Gaussian process against refits without each run, another derivation of its prediction, and known functions."""

import numpy as np
import pytest

from doe.analysis.gaussian_process import LENGTHS, NOISE, correlations, fit_process, process_target
from doe.analysis.gaussian_process import _deviance as deviance
from doe.analysis.optimum import ResponseTarget
from doe.designs import latin_hypercube
from doe.errors import StatisticsError
from tests.doe.analysis.textbook import region

REGION = region("AB", np.array([50.0, 5.0]), np.array([10.0, 1.0]))


def wavy(points):
    return 3 + np.sin(2.5 * points[:, 0]) + 0.5 * points[:, 1] ** 2


def runs(noise, n=25, replicates=1, seed=1):
    points = latin_hypercube(2, n, seed)
    random = np.random.default_rng(seed)
    return points, wavy(points)[:, None] + noise * random.standard_normal((n, replicates))


def kriged(points, y, at, found):
    """Mean and variance at one point by the full covariance of the runs and of the flat mean, as a linear system."""
    n = len(y)
    k = found.signal**2 * correlations(points, points, found.lengths) + found.noise**2 * np.eye(n)
    k0 = found.signal**2 * correlations(points, at[None], found.lengths)[:, 0]
    system = np.block([[k, np.ones((n, 1))], [np.ones((1, n)), np.zeros((1, 1))]])
    weights = np.linalg.solve(system, np.append(k0, 1.0))
    return weights[:n] @ y, found.signal**2 - weights @ np.append(k0, 1.0)


def test_left_out_runs_are_those_of_refits_without_them():
    """The kriging system solved again without each run: 25 systems for one closed form."""
    points, y = runs(0.1)
    found = fit_process(points, y, REGION)
    for k in range(len(points)):
        kept = np.arange(len(points)) != k
        mean, variance = kriged(points[kept], y[kept, 0], points[k], found)
        assert found.left_out[k] == pytest.approx(y[k, 0] - mean, rel=1e-6, abs=1e-9)
        assert found.left_out_sd[k] == pytest.approx(np.sqrt(variance + found.noise**2), rel=1e-6)
    assert found.press == pytest.approx((found.left_out**2).sum())


def test_signal_and_mean_are_those_of_generalised_least_squares():
    """(y − m)' R⁻¹ (y − m)/(n − 1) about the m that makes it least, with the correlations that were found."""
    points, y = runs(0.1)
    found = fit_process(points, y, REGION)
    r = correlations(points, points, found.lengths) + (found.noise / found.signal) ** 2 * np.eye(25)
    ones, values = np.ones(25), y[:, 0]
    mean = ones @ np.linalg.solve(r, values) / (ones @ np.linalg.solve(r, ones))
    assert found.mean == pytest.approx(mean)
    assert found.signal**2 == pytest.approx((values - mean) @ np.linalg.solve(r, values - mean) / 24)


def test_left_out_rows_are_those_of_refits_without_their_replicates():
    points, y = runs(0.3, n=12, replicates=3)
    found = fit_process(points, y, REGION)
    squares = 0.0
    for k in range(12):
        kept = found.row_of_run != k
        mean, _ = kriged(found.points[kept], found.observed[kept], points[k], found)
        squares += float(((y[k] - mean) ** 2).sum())
    assert found.press_by_row == pytest.approx(squares, rel=1e-6)
    assert found.press_by_row > found.press  # replicates give their row away
    total = ((y - y.mean()) ** 2).sum()
    assert found.r_squared_predicted == pytest.approx(1 - found.press / total)
    assert found.r_squared_predicted_by_row == pytest.approx(1 - squares / total)


def test_prediction_and_its_error_are_those_of_the_kriging_system():
    points, y = runs(0.1)
    found = fit_process(points, y, REGION)
    for at in np.array([(0.3, -0.7), (0, 0), (1, 1)]):
        mean, variance = kriged(points, y[:, 0], at, found)
        assert float(found.predict(at)) == pytest.approx(mean, rel=1e-8)
        assert float(found.standard_error(at)) == pytest.approx(np.sqrt(variance), rel=1e-5)


def test_slopes_of_the_likelihood_are_those_of_differences_and_vanish_at_the_fit():
    points, y = runs(0.1)
    standard = (y[:, 0] - y.mean()) / y.std()
    at = np.log([0.7, 1.3, 0.02])
    _, slopes = deviance(at, points, standard)
    for k, step in enumerate(1e-5 * np.eye(3)):
        difference = deviance(at + step, points, standard)[0] - deviance(at - step, points, standard)[0]
        assert slopes[k] == pytest.approx(difference / 2e-5, rel=1e-5)
    found = fit_process(points, y, REGION)
    best = np.log([*found.lengths, (found.noise / found.signal) ** 2])
    ends = np.log([LENGTHS, LENGTHS, NOISE])
    assert ((best > ends[:, 0] + 1e-3) & (best < ends[:, 1] - 1e-3)).all()
    assert np.abs(deviance(best, points, standard)[1]).max() < 0.01


def test_a_smooth_function_without_noise_is_found_between_its_runs():
    points, y = runs(0.0, n=40)
    found = fit_process(points, y, REGION)
    grid = np.random.default_rng(5).uniform(-0.9, 0.9, (200, 2))
    assert np.abs(found.predict(grid) - wavy(grid)).max() < 0.01
    assert np.abs(found.predict(points) - y[:, 0]).max() < 1e-3
    assert found.r_squared_predicted > 0.9999


def test_noise_alone_is_not_predicted():
    points = latin_hypercube(2, 30, 2)
    found = fit_process(points, np.random.default_rng(4).standard_normal((30, 1)), REGION)
    assert found.r_squared_predicted < 0.2


def test_a_factor_that_does_nothing_has_a_long_length():
    points = latin_hypercube(3, 40, 3)
    found = fit_process(points, np.sin(3 * points[:, [0]]) + points[:, [1]], region("ABC"))
    assert found.lengths[2] > 20
    assert found.lengths[0] < 2


def test_the_setting_for_a_target_is_where_the_function_gives_it_nearest_the_reference():
    """wavy = 3.5 along B = 0: sin(2.5 A) = 0.5, A = π/15, of all settings with this value nearest the middle."""
    points, y = runs(0.0, n=40)
    found = fit_process(points, y, REGION)
    answer = process_target(found, ResponseTarget(3.5, 0.0, np.array([50.0, 5.0])))
    a = np.linspace(0, 1, 20001)
    b2 = np.maximum(0, 2 * (0.5 - np.sin(2.5 * a)))
    possible = b2 <= 1
    distance = np.sqrt((a**2 + b2)[possible & (np.sin(2.5 * a) <= 0.5 + 1e-4)].min())
    coded = (answer.point - REGION.centre) / REGION.half_width
    assert answer.reached
    assert np.linalg.norm(coded) == pytest.approx(distance, abs=0.01)
    assert answer.predicted == pytest.approx(3.5, abs=1e-4)
    out = process_target(found, ResponseTarget(9.0, 0.0, np.array([50.0, 5.0])))
    assert not out.reached
    assert out.reachable_high == pytest.approx(4.5, abs=0.03)  # sin = 1 at A = π/5, B = ±1
    assert out.reachable_low == pytest.approx(2.0, abs=0.03)  # sin = −1 at A = −π/5, B = 0
    assert out.point[0] == pytest.approx(50 + 10 * np.pi / 5, abs=0.3)
    assert np.isnan(out.compatible_low).all()


@pytest.mark.parametrize("error", [0.0, 0.3])
def test_what_is_compatible_with_a_target_is_what_lies_within_1_96_standard_errors(error):
    """Of 10 000 places drawn evenly; both shares are known to half a hundredth."""
    found = fit_process(*runs(0.2), REGION)
    answer = process_target(found, ResponseTarget(3.5, error, np.array([50.0, 5.0])))
    places = np.random.default_rng(7).uniform(-1, 1, (10_000, 2))
    margin = 1.96 * np.sqrt(found.standard_error(places) ** 2 + error**2)
    near = places[np.abs(found.predict(places) - 3.5) <= margin]
    assert answer.compatible_share == pytest.approx(len(near) / 10_000, abs=0.02)
    assert (answer.compatible_low - REGION.centre) / REGION.half_width == pytest.approx(near.min(axis=0), abs=0.05)
    assert (answer.compatible_high - REGION.centre) / REGION.half_width == pytest.approx(near.max(axis=0), abs=0.05)
    half = 1.96 * found.standard_error((answer.point - REGION.centre) / REGION.half_width)
    assert answer.predicted_high - answer.predicted == pytest.approx(half, rel=1e-4)
    assert answer.predicted - answer.predicted_low == pytest.approx(half, rel=1e-4)
    assert answer.reachable_low < found.predict(places).min() + 1e-6


def test_scales_of_response_and_region_change_nothing_but_units():
    points, y = runs(0.1)
    one, other = fit_process(points, y, REGION), fit_process(points, 1e6 * y - 7e6, REGION)
    assert other.lengths == pytest.approx(one.lengths, rel=1e-3)
    assert other.noise == pytest.approx(1e6 * one.noise, rel=1e-3)
    assert other.r_squared_predicted == pytest.approx(one.r_squared_predicted, rel=1e-5)


def test_what_a_process_cannot_follow_is_refused():
    with pytest.raises(StatisticsError, match="the same in every run"):
        fit_process(latin_hypercube(2, 9, 1), np.full((9, 1), 0.1), REGION)
    with pytest.raises(StatisticsError, match="4 valid runs; allowed for a Gaussian process: 5 to 500"):
        fit_process(latin_hypercube(2, 4, 1), np.arange(4.0)[:, None], REGION)
