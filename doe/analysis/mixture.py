"""Scheffé polynomials of a mixture: y = sum b_i z_i + sum b_ij z_i z_j + sum b_ijk z_i z_j z_k + e, by least squares.

z_i is the share of part i in the amount above the lows (`doe.designs.mixture`, pseudocomponents). The shares add up to
1, so there is no intercept and no square: b_i is the response where part i takes all of that amount, and b_ij > 0 means
that two parts together give more than their mean. Source: Scheffé 1958, J. Roy. Stat. Soc. B 20:344; Cornell 2002,
Experiments with Mixtures, ch. 2.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Literal, get_args

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.analysis.replicates import valid_runs
from doe.analysis.surface import least_squares
from doe.analysis.surface_anova import FULL, AnovaRow, total_sum_of_squares
from doe.designs.mixture import simplex_lattice
from doe.errors import StatisticsError
from doe.record import Record

FloatArray = npt.NDArray[np.float64]
MixtureOrder = Literal["linear", "quadratic", "special cubic"]
MIXTURE_ORDERS: tuple[MixtureOrder, ...] = get_args(MixtureOrder)
LEAST_DF = 3
"""Degrees of freedom for the error, where no order is asked for."""
SLACK = 1e-9
"""Tolerance of a high, in shares."""
STEPS = (1000, 100, 40, 20, 10, 8, 6, 5, 4, 3, 2)
MOST_LOOKED_AT = 13_000
"""The highest and the lowest blend are searched for in the smallest steps that give no more blends than this."""


@dataclass(frozen=True)
class Blend(Record):
    """A blend of the parts, in their unit, with the response of the model and the standard error of its mean."""

    amounts: FloatArray
    predicted: float
    standard_error: float


@dataclass(frozen=True)
class MixtureFit(Record):
    """A fitted polynomial. terms: "A", "A*B", "A*B*C" with coefficients, their standard errors and p (of the test that
    a product is zero; NaN for single parts, where that test has no meaning).

    rows: sequential analysis of variance by order, about the mean. highest, lowest: located to within step of a share.
    """

    order: MixtureOrder
    terms: tuple[str, ...]
    coefficients: FloatArray
    standard_errors: FloatArray
    p: FloatArray
    rows: tuple[AnovaRow, ...]
    sigma: float
    r_squared: float
    r_squared_adjusted: float
    r_squared_predicted: float
    highest: Blend
    lowest: Blend
    step: float
    observed: FloatArray
    predicted: FloatArray

    @property
    def shares_explained(self) -> tuple[float, float, float]:
        """R², adjusted, predicted."""
        return self.r_squared, self.r_squared_adjusted, self.r_squared_predicted


def mixture_terms(names: Sequence[str], order: MixtureOrder) -> tuple[tuple[int, ...], ...]:
    """Return the parts of each term: single ones, pairs, triples."""
    sizes = range(1, MIXTURE_ORDERS.index(order) + 2)
    return tuple(group for size in sizes for group in combinations(range(len(names)), size))


def mixture_matrix(shares: FloatArray, terms: Sequence[tuple[int, ...]]) -> FloatArray:
    """Return the model matrix of shares, (n, parts) -> (n, terms)."""
    return np.stack([shares[:, list(term)].prod(axis=1) for term in terms], axis=1)


def bearable_order(shares: FloatArray, names: Sequence[str]) -> MixtureOrder | None:
    """Return the highest order that runs at shares support with 3 degrees of freedom for the error, else with one; None
    if they support none.
    """
    able: dict[MixtureOrder, int] = {}
    for order in MIXTURE_ORDERS[: len(names)]:  # two parts have no term of three
        model = mixture_matrix(shares, mixture_terms(names, order))
        if len(model) > model.shape[1] and np.linalg.matrix_rank(model) == model.shape[1]:
            able[order] = len(model) - model.shape[1]
    roomy = [order for order, df in able.items() if df >= LEAST_DF]
    return [None, *able, *roomy][-1]


def fit_mixture(
    amounts: FloatArray,
    responses: FloatArray,
    lows: FloatArray,
    names: Sequence[str],
    order: MixtureOrder | None = None,
    highs: FloatArray | None = None,
) -> MixtureFit:
    """Fit the polynomial of the given order, or of the highest that the runs support, to every valid run.

    amounts: shape (rows, parts), with the same sum in every row. responses: (rows, replicates), NaN where a run is
    missing. lows: least amount of each part; highs: its greatest amount in the blends searched.
    Raises StatisticsError where the runs do not support the polynomial.
    """
    _, row, observed = valid_runs(responses, len(amounts))
    room = float(amounts.sum(axis=1).mean() - lows.sum())
    if room <= 0:
        raise StatisticsError(
            f"the parts add up to {amounts.sum(axis=1).mean():g} and their lows to {lows.sum():g}: no range is left"
        )
    shares = (amounts[row] - lows) / room
    chosen = bearable_order(shares, names) if order is None else order
    terms = mixture_terms(names, chosen or "linear")
    model = mixture_matrix(shares, terms)
    df = len(observed) - model.shape[1]
    if chosen is None or df < 1 or np.linalg.matrix_rank(model) < model.shape[1]:
        raise StatisticsError(
            f"responses: {len(observed)} valid runs are too few for the {len(terms)} terms of the {chosen or 'linear'} "
            "mixture polynomial and an error"
        )
    found = least_squares(model, observed)
    # The shares add up to one: the constant subtracted from every response is returned to the single parts.
    single = np.array([len(term) == 1 for term in terms])
    coefficients = found.params + single * observed[0]
    predicted = model @ coefficients
    total = total_sum_of_squares(observed)
    residual = _squares(observed - predicted, total)
    leverage = found.get_influence().hat_matrix_diag
    alone = bool((leverage > FULL).any())  # a run that is fitted exactly predicts nothing
    press = math.nan if alone else _squares((observed - predicted) / (1 - leverage), total)
    mean_square = residual / df
    errors = np.sqrt(mean_square * np.diag(found.normalized_cov_params))
    with np.errstate(divide="ignore", invalid="ignore"):
        p = np.where(single | (total == 0), math.nan, 2 * stats.t.sf(np.abs(coefficients / errors), df))
    rows = _rows(shares, observed, names, chosen, total, residual, df)
    step = next(one for one in STEPS if math.comb(len(names) + one - 1, one) <= MOST_LOOKED_AT)
    grid = _within(simplex_lattice(len(names), step), shares, lows, highs, room)
    surface = mixture_matrix(grid, terms)
    on_grid = surface @ coefficients

    def blend(at: int) -> Blend:
        variance = float(surface[at] @ found.normalized_cov_params @ surface[at])
        return Blend(lows + room * grid[at], float(on_grid[at]), math.sqrt(mean_square * variance))

    letters = tuple("*".join(names[k] for k in term) for term in terms)
    return MixtureFit(
        order=chosen,
        terms=letters,
        coefficients=coefficients,
        standard_errors=errors,
        p=p,
        rows=rows,
        sigma=math.sqrt(mean_square),
        r_squared=1 - residual / total if total else math.nan,
        r_squared_adjusted=1 - mean_square / (total / (len(observed) - 1)) if total else math.nan,
        r_squared_predicted=1 - press / total if total else math.nan,
        highest=blend(int(np.argmax(on_grid))),
        lowest=blend(int(np.argmin(on_grid))),
        step=1 / step,
        observed=observed,
        predicted=predicted,
    )


def _squares(differences: FloatArray, total: float) -> float:
    """Return the sum of squares of differences; zero if the total is zero, since then only rounding is left."""
    return float((differences**2).sum()) if total else 0.0


def _within(
    lattice: FloatArray, run: FloatArray, lows: FloatArray, highs: FloatArray | None, room: float
) -> FloatArray:
    """Return the blends of a lattice that respect the highs; if there are none, the blends that were run."""
    if highs is None:
        return lattice
    kept = lattice[(lows + room * lattice <= highs + SLACK * room).all(axis=1)]
    return kept if len(kept) else np.unique(run, axis=0)


def _rows(
    shares: FloatArray,
    observed: FloatArray,
    names: Sequence[str],
    order: MixtureOrder,
    total: float,
    residual: float,
    df: int,
) -> tuple[AnovaRow, ...]:
    """One row per order: the reduction of the residual of the order before."""

    def row(source: str, squares: float, own: int, against: tuple[float, int] | None) -> AnovaRow:
        mean = squares / own if own else math.nan
        if against is None or not own or not against[0] > 0:
            return AnovaRow(source, squares, own, mean, math.nan, math.nan)
        f = mean / (against[0] / against[1])
        return AnovaRow(source, squares, own, mean, f, float(stats.f.sf(f, own, against[1])))

    error = (residual, df)
    n = len(observed)
    found = [row("model", total - residual, n - 1 - df, error)]
    before, taken = total, 1
    for one in MIXTURE_ORDERS[: MIXTURE_ORDERS.index(order) + 1]:
        model = mixture_matrix(shares, mixture_terms(names, one))
        fitted = model @ np.linalg.lstsq(model, observed, rcond=None)[0]
        after = _squares(observed - fitted, total)
        found.append(row(one, before - after, model.shape[1] - taken, error))
        before, taken = after, model.shape[1]
    found.append(row("residual", residual, df, None))
    _, point = np.unique(shares.round(9), axis=0, return_inverse=True)
    point = point.reshape(-1)
    means = np.bincount(point, weights=observed) / np.bincount(point)
    pure, pure_df = _squares(observed - means[point], total), n - len(means)
    if pure_df and df > pure_df:
        found.append(row("lack_of_fit", residual - pure, df - pure_df, (pure, pure_df)))
        found.append(row("pure_error", pure, pure_df, None))
    return (*found, row("total", total, n - 1, None))
