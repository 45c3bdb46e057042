"""Summaries with heavy tails: found by the base model's runs, drawn in on both sides by one function, and put back."""

from dataclasses import replace

import numpy as np
import pytest

from doe.diagnose.decision.tables import as_read
from doe.diagnose.decision.verdict import Residual
from doe.diagnose.emulation.emulator import fit_emulator
from doe.diagnose.emulation.tails import draw_in, heavy_tails
from doe.diagnose.runs import BASE, Condition, Declared, Observed, Parameter, Runs

DECLARED = Declared((Parameter("a", -1.0, 1.0),), (), (Condition("pour", ("angle", "time")),))
N, HANGS = 120, 8.0


def made(seed, hanging=0.0, pours=N):
    """A straight line in both summaries with unit noise; a share ``hanging`` of the times is 8 to 16 too late."""
    generator = np.random.default_rng(seed)
    theta = generator.uniform(-1, 1, (pours, 1))
    block = 2.0 * theta + generator.standard_normal((pours, 2))
    block[:, 1] += (generator.uniform(size=pours) < hanging) * generator.uniform(HANGS, 2 * HANGS, pours)
    return Runs(theta, np.full(pours, BASE), np.zeros((pours, 2)), (block,))


def observed(block):
    return Observed((block,), (np.array([0.0, 0.1]),))


def test_gaussian_noise_is_left_as_it_is():
    """One test in a hundred may see a tail that is none: two expected of 200, more than 7 have a chance of 0.1 %."""
    seen = sum(
        bool(np.isfinite(heavy_tails(DECLARED, r, observed(r.blocks[0])).scale[0]).any()) for r in map(made, range(200))
    )
    assert seen <= 7


def test_the_hanging_pours_are_found_by_the_runs_and_never_by_the_data():
    runs = made(1, hanging=0.1)
    found = heavy_tails(DECLARED, runs, observed(made(2).blocks[0]))
    assert found.labels(DECLARED) == ("pour: time",)
    assert np.isinf(heavy_tails(DECLARED, made(1), observed(runs.blocks[0])).scale[0]).all()
    # Published means are no single readings.
    means = Observed((runs.blocks[0],), (np.zeros(2),), (5,))
    assert np.isinf(heavy_tails(DECLARED, runs, means).scale[0]).all()


def test_the_function_is_its_argument_near_the_centre_and_goes_back():
    runs = made(1, hanging=0.1)
    tails = heavy_tails(DECLARED, runs, observed(runs.blocks[0]))
    centre, scale = tails.centre[0][1], tails.scale[0][1]
    # The hanging pours move the robust scale of unit noise, times 2, by their share only.
    assert 1.5 < scale < 3.0
    values = np.array([[5.0, centre + 0.1 * scale], [5.0, centre + 10.0 * scale], [np.nan, np.nan]])
    drawn = draw_in(values, tails.centre[0], tails.scale[0])
    assert drawn[:2, 0] == pytest.approx(5.0)
    assert drawn[0, 1] - centre == pytest.approx(0.1 * scale, rel=2e-3)  # (0.1)²/6
    assert drawn[1, 1] - centre == pytest.approx(np.arcsinh(10.0) * scale)
    assert np.isnan(drawn[2]).all()
    rows = tuple(Residual("x", float(one[0]), 5.0, 5.0, 0.0, 0.0) for one in drawn[:2, :1])
    rows = (rows[0], replace(rows[0], measured=float(drawn[1, 1]), before=float(drawn[0, 1]), after=float(drawn[1, 1])))
    back = as_read(rows, tails)
    assert (back[0].measured, back[0].before) == (5.0, 5.0)
    assert back[1].measured == pytest.approx(values[1, 1])
    assert back[1].before == pytest.approx(values[0, 1])


def test_an_instrument_s_error_shrinks_by_the_slope():
    runs = made(1, hanging=0.1)
    tails = heavy_tails(DECLARED, runs, observed(runs.blocks[0]))
    far = np.full((3, 2), tails.centre[0][1] + 3.0 * tails.scale[0][1])
    error = 1e-4
    drawn = tails.of_observed(Observed((far,), (np.full(2, error),)))
    above, below = (draw_in(far + d, tails.centre[0], tails.scale[0])[0, 1] for d in (error, -error))
    assert drawn.instrument[0] == pytest.approx([error, (above - below) / 2], rel=1e-6)


def test_the_line_is_known_better_where_one_pour_in_ten_hangs():
    """Root mean square error of the emulated time at the middle over 40 sets of runs, against that without."""
    squares = {"as it is": [], "drawn in": []}
    for seed in range(40):
        runs = made(seed, hanging=0.1)
        tails = heavy_tails(DECLARED, runs, observed(runs.blocks[0]))
        expected = draw_in(made(1000, 0.1, 20_000).blocks[0], tails.centre[0], tails.scale[0])[:, 1].mean()
        for name, one in (("as it is", runs), ("drawn in", tails.of_runs(runs))):
            truth = made(1000, 0.1, 20_000).blocks[0][:, 1].mean() if name == "as it is" else expected
            emulator = fit_emulator(DECLARED, one, (np.zeros(2),))
            noise = float(np.sqrt(emulator.blocks[0].noise.covariance[1, 1]))
            squares[name].append((float(emulator.predictor(()).mean(np.zeros(1))[1]) - truth, noise))
    wrong = {name: np.sqrt(np.mean([e**2 for e, _ in found])) for name, found in squares.items()}
    noise = {name: np.mean([n for _, n in found]) for name, found in squares.items()}
    # 10 % of hangs of 12 ± 2.3 make a pour's standard deviation 3.8 instead of 1; drawn in they reach 5: 1.8.
    assert noise["drawn in"] < 0.6 * noise["as it is"]
    assert wrong["drawn in"] < 0.7 * wrong["as it is"]
