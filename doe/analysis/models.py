"""The polynomials that the runs of a design support: linear, with interactions of two factors, or full second order.

The fit summary is sequential: SS of an order is the reduction of the residual of the order before, tested against its
own residual. Source: Myers, Montgomery and Anderson-Cook 2016, Response Surface Methodology, ch. 2.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.analysis.replicates import valid_runs
from doe.analysis.steepest_ascent import Region
from doe.analysis.surface import (
    Blocks,
    Surface,
    block_columns,
    fit_surface,
    included_terms,
    second_order_terms,
    used_blocks,
)
from doe.analysis.surface_anova import analyse_surface
from doe.errors import StatisticsError
from doe.record import Record

FloatArray = npt.NDArray[np.float64]
Order = Literal["linear", "interactions", "quadratic"]
ORDERS: tuple[Order, ...] = get_args(Order)
Reduction = Literal["aicc", "p"]
STAYS = 0.05
"""A term with a larger p is dropped under the rule "p"."""


@dataclass(frozen=True)
class OrderFit(Record):
    """One order of polynomial on these runs. f, p: test of what it adds to the order before; NaN if it is not tested.

    estimable: False if the runs cannot separate its terms or leave no error; the numbers are then NaN.
    sigma: residual standard deviation, unit of the response. lack_of_fit_p: NaN without replicates.
    """

    order: Order
    terms: int
    estimable: bool
    df_residual: int
    f: float
    p: float
    sigma: float
    r_squared: float
    r_squared_adjusted: float
    r_squared_predicted: float
    lack_of_fit_p: float


def terms_of(names: Sequence[str], order: Order) -> tuple[str, ...]:
    """Return the terms of an order without the intercept: "A", "A*B", "A^2"."""
    linear = tuple(names)
    if order == "linear":
        return linear
    products = tuple(f"{a}*{b}" for a, b in combinations(names, 2))
    squares = tuple(f"{name}^2" for name in names) if order == "quadratic" else ()
    return (*linear, *products, *squares)


def hierarchical(names: Sequence[str], terms: Sequence[str]) -> tuple[str, ...]:
    """Return `terms` together with the linear terms of their products and squares, in the order of the model.

    Without these, the meaning of a product or square would change with the origin of the coding (Nelder 1977).
    """
    wanted = set(terms)
    for term in terms:
        wanted |= set(term.removesuffix("^2").split("*"))
    included = included_terms(names, sorted(wanted))
    every = ("intercept", *terms_of(names, "quadratic"))
    return tuple(term for term, is_in in zip(every, included, strict=True) if is_in and term != "intercept")


@dataclass(frozen=True)
class ReducedModel(Record):
    """Terms that a backward elimination kept, and those that it dropped, in order. criterion: AICc of the final model,
    NaN under the rule "p".
    """

    rule: Reduction
    terms: tuple[str, ...]
    dropped: tuple[str, ...]
    criterion: float


def reduced_model(
    coded: FloatArray,
    responses: FloatArray,
    region: Region,
    terms: Sequence[str],
    rule: Reduction,
    blocks: Blocks | None = None,
) -> ReducedModel:
    """Drop terms one by one; a factor stays while a product or square of it is in the model.

    Under "aicc" the term is dropped whose removal makes AICc = n ln(SSE/n) + 2 q + 2 q (q + 1)/(n - q - 1) least, as
    long as AICc falls; q counts the coefficients, those of blocks, and sigma (Hurvich and Tsai 1989, Biometrika
    76:297). Under "p" the term with the largest p is dropped, as long as that is above 0.05. Raises StatisticsError
    where the runs do not support `terms`.
    """

    def residual(kept: Sequence[str]) -> tuple[float, int]:
        return _residual(fit_surface(coded, responses, region, kept, blocks))

    return eliminate(terms, rule, residual, int((~np.isnan(responses)).sum()))


def eliminate(
    terms: Sequence[str], rule: Reduction, residual: Callable[[Sequence[str]], tuple[float, int]], runs: int
) -> ReducedModel:
    """Drop terms one by one from any linear model, as in `reduced_model`; a term may have several columns.

    residual: function of the terms of a model that returns its residual sum of squares and degrees of freedom. runs:
    number of valid runs.
    """
    left, dropped = list(terms), []
    fitted = residual(left)
    while len(left) > 1:
        free = [term for term in left if not any(term != other and term in _parts(other) for other in left)]
        without = {term: residual([one for one in left if one != term]) for term in free}
        if rule == "aicc":
            chosen = min(free, key=lambda term: corrected_aic(*without[term], runs))
            if not corrected_aic(*without[chosen], runs) < corrected_aic(*fitted, runs):
                break
        else:
            p = {term: _added(without[term], fitted)[1] for term in free}
            chosen = max(free, key=lambda term: p[term])
            if not p[chosen] > STAYS:
                break
        left.remove(chosen)
        dropped.append(chosen)
        fitted = without[chosen]
    return ReducedModel(rule, tuple(left), tuple(dropped), corrected_aic(*fitted, runs) if rule == "aicc" else math.nan)


def corrected_aic(squares: float, df: int, n: int) -> float:
    """Return AICc of n runs from the residual sum of squares and its df; infinite if there are too few runs."""
    q = n - df + 1
    if n - q - 1 < 1:
        return math.inf
    return n * math.log(max(squares, np.finfo(np.float64).tiny) / n) + 2 * q + 2 * q * (q + 1) / (n - q - 1)


def _parts(term: str) -> tuple[str, ...]:
    """The linear terms contained in a product or a square; none for a linear term."""
    return tuple(term.removesuffix("^2").split("*")) if term.endswith("^2") or "*" in term else ()


def _residual(surface: Surface) -> tuple[float, int]:
    return surface.mse * surface.df_residual, surface.df_residual


def fit_summary(
    coded: FloatArray, responses: FloatArray, region: Region, blocks: Blocks | None = None
) -> tuple[OrderFit, ...]:
    """Return the fits of the three orders to the valid runs; shapes as in `doe.analysis.surface.fit_surface`."""
    found: list[OrderFit] = []
    before = _means_only(responses, blocks)
    for order in ORDERS:
        terms = terms_of(region.names, order)
        if not bearable(coded, responses, region.names, terms, blocks):
            nothing = (math.nan,) * 7
            found.append(OrderFit(order, len(terms), False, 0, *nothing))
            continue
        surface = fit_surface(coded, responses, region, terms, blocks)
        anova = analyse_surface(surface)
        residual = anova.row("residual")
        f, p = _added(before, (residual.sum_of_squares, residual.df))
        lack = next((row.p for row in anova.rows if row.source == "lack_of_fit"), math.nan)
        found.append(
            OrderFit(
                order=order,
                terms=len(terms),
                estimable=True,
                df_residual=residual.df,
                f=f,
                p=p,
                sigma=anova.sigma,
                r_squared=anova.r_squared,
                r_squared_adjusted=anova.r_squared_adjusted,
                r_squared_predicted=anova.r_squared_predicted,
                lack_of_fit_p=lack,
            )
        )
        before = (residual.sum_of_squares, residual.df)
    return tuple(found)


def bearable(
    coded: FloatArray,
    responses: FloatArray,
    names: Sequence[str],
    terms: Sequence[str],
    blocks: Blocks | None = None,
) -> bool:
    """Return whether the valid runs can separate `terms` and the blocks, and leave an error."""
    values, row, _ = valid_runs(responses, len(coded))
    model = second_order_terms(coded[row])[:, included_terms(names, terms)]
    if blocks is not None:
        block_names, block = used_blocks(blocks, values)
        model = np.column_stack([model, block_columns(block, len(block_names))])
    return bool(len(row) > model.shape[1] and np.linalg.matrix_rank(model) == model.shape[1])


def highest_order(
    coded: FloatArray,
    responses: FloatArray,
    names: Sequence[str],
    least_df: int = 3,
    blocks: Blocks | None = None,
) -> Order:
    """Return the highest order that the runs support with at least `least_df` degrees of freedom for the error.

    If there is none, the highest that they support at all. Raises StatisticsError if not even the linear one is.
    """
    runs = int((~np.isnan(responses)).sum())
    able = [order for order in ORDERS if bearable(coded, responses, names, terms_of(names, order), blocks)]
    spent = 1 if blocks is None else len(used_blocks(blocks, responses)[0])
    if not able:
        raise StatisticsError(
            f"responses: {runs} valid runs are too few for a linear model of {len(names)} factors and an error; "
            f"at least {len(names) + 2} runs at different settings are needed"
            + ("" if blocks is None else ", and one more for every block after the first")
        )
    roomy = [order for order in able if runs - spent - len(terms_of(names, order)) >= least_df]
    return (roomy or able)[-1]


def _means_only(responses: FloatArray, blocks: Blocks | None) -> tuple[float, int]:
    """Return sum of squares about the mean, or the means of the blocks, and its degrees of freedom."""
    values = responses[~np.isnan(responses)]
    names, block = (("",), np.zeros(values.size, dtype=np.int64)) if blocks is None else used_blocks(blocks, responses)
    means = np.bincount(block, weights=values) / np.bincount(block)
    return float(((values - means[block]) ** 2).sum()), values.size - len(names)


def _added(before: tuple[float, int], after: tuple[float, int]) -> tuple[float, float]:
    """Return F and p of the terms between two nested fits, each as (residual sum of squares, df)."""
    df = before[1] - after[1]
    if df < 1 or not after[0] > 0:
        return math.nan, math.nan
    f = max(0.0, before[0] - after[0]) / df / (after[0] / after[1])
    return f, float(stats.f.sf(f, df, after[1]))
