"""Second-order response surface: y = b0 + sum b_i x_i + sum b_ij x_i x_j + sum b_ii x_i^2 + e, by least
squares.

Factors are coded, x = (value - centre)/half_width, so that the region is the cube [-1, 1]^k. Term order:
intercept, linear, products (i < j), squares. p = number of these terms, n = number of valid runs. A model with fewer
terms keeps this layout, with zeros for the terms it omits. Runs made in blocks (days, batches, operators) add a fixed
effect per block; the effects sum to zero over the blocks, so that the intercept and the predictions refer to the mean
of all blocks. Source: Box and Wilson 1951; Myers, Montgomery and Anderson-Cook 2016, Response Surface Methodology,
ch. 6 and 7.6 (blocks).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.analysis.replicates import valid_runs
from doe.analysis.steepest_ascent import Region
from doe.errors import StatisticsError
from doe.record import Record

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Surface(Record):
    """A fitted second-order model with the runs behind it.

    coefficients: coded, shape (p,), unit of the response. coefficients_natural: the same polynomial in
    natural units. included: which terms are in the model, shape (p,); the others have coefficient and variance zero.
    information_inverse: (X'X)^-1, shape (p, p). mse: residual mean square with df_residual
    degrees of freedom. Per run, shape (n,): points (n, k) coded, row_of_run (row of the design), point_of_run
    (index of the distinct point, within its block), observed, predicted (in its block), leverage. block_names: empty
    if there are no blocks; block_effects: that of each block [unit of the response], block_of_run per run.
    """

    region: Region
    terms: tuple[str, ...]
    included: BoolArray
    coefficients: FloatArray
    coefficients_natural: FloatArray
    information_inverse: FloatArray
    mse: float
    df_residual: int
    points: FloatArray
    row_of_run: IntArray
    point_of_run: IntArray
    observed: FloatArray
    predicted: FloatArray
    leverage: FloatArray
    missing_runs: int
    block_names: tuple[str, ...] = ()
    block_effects: FloatArray = field(default_factory=lambda: np.zeros(0))
    block_of_run: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))

    @property
    def model_matrix(self) -> FloatArray:
        """Return the columns that were fitted, shape (n, terms + blocks - 1): the terms first."""
        terms = second_order_terms(self.points)[:, self.included]
        if not self.block_names:
            return terms
        return np.column_stack([terms, block_columns(self.block_of_run, len(self.block_names))])

    @property
    def names(self) -> tuple[str, ...]:
        """Return the factor names."""
        return self.region.names

    def predict(self, coded: npt.ArrayLike) -> FloatArray:
        """Return the model at coded points, shape (..., k) -> (...)."""
        return second_order_terms(np.asarray(coded, dtype=np.float64)) @ self.coefficients

    def standard_error(self, coded: npt.ArrayLike) -> FloatArray:
        """Return the standard error sqrt(MSE x'(X'X)^-1 x) of the predicted mean, (..., k) -> (...)."""
        x = second_order_terms(np.asarray(coded, dtype=np.float64))
        return np.asarray(np.sqrt(self.mse * np.einsum("...i,ij,...j->...", x, self.information_inverse, x)))

    def half_width(self, coded: npt.ArrayLike, level: float = 0.95) -> FloatArray:
        """Return half the interval for the mean response at coded points, (..., k) -> (...)."""
        return np.asarray(stats.t.ppf((1 + level) / 2, self.df_residual) * self.standard_error(coded))

    def prediction_half_width(self, coded: npt.ArrayLike, level: float = 0.95) -> FloatArray:
        """Return half the interval for one further run at coded points, (..., k) -> (...): t s sqrt(1 + h)."""
        error = np.sqrt(self.mse + self.standard_error(coded) ** 2)
        return np.asarray(stats.t.ppf((1 + level) / 2, self.df_residual) * error)

    def tolerance_half_width(self, coded: npt.ArrayLike, share: float = 0.95, level: float = 0.95) -> FloatArray:
        """Return half the interval that holds a `share` of all further runs at coded points, with confidence `level`.

        z s sqrt((1 + h) df/chi2), with chi2 the 1 - level quantile for df degrees of freedom, and h the leverage of the
        point, whose inverse acts as the number of runs (Howe 1969, J. Am. Stat. Assoc. 64:610; Wallis 1951).
        """
        error = np.sqrt(self.mse + self.standard_error(coded) ** 2)
        spread = np.sqrt(self.df_residual / stats.chi2.ppf(1 - level, self.df_residual))
        return np.asarray(stats.norm.ppf((1 + share) / 2) * spread * error)

    def confidence_interval(self, coded: npt.ArrayLike, level: float = 0.95) -> tuple[FloatArray, FloatArray]:
        """Return low and high of the interval for the mean response at coded points."""
        half = self.half_width(coded, level)
        return self.predict(coded) - half, self.predict(coded) + half


@dataclass(frozen=True)
class Blocks:
    """The block of every run. of_run: shape of the responses, indices into `names`."""

    names: tuple[str, ...]
    of_run: IntArray


def fit_surface(
    coded: npt.ArrayLike,
    responses: npt.ArrayLike,
    region: Region,
    terms: Sequence[str] | None = None,
    blocks: Blocks | None = None,
) -> Surface:
    """Fit the second-order model, or only the terms named, to every valid run.

    coded: design points, shape (points, k); rows may repeat. responses: shape (points, replicates), NaN where
    a run is missing. region: names and natural scale of the k factors. terms: names as in `term_names`, all if None;
    the intercept is always included. blocks: each has a fixed effect.

    Raises StatisticsError for an unknown term, when shapes disagree, the points left cannot separate the terms, or no
    degree of freedom is left for the error.
    """
    design = np.asarray(coded, dtype=np.float64)
    if design.ndim != 2 or design.shape[1] != len(region.names):
        raise StatisticsError(f"coded has shape {design.shape}; allowed is (points, {len(region.names)})")
    values, row, observed = valid_runs(responses, len(design))
    points = design[row]
    included = included_terms(region.names, terms)
    names, block = ((), np.zeros(observed.size, dtype=np.int64)) if blocks is None else used_blocks(blocks, values)
    model = np.column_stack([second_order_terms(points)[:, included], block_columns(block, len(names))])
    size, columns = int(included.sum()), model.shape[1]
    distinct, point_of_run = np.unique(np.column_stack([points, block]), axis=0, return_inverse=True)
    if np.linalg.matrix_rank(model) < columns:
        order = "second-order model" if terms is None else "model"
        beside = f" and the {len(names)} blocks" if names else ""
        raise StatisticsError(
            f"responses: the {len(distinct)} distinct points with a valid run cannot separate the "
            f"{size} terms of the {order}{beside}"
        )
    df = observed.size - columns
    if df < 1:
        raise StatisticsError(f"responses: {observed.size} valid runs leave no error; {columns + 1} are needed")
    found = least_squares(model, observed)
    predicted = model @ found.params + observed[0]
    coefficients, padded = np.zeros(included.size), np.zeros((included.size, included.size))
    coefficients[included] = found.params[:size]
    padded[np.ix_(included, included)] = found.normalized_cov_params[:size, :size]
    coefficients[0] += observed[0]
    effects = found.params[size:]
    return Surface(
        region=region,
        terms=term_names(region.names),
        included=included,
        coefficients=coefficients,
        coefficients_natural=natural_coefficients(coefficients, region),
        information_inverse=padded,
        mse=float(found.mse_resid),
        df_residual=df,
        points=points,
        row_of_run=row,
        point_of_run=point_of_run.reshape(-1).astype(np.int64),
        observed=observed,
        predicted=predicted,
        leverage=found.get_influence().hat_matrix_diag,
        missing_runs=int(values.size - observed.size),
        block_names=names,
        block_effects=np.append(effects, -effects.sum()) if names else np.zeros(0),
        block_of_run=block if names else np.zeros(0, dtype=np.int64),
    )


def used_blocks(blocks: Blocks, values: FloatArray) -> tuple[tuple[str, ...], IntArray]:
    """Return the names of the blocks that have a valid run, and each valid run's number among them.

    Raises StatisticsError if there is only one, which is no blocking.
    """
    found, number = np.unique(blocks.of_run[~np.isnan(values)], return_inverse=True)
    names = tuple(blocks.names[k] for k in found)
    if len(names) < 2:
        raise StatisticsError(f"blocks: every valid run is in block {names[0]!r}; at least two blocks are needed")
    return names, number.reshape(-1).astype(np.int64)


def block_columns(block: IntArray, number: int) -> FloatArray:
    """Return the columns of blocks 0 … number - 2 in sum-to-zero coding, shape (n, number - 1): 1 in the block,
    -1 in the last one; none for fewer than two blocks.
    """
    if number < 2:
        return np.zeros((block.size, 0))
    columns = (block[:, None] == np.arange(number - 1)).astype(np.float64)
    columns[block == number - 1] = -1.0
    return columns


def included_terms(names: Sequence[str], terms: Sequence[str] | None) -> BoolArray:
    """Return which of the second-order terms of `names` are among `terms`, shape (p,); all of them for None.

    Raises StatisticsError for a term that the model does not have.
    """
    known = term_names(names)
    if terms is None:
        return np.ones(len(known), dtype=np.bool_)
    for term in terms:
        if term not in known:
            raise StatisticsError(f"terms: '{term}' is not a term of the model; allowed: {', '.join(known[1:])}")
    return np.array([k == 0 or term in terms for k, term in enumerate(known)])


def with_intercept(levels: FloatArray) -> FloatArray:
    """Return the model matrix of main effects (rows, 1 + columns): a column of ones, then the levels."""
    return np.column_stack([np.ones(levels.shape[0]), levels])


def least_squares(model: FloatArray, observed: FloatArray, weights: FloatArray | None = None) -> Any:
    """Return statsmodels' results of (weighted) least squares on a model matrix, (n, p) with ones first, and n values.

    The first observation is subtracted beforehand, so that a constant response gives exact zeros.
    """
    # Imported here because statsmodels takes a second to load, and the page does not need it.
    from statsmodels.regression.linear_model import OLS, WLS

    shifted = observed - observed[0]
    return (OLS(shifted, model) if weights is None else WLS(shifted, model, weights)).fit(method="qr")


def fitted_coefficients(model: FloatArray, observed: FloatArray) -> FloatArray:
    """Return least-squares coefficients of many responses at once; observed of shape (n, sets) gives (p, sets).

    The first observation is subtracted beforehand and added back to the intercept (the first term), so that a
    constant response gives exact zeros elsewhere.
    """
    origin = observed[0]
    coefficients = np.linalg.lstsq(model, observed - origin, rcond=None)[0]
    coefficients[0] += origin
    return np.asarray(coefficients)


def second_order_terms(coded: FloatArray) -> FloatArray:
    """Return the model terms of coded points, shape (..., k) -> (..., 1 + k + k(k-1)/2 + k)."""
    k = coded.shape[-1]
    products = [coded[..., i] * coded[..., j] for i, j in combinations(range(k), 2)]
    linear = [coded[..., i] for i in range(k)]
    squares = [coded[..., i] ** 2 for i in range(k)]
    return np.stack([np.ones(coded.shape[:-1]), *linear, *products, *squares], axis=-1)


def term_names(names: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the terms in model order: "intercept", "A", "A*B", "A^2"."""
    products = (f"{a}*{b}" for a, b in combinations(names, 2))
    return ("intercept", *names, *products, *(f"{name}^2" for name in names))


def quadratic_form(coefficients: FloatArray, k: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return b0, b and B of y = b0 + b'x + x'Bx from coefficients of shape (..., p): (...), (..., k), (...,
    k, k).
    """
    matrix = np.zeros((*coefficients.shape[:-1], k, k))
    for position, (i, j) in enumerate(combinations(range(k), 2)):
        matrix[..., i, j] = matrix[..., j, i] = coefficients[..., 1 + k + position] / 2
    squares = coefficients.shape[-1] - k
    for i in range(k):
        matrix[..., i, i] = coefficients[..., squares + i]
    return coefficients[..., 0], coefficients[..., 1 : 1 + k], matrix


def natural_coefficients(coefficients: FloatArray, region: Region) -> FloatArray:
    """Return the coefficients of the same polynomial in natural units, shape (p,), term order unchanged."""
    k = len(region.names)
    b0, b, matrix = quadratic_form(coefficients, k)
    scaled = matrix / np.outer(region.half_width, region.half_width)
    slope = b / region.half_width
    linear = slope - 2 * scaled @ region.centre
    constant = float(b0) - float(slope @ region.centre) + float(region.centre @ scaled @ region.centre)
    products = [2 * scaled[i, j] for i, j in combinations(range(k), 2)]
    return np.array([constant, *linear, *products, *np.diag(scaled)])
