"""T^2 of many data sets at once against one polynomial model, and its minimum within bounds.

    T^2(x) = sum_c (y_c - f_c(x))' W_c (y_c - f_c(x)) + sum_i w_i (x_i - m_i)^2,   W_c = Sigma_c^-1

Because f is linear in its terms, T^2 = yy - 2 t(x)'b + t(x)'A t(x) with A = sum_c C_c W_c C_c', b = sum_c C_c W_c y_c:
the summaries are summed once per data set, and thousands of bootstrap sets are fitted together. Minimiser: projected
Gauss-Newton with Levenberg damping, the variables held at a bound while T^2 falls outwards (Bertsekas 1982).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.diagnose.emulation.predictor import Predictor
from doe.diagnose.emulation.terms import monomials, slopes

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

MAX_ITERATIONS = 60
TOLERANCE = 1e-7
"""Relative fall of T^2 below which a set counts as fitted; T^2 itself is of the order of 10."""

LEVELS = {0: 0, 1: 5, 2: 3, 3: 2, 4: 2}
"""Amplitudes per axis from which a fit may start, by the number of amplitudes."""


@dataclass(frozen=True)
class Misfit:
    """B data sets. gram: (B, p, p), moment: (B, p), square: (B,), about the model at `origin`.

    prior_mean: (B, q) and prior_weight: (q,) = 1/sd^2 in coded units, zero for a flat parameter.
    """

    predictor: Predictor
    gram: FloatArray
    moment: FloatArray
    square: FloatArray
    prior_mean: FloatArray
    prior_weight: FloatArray

    def value(self, x: FloatArray) -> FloatArray:
        """Return T^2 at x (B, q) -> (B,)."""
        terms = monomials(x, self.predictor.exponents)
        quadratic = (terms * (self.gram @ terms[:, :, None])[:, :, 0]).sum(axis=1)
        prior = (self.prior_weight * (x - self.prior_mean) ** 2).sum(axis=1)
        return np.asarray(self.square - 2 * (terms * self.moment).sum(axis=1) + quadratic + prior)

    def half_gradient(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return half the gradient of T^2, (B, q), and its Gauss-Newton matrix, (B, q, q)."""
        terms = monomials(x, self.predictor.exponents)
        rows = slopes(x, self.predictor.exponents)
        pull = self.moment - (self.gram @ terms[:, :, None])[:, :, 0]
        gradient = -(rows @ pull[:, :, None])[:, :, 0] + self.prior_weight * (x - self.prior_mean)
        return gradient, rows @ self.gram @ rows.transpose(0, 2, 1) + np.diag(self.prior_weight)

    def of_sets(self, index: IntArray) -> Misfit:
        """Return the same for some of the data sets."""
        return Misfit(
            self.predictor,
            self.gram[index],
            self.moment[index],
            self.square[index],
            self.prior_mean[index],
            self.prior_weight,
        )


def build_misfit(
    predictor: Predictor,
    means: Sequence[FloatArray],
    weights: Sequence[FloatArray],
    prior_mean: FloatArray,
    prior_weight: FloatArray,
) -> Misfit:
    """Return T^2 of B data sets. means: per condition (B, d_c). weights: per condition (B, d_c, d_c) or (1, d_c, d_c).

    prior_mean: (B, k) and prior_weight: (k,) of the parameters; amplitudes have none. The model at the middle of the
    parameters is subtracted first, which keeps yy of the order of T^2 in floating point.
    """
    sets, p = len(means[0]), len(predictor.exponents)
    constant = int(np.flatnonzero((predictor.exponents == 0).all(axis=1))[0])
    gram, moment, square = np.zeros((sets, p, p)), np.zeros((sets, p)), np.zeros(sets)
    for coefficients, mean, weight in zip(predictor.coefficients, means, weights, strict=True):
        origin = coefficients[constant]
        shifted = coefficients.copy()
        shifted[constant] = 0.0
        weighted = shifted @ weight
        gram += weighted @ shifted.T
        y = mean - origin
        moment += (weighted @ y[:, :, None])[:, :, 0]
        square += np.einsum("bd,bd->b", (weight @ y[:, :, None])[:, :, 0], y)
    free = predictor.exponents.shape[1] - len(prior_weight)
    return Misfit(
        predictor=predictor,
        gram=gram,
        moment=moment,
        square=square,
        prior_mean=np.concatenate([prior_mean, np.zeros((sets, free))], axis=1),
        prior_weight=np.concatenate([prior_weight, np.zeros(free)]),
    )


def minimise(misfit: Misfit, start: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return x (B, q) within the box and T^2 (B,) from a start (B, q)."""
    low, high = misfit.predictor.low, misfit.predictor.high
    x = np.clip(start, low, high)
    value = misfit.value(x)
    damping = np.full(len(x), 1e-6)
    open_sets = np.arange(len(x))
    for _ in range(MAX_ITERATIONS):
        part = misfit if len(open_sets) == len(x) else misfit.of_sets(open_sets)
        here, before, strength = x[open_sets], value[open_sets], damping[open_sets]
        trial = np.clip(here + _step(part, here, strength), low, high)
        after = part.value(trial)
        better = after <= before
        x[open_sets[better]], value[open_sets[better]] = trial[better], after[better]
        damping[open_sets] = np.where(better, np.maximum(strength / 10, 1e-9), strength * 10)
        # At the minimum rounding alone may raise T^2.
        settled = (np.abs(before - after) <= TOLERANCE * (1 + before)) & (strength <= 1e-2)
        open_sets = open_sets[~(settled | (damping[open_sets] > 1e9))]
        if not len(open_sets):
            break
    return x, value


def best_start(misfit: Misfit, theta: FloatArray) -> FloatArray:
    """Return per data set, (B, q), the start of least T^2 after one linear step of the parameters.

    theta: (k,) or (B, k) parameters to start from. Tried are LEVELS amplitudes per axis inside the bounds, zero left
    out (a model without a linear term has no slope there).
    """
    k = misfit.predictor.parameters
    low, high = misfit.predictor.low[k:], misfit.predictor.high[k:]
    sets = len(misfit.square)
    at = np.broadcast_to(theta, (sets, k))
    axes = [np.linspace(a, b, LEVELS[len(low)] + 2)[1:-1] for a, b in zip(low, high, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(low)) if axes else np.zeros((1, 0))
    grid = grid[np.abs(grid).max(axis=1) > 1e-12] if axes else grid
    tried = []
    for amplitudes in grid:
        x = np.concatenate([at, np.broadcast_to(amplitudes, (sets, len(amplitudes)))], axis=1)
        gradient, matrix = misfit.half_gradient(x)
        step = np.linalg.solve(_regular(matrix[:, :k, :k]), gradient[:, :k, None])[:, :, 0]
        tried.append(misfit.value(x) - (gradient[:, :k] * step).sum(axis=1))
    choice = np.argmin(tried, axis=0)
    return np.concatenate([at, grid[choice]], axis=1)


def _step(misfit: Misfit, x: FloatArray, damping: FloatArray) -> FloatArray:
    """Return the damped Gauss-Newton step of the variables that are free to move, (B, q)."""
    gradient, matrix = misfit.half_gradient(x)
    low, high = misfit.predictor.low, misfit.predictor.high
    free = ~(((x <= low) & (gradient > 0)) | ((x >= high) & (gradient < 0)))
    both = free[:, :, None] & free[:, None, :]
    diagonal = np.einsum("bii->bi", matrix)
    kept = np.where(both, matrix, 0.0)
    q = x.shape[1]
    kept[:, np.arange(q), np.arange(q)] = np.where(free, diagonal * (1 + damping[:, None]), 1.0)
    return np.asarray(-np.linalg.solve(_regular(kept), np.where(free, gradient, 0.0)[:, :, None])[:, :, 0])


def _regular(matrix: FloatArray) -> FloatArray:
    """Return the matrix with a trace of its size on the diagonal, so that a direction without slope stays solvable."""
    q = matrix.shape[-1]
    if q == 0:
        return matrix
    size = np.einsum("...ii->...", matrix) / q
    return np.asarray(matrix + (1e-10 * size + 1e-12)[..., None, None] * np.eye(q))
