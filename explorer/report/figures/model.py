"""The response surface of a result as a function, for charts: mean and 95 % interval anywhere in its region.

ŷ(x) = x'b,   ŷ ± t(0.975, df) sqrt(MSE x'(X'X)⁻¹x),   x the model terms of the coded point
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.surface import second_order_terms
from explorer.report.findings import Plain
from explorer.report.identified import BY_RULE, all_identified

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class FittedModel:
    """One target's model. Natural values in SI, response in the unit of the store; k factors, p terms."""

    coefficients: Array
    """Coded, shape (p,)."""
    information_inverse: Array
    """(X'X)⁻¹, shape (p, p)."""
    mse: float
    df: int
    centre: Array
    half_width: Array
    """Of the region, shape (k,)."""

    def coded(self, natural: Sequence[float] | Array) -> Array:
        """Natural → coded values, shape (..., k)."""
        return (np.asarray(natural, dtype=np.float64) - self.centre) / self.half_width

    def natural(self, coded: Array) -> Array:
        """Coded → natural values, shape (..., k)."""
        return self.centre + self.half_width * coded

    def mean(self, coded: Array) -> Array:
        """The model at coded points, shape (..., k) → (...)."""
        return np.asarray(second_order_terms(coded) @ self.coefficients)

    def half_interval(self, coded: Array) -> Array:
        """Half the 95 % interval of the mean at coded points, shape (..., k) → (...)."""
        x = second_order_terms(coded)
        variance = self.mse * np.einsum("...i,ij,...j->...", x, self.information_inverse, x)
        return np.asarray(stats.t.ppf(0.975, self.df) * np.sqrt(np.maximum(variance, 0.0)))


def model_of(result: Plain, index: int) -> FittedModel:
    """The model of target ``index``; the result must have got as far as its surface."""
    surface = result["surface"]
    model, region = surface["models"][index], surface["region"]
    return FittedModel(
        np.array(model["coefficients"], dtype=np.float64),
        np.array(model["information_inverse"], dtype=np.float64),
        float(model["mse"]),
        int(model["df_residual"]),
        np.array(region["centre"], dtype=np.float64),
        np.array(region["half_width"], dtype=np.float64),
    )


def chosen_point(result: Plain) -> list[float] | None:
    """The optimum in the order of the surface's factors (natural); None before there is one."""
    found = result.get("optimum")
    return None if not found else [found["values"][factor["path"]] for factor in result["surface"]["factors"]]


def reference_name(result: Plain) -> str:
    """What the reference values of the factors are called."""
    return str(result["study"].get("reference_name", "measured parameters"))


def chosen_name(result: Plain) -> str:
    """What the chosen point of a result that has one is called."""
    return "optimum" if all_identified(result["optimum"]) else BY_RULE


def section_point(result: Plain) -> list[float]:
    """Where sections through the surface are laid (natural): the optimum, or the middle of the region before it."""
    chosen = chosen_point(result)
    return list(result["surface"]["region"]["centre"]) if chosen is None else chosen
