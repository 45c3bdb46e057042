"""Joint posterior of the factors given all targets, over the region of the response surface.

    p(x | T) ∝ Π_t N(T_t | ŷ_t(x), s_t(x)²) over the cube, s_t² = (sd_t/√n_t)² + (standard error of ŷ_t at x)²

with a uniform prior over the region. The models are surrogates for the pours: their lack of fit is not included, and
the errors of two models of the same pours are treated as independent. With up to four factors the integrals are sums
over a grid: exact to within its step, and without the convergence problems of a sampler. The grid is made twice, the
second time on the box that holds all but a millionth of each factor's posterior. s_t² includes the variation of ŷ_t
within a cell, Σ_j (∂ŷ_t/∂x_j · step_j)²/12, so that a target without an error is met by a sheet of cells and not by
chance in a single one.

Kennedy & O'Hagan 2001, doi 10.1111/1467-9868.00294 (calibration on a surrogate, here without a discrepancy); Gelman et
al. 2013, Bayesian Data Analysis, ch. 3 and 6 (grids, posterior predictive).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import numpy.typing as npt
from scipy import optimize, stats

from doe.analysis.surface import Surface
from doe.record import Record
from doe.target import Target

FloatArray = npt.NDArray[np.float64]

CELLS = {1: 401, 2: 161, 3: 41, 4: 21}
"""Number of grid cells along each factor, by the number of factors."""
KEPT = 31
"""Number of cells along each factor in the densities that are kept."""
OPEN_SHARE = 0.5
"""Width of a 95 % interval, as a share of the region, from which a factor is unidentified, as in `find_optimum`."""
LEAST_ERROR = 1e-6
"""Least standard error of a target, relative to its own size or that of its model."""
NEGLIGIBLE = 1e-6
"""Share of the posterior that refining may lose at each end of a factor."""


@dataclass(frozen=True)
class JointPosterior(Record):
    """Joint posterior of all targets. Factors in the order of the models, in natural units; k factors, m targets.

    ``density``: probability in each of ``KEPT`` equal cells between ``axis_low`` and ``axis_high``, shape (k, cells),
    and ``pair_density`` of each pair in the order of ``itertools.combinations``, shape (pairs, cells, cells), the first
    factor along the first axis. ``low`` and ``high``: 95 % interval, equal tails. ``predicted`` and ``predicted_sd``:
    the mean of each target's model over the posterior and its standard deviation, the model's own error included.
    ``misfit``: the least Σ (ŷ_t − T_t)²/s_t². ``p``: the probability that χ² with one degree of freedom per target is
    larger. This χ² is the distribution of the misfit at a setting that truly gives all targets; the least misfit cannot
    be larger than that, so ``p`` is conservative and a small value can be acted on.
    """

    names: tuple[str, ...]
    axis_low: FloatArray
    axis_high: FloatArray
    density: FloatArray
    pair_density: FloatArray
    mean: FloatArray
    sd: FloatArray
    low: FloatArray
    high: FloatArray
    correlation: FloatArray
    share: FloatArray
    """Width of the 95 % interval as a share of that of the region."""
    predicted: FloatArray
    predicted_sd: FloatArray
    misfit: float
    p: float

    @property
    def identified(self) -> tuple[bool, ...]:
        """Whether the targets determine each factor to within less than half of the region."""
        return tuple(bool(part < OPEN_SHARE) for part in self.share)


def joint_posterior(models: Sequence[Surface], targets: Sequence[Target]) -> JointPosterior | None:
    """Return the posterior of the factors of ``models``, one per target; None with more than four factors.

    Where no setting comes near the targets, the posterior is the neighbourhood of the nearest setting, and ``misfit``
    shows that it is not an answer.
    """
    k = len(models[0].names)
    if k not in CELLS:
        return None
    low, high = np.full(k, -1.0), np.full(k, 1.0)
    for _ in range(2):
        axes, grid = _grid(low, high, CELLS[k])
        missed, error = _misses(models, targets, grid, within_cells=True)
        chi2 = (missed**2).sum(axis=0)
        log = -0.5 * chi2 - np.log(error).sum(axis=0)
        weight = np.exp(log - log.max())
        weight = (weight / weight.sum()).reshape([CELLS[k]] * k)
        step = (high - low) / CELLS[k]
        # Marginals that fill only a few cells are computed again on a finer grid.
        low, high = _box(weight, axes, step)
    return _summary(models, targets, axes, grid, weight, _least_misfit(models, targets, grid[chi2.argmin()]))


def _grid(low: FloatArray, high: FloatArray, cells: int) -> tuple[list[FloatArray], FloatArray]:
    """Middles of the cells along each factor, and all of them, shape (cells^k, k); coded."""
    axes = [a + (np.arange(cells) + 0.5) * (b - a) / cells for a, b in zip(low, high, strict=True)]
    return axes, np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(axes))


def least_error(model: Surface, target: Target) -> float:
    """Return the least standard error used for a model without error or slope and a target without error."""
    return max(LEAST_ERROR * max(abs(target.mean), abs(float(model.coefficients[0]))), np.finfo(np.float64).tiny)


def _misses(
    models: Sequence[Surface], targets: Sequence[Target], points: FloatArray, within_cells: bool = False
) -> tuple[FloatArray, FloatArray]:
    """(ŷ_t − T_t)/s_t and s_t at the points, shape (m, points) each; ``within_cells``: the points are a whole grid."""
    missed, errors = [], []
    for model, target in zip(models, targets, strict=True):
        values, variance = model.predict(points), target.standard_error**2 + model.standard_error(points) ** 2
        if within_cells:
            k = points.shape[1]
            steps = np.gradient(values.reshape([CELLS[k]] * k))
            variance += sum(step.ravel() ** 2 for step in (steps if k > 1 else [steps])) / 12.0
        errors.append(np.maximum(np.sqrt(variance), least_error(model, target)))
        missed.append((values - target.mean) / errors[-1])
    return np.array(missed), np.array(errors)


def _least_misfit(models: Sequence[Surface], targets: Sequence[Target], start: FloatArray) -> float:
    """Least Σ (ŷ_t − T_t)²/s_t² in the cube, from the best cell on."""
    found = optimize.least_squares(lambda x: _misses(models, targets, x[None])[0][:, 0], start, bounds=(-1.0, 1.0))
    return 2.0 * float(found.cost)


def _marginal(weight: FloatArray, *kept: int) -> FloatArray:
    return np.asarray(weight.sum(axis=tuple(j for j in range(weight.ndim) if j not in kept)))


def _box(weight: FloatArray, axes: Sequence[FloatArray], step: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The box of cells that hold all but ``NEGLIGIBLE`` of each factor's posterior, a cell more to every side."""
    ends = []
    for j, axis in enumerate(axes):
        part = np.cumsum(_marginal(weight, j))
        first, last = np.searchsorted(part, [NEGLIGIBLE, 1.0 - NEGLIGIBLE])
        ends.append((axis[first] - 1.5 * step[j], axis[min(int(last), axis.size - 1)] + 1.5 * step[j]))
    low, high = np.array(ends).T
    return np.maximum(low, -1.0), np.minimum(high, 1.0)


def _summary(
    models: Sequence[Surface],
    targets: Sequence[Target],
    axes: Sequence[FloatArray],
    grid: FloatArray,
    weight: FloatArray,
    misfit: float,
) -> JointPosterior:
    region, k, flat = models[0].region, len(axes), weight.ravel()
    mean = flat @ grid
    spread = grid - mean
    covariance = (spread * flat[:, None]).T @ spread
    sd = np.sqrt(np.diag(covariance))
    intervals = np.array([_interval(_marginal(weight, j), axis) for j, axis in enumerate(axes)])
    edges = np.array([(1.5 * a[0] - 0.5 * a[1], 1.5 * a[-1] - 0.5 * a[-2]) for a in axes])
    values = np.array([model.predict(grid) for model in models])
    errors = np.array([model.standard_error(grid) for model in models])
    predicted = values @ flat
    variance = ((values - predicted[:, None]) ** 2 + errors**2) @ flat
    width = region.half_width
    pairs = [_coarser(_marginal(weight, i, j)) for i, j in combinations(range(k), 2)]
    return JointPosterior(
        names=region.names,
        axis_low=region.natural(edges[:, 0]),
        axis_high=region.natural(edges[:, 1]),
        density=np.array([_coarser(_marginal(weight, j)) for j in range(k)]),
        pair_density=np.array(pairs).reshape(len(pairs), KEPT, KEPT),
        mean=region.natural(mean),
        sd=sd * width,
        low=region.natural(intervals[:, 0]),
        high=region.natural(intervals[:, 1]),
        correlation=covariance / np.outer(sd, sd),
        share=(intervals[:, 1] - intervals[:, 0]) / 2.0,
        predicted=predicted,
        predicted_sd=np.sqrt(variance),
        misfit=misfit,
        p=float(stats.chi2.sf(misfit, len(targets))),
    )


def _interval(part: FloatArray, axis: FloatArray) -> tuple[float, float]:
    """2.5 % and 97.5 % of a marginal, its probability spread evenly over each cell."""
    step = axis[1] - axis[0]
    edges = np.append(axis - 0.5 * step, axis[-1] + 0.5 * step)
    low, high = np.interp([0.025, 0.975], np.append(0.0, np.cumsum(part)), edges)
    return float(low), float(high)


def _coarser(part: FloatArray) -> FloatArray:
    """Probabilities in ``KEPT`` equal cells along every axis, of those in the cells of the grid."""
    for axis in range(part.ndim):
        n = part.shape[axis]
        total = np.concatenate([np.zeros_like(part.take([0], axis)), part.cumsum(axis)], axis)
        place = np.linspace(0.0, n, KEPT + 1)
        below = np.minimum(place.astype(int), n - 1)
        share = np.expand_dims(place - below, tuple(j for j in range(part.ndim) if j != axis))
        at = total.take(below, axis) * (1.0 - share) + total.take(below + 1, axis) * share
        part = np.diff(at, axis=axis)
    return part
