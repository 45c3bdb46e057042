"""What a design can see before it is run: the smallest effect per kind of term, at a given scatter of one run.

Notation as in `doe.power`. The change of the response is counted from low to high for a factor and for an interaction
(2 b), from the centre to the ends for a square (b). SE = sigma sqrt([(X'X)^-1]_jj), times two for 2 b.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.errors import StatisticsError
from doe.power import smallest_effect, t_test_power
from doe.record import Record
from doe.surface import included_terms, second_order_terms, term_names

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class TermPrecision(Record):
    """Worst term of a kind ("factor", "interaction", "square"); unit of sigma.

    smallest: change that is seen with chance `power_wanted` at p < alpha; all: the same for all terms at once
    (Bonferroni). power: chance to see `effect`; NaN without one. NaN where no degree of freedom is left for the error.
    """

    kind: str
    terms: int
    standard_error: float
    df: int
    smallest: float
    smallest_of_all: float
    effect: float
    power: float


def precision(
    coded: FloatArray,
    names: Sequence[str],
    terms: Sequence[str],
    sigma: float,
    effect: float = math.nan,
    alpha: float = 0.05,
) -> tuple[TermPrecision, ...]:
    """Return what runs at `coded`, shape (runs, factors), tell about each kind of the model's terms.

    terms: as of `doe.surface.term_names`. sigma: standard deviation of one run, unit of the response.
    Raises StatisticsError for a sigma or an effect that is not positive, or terms that the runs cannot separate.
    """
    for name, value in (("sigma", sigma), ("effect", effect)):
        if not (value > 0 or (name == "effect" and math.isnan(value))) or math.isinf(value):
            raise StatisticsError(f"{name} = {value:g} must be a positive number")
    included = included_terms(names, terms)
    model = second_order_terms(coded)[:, included]
    if np.linalg.matrix_rank(model) < model.shape[1]:
        raise StatisticsError(f"the {len(coded)} runs cannot separate the {model.shape[1]} terms of the model")
    errors = sigma * np.sqrt(np.diag(np.linalg.inv(model.T @ model)))
    df = model.shape[0] - model.shape[1]
    kinds = [_kind(term) for term, is_in in zip(term_names(names), included, strict=True) if is_in]
    found = []
    for kind in ("factor", "interaction", "square"):
        of_kind = [error for error, own in zip(errors, kinds, strict=True) if own == kind]
        if not of_kind:
            continue
        error = float(max(of_kind)) * (1.0 if kind == "square" else 2.0)
        known = df >= 1 and math.isfinite(effect)
        found.append(
            TermPrecision(
                kind=kind,
                terms=len(of_kind),
                standard_error=error,
                df=df,
                smallest=smallest_effect(error, df, alpha),
                smallest_of_all=smallest_effect(error, df, alpha / (len(kinds) - 1)),
                effect=effect,
                power=t_test_power(effect, error, df, alpha) if known else math.nan,
            )
        )
    return tuple(found)


def _kind(term: str) -> str:
    if term == "intercept":
        return term
    return "square" if term.endswith("^2") else "interaction" if "*" in term else "factor"
