"""Measured diameters of a component → spread of its sizes.

size = { mean = 1.212e-3, sd = 0.139e-3 }                              spread = sd / mean
size = { quantiles = { p05 = 1.105e-3, p50 = 1.204e-3, p95 = … } }     spread = √(exp t² − 1)

t is the slope of ln(quantile) over the quantile's normal deviate, by least squares: exact for log-normal sizes. Where
both stand, mean and sd count. Only the *relative* spread is taken; the sizes lie about the declared dimensions.
Source: moments and quantiles of the log-normal distribution, Johnson, Kotz & Balakrishnan 1994, ch. 14.
"""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np

from solver.params import ParameterError, parse_quantity
from solver.toml_table import as_table, refuse_unknown

QUANTILE = re.compile(r"p(\d{1,2}(?:\.\d+)?)")


def measured_spread(table: dict[str, Any], where: str) -> float:
    """Standard deviation over mean of the linear size; ``where`` names the table in messages."""
    refuse_unknown(table, ("mean", "sd", "quantiles"), f"{where}.")
    if ("mean" in table) != ("sd" in table):
        raise ParameterError(f"{where}: mean and sd are needed together")
    quantiles = as_table(table.get("quantiles", {}), f"{where}.quantiles")
    numbers = {
        percent: _length(value, f"{where}.quantiles.p{percent}") for percent, value in _percents(quantiles, where)
    }
    if "mean" in table:
        return _length(table["sd"], f"{where}.sd") / _length(table["mean"], f"{where}.mean")
    if len(numbers) < 2:
        raise ParameterError(f"{where}: mean and sd, or at least two quantiles (p05, p50, p95), are needed")
    return quantile_spread(numbers)


def quantile_spread(quantiles: dict[float, float]) -> float:
    """Spread of the log-normal sizes with these quantiles: percent below → diameter [m]."""
    from scipy.special import ndtri  # here: few materials have measured sizes

    deviate = ndtri(np.array(list(quantiles)) / 100.0)
    log_size = np.log(np.array(list(quantiles.values())))
    offset = deviate - deviate.mean()
    t = float(offset @ log_size / (offset @ offset))
    return math.sqrt(math.expm1(t**2))


def _percents(quantiles: dict[str, Any], where: str) -> list[tuple[float, Any]]:
    found = []
    for name, value in quantiles.items():
        match = QUANTILE.fullmatch(name)
        percent = float(match[1]) if match else 0.0
        if not 0.0 < percent < 100.0:
            raise ParameterError(f"{where}.quantiles.{name}: not a quantile; allowed: p01 … p99")
        found.append((percent, value))
    return found


def _length(value: Any, where: str) -> float:
    number = parse_quantity(value, "m", where)
    if number <= 0.0:
        raise ParameterError(f"{where}: {number:g} m; allowed: more than 0 m")
    return number
