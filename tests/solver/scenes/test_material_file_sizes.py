"""Measured diameters → spread of sizes: closed forms of the log-normal distribution, and what is refused."""

import math

import numpy as np
import pytest
from scipy.special import ndtri

from solver.params import ParameterError
from solver.scenes.material_file import SizeTable, measured_spread, quantile_spread
from solver.toml_file import checked


@pytest.mark.parametrize("t", [0.01, 0.1, 0.4])
def test_quantiles_of_a_log_normal_give_its_spread(t):
    percents = (5.0, 30.0, 50.0, 95.0)
    quantiles = {p: 1e-3 * math.exp(t * float(ndtri(p / 100))) for p in percents}
    # Standard deviation over mean of a log-normal distribution: sqrt(exp t² - 1).
    assert quantile_spread(quantiles) == pytest.approx(math.sqrt(math.exp(t**2) - 1.0), rel=1e-9)


def test_draws_have_that_spread():
    drawn = np.exp(0.15 * np.random.default_rng(0).normal(size=200_000))
    quantiles = dict(zip((5.0, 50.0, 95.0), np.quantile(drawn, [0.05, 0.5, 0.95]), strict=True))
    # Standard error of a 5 % quantile of 200 000 draws: 0.5 % of the deviation.
    assert quantile_spread(quantiles) == pytest.approx(drawn.std() / drawn.mean(), rel=0.01)


def test_mean_and_sd_come_before_quantiles():
    table = {"mean": "1.212mm", "sd": 0.139e-3, "quantiles": {"p05": 1.105e-3, "p95": 1.391e-3}}
    assert measured_spread(checked(SizeTable, table, "size"), "size") == pytest.approx(0.139 / 1.212, rel=1e-12)


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({}, "size: mean and sd, or at least two quantiles"),
        ({"quantiles": {"p50": 1e-3}}, "at least two quantiles"),
        ({"mean": 1e-3}, "size: mean and sd are needed together"),
        ({"mean": 1e-3, "sd": -1e-4}, "size.sd: -0.0001 m; allowed: more than 0 m"),
        ({"quantiles": {"q05": 1e-3, "p95": 2e-3}}, "size.quantiles.q05: not a quantile; allowed: p and a percentage"),
        ({"quantiles": {"p00": 1e-3, "p95": 2e-3}}, "size.quantiles.p00: not a quantile"),
        (
            {"quantiles": {"p05": 3e-3, "p50": 2.5e-3, "p95": 2e-3}},
            "size.quantiles: [0.003, 0.0025, 0.002] m; allowed: larger",
        ),
        ({"median": 1e-3}, "size.median: unknown key; allowed: mean, sd, quantiles"),
    ],
)
def test_what_is_refused(table, words):
    with pytest.raises(ParameterError) as error:
        measured_spread(checked(SizeTable, table, "size"), "size")
    assert words in str(error.value)
