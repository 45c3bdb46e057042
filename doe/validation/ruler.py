"""How strong an effect is: its shift of the means of a data set, in standard errors, free of what noise adds to it.

    d² = δᵀ M δ,    M = (Σ/n + J Jᵀ)⁻¹

δ is the shift of the features of all fitted conditions, Σ the covariance of one pour (block by condition), n the pours
of a data set in each condition, and J what each parameter does per standard deviation of its independent measurement:
a shift that recalibration can make counts for little. A plain d² of estimated means is too large by their noise. The
shifts of separate folds of pours have separate noise, so products between folds only are free of that (crossnobis:
Diedrichsen et al. 2016, arXiv 1607.01371, eq. 9):

    d² = [ (Σ_f δ_f)ᵀ M (Σ_f δ_f) − Σ_f δ_fᵀ M δ_f ] / (F (F − 1))

Its standard error is the jackknife's over folds and, in quadrature, d/√(2 df), for Σ is itself estimated. Σ is shrunk
to its diagonal as far as its own scatter asks for (Schäfer & Strimmer 2005, doi 10.2202/1544-6115.1175).

**The ruler** of this project, by which an effect is said to be 6 σ strong, is this distance in the scalars of the
fitted conditions at ``REPLICATES`` pours each.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.diagnose.emulator import shrunk_covariance
from doe.diagnose.levels import REPLICATES
from doe.errors import StatisticsError
from doe.record import Record
from doe.validation.reference import SIDE, Sample

FloatArray = npt.NDArray[np.float64]
FOLDS = 8


@dataclass(frozen=True)
class Metric:
    """``whitening`` W with M = Wᵀ W, so that shifts in its units have unit noise, (D, D).

    ``freedom``: degrees of freedom of the covariance that it is made of.
    """

    whitening: FloatArray
    freedom: int

    def white(self, shifts: FloatArray) -> FloatArray:
        """Shifts (..., D) in standard errors of a data set."""
        return np.asarray(shifts @ self.whitening.T, dtype=np.float64)


@dataclass(frozen=True)
class Strength(Record):
    """A distance [standard errors of a data set] with its standard error."""

    value: float
    error: float


def metric_of(sample: Sample, replicates: int = REPLICATES) -> Metric:
    """The metric of data sets of ``replicates`` pours per condition.

    Parameters
    ----------
    sample
        Reference pours; needs "base" and "<parameter> -", "<parameter> +" of every parameter.
    replicates
        n, pours in each condition.

    Returns
    -------
    The metric, with calibrated parameters profiled out.

    Raises
    ------
    StatisticsError
        Where a condition has fewer than three pours of the base model.
    """
    sensitivity = np.column_stack(
        [_slope(sample, name) for name in sample.parameters] or [np.zeros((_size(sample), 0))]
    )
    covariance = np.zeros((_size(sample), _size(sample)))
    first, freedom = 0, sum(len(block) for block in sample.pours["base"])
    for c, base in enumerate(sample.pours["base"]):
        if len(base) < 3:
            raise StatisticsError(f"base: {len(base)} pours of condition {c + 1}; allowed: at least 3")
        last = first + base.shape[1]
        residuals, groups = _residuals(sample, c)
        covariance[first:last, first:last] = shrunk_covariance(residuals) / replicates
        freedom = min(freedom, len(residuals) - groups)
        first = last
    covariance += sensitivity @ sensitivity.T
    # In units of each feature's standard error: they span ten orders of magnitude.
    scale = np.sqrt(np.diag(covariance))
    factor = np.linalg.cholesky(covariance / np.outer(scale, scale))
    return Metric(np.linalg.inv(factor) / scale, freedom)


def fold_shifts(sample: Sample, name: str, metric: Metric, folds: int = FOLDS) -> FloatArray:
    """Whitened shifts of ``name`` off the base model in each of the folds, (folds, D).

    Raises StatisticsError where a fold would be empty.
    """
    least = min(len(block) for kind in (name, "base") for block in sample.pours[kind])
    if least < folds:
        raise StatisticsError(f"{name}: {least} pours in a condition that count; allowed: at least {folds}")
    parts = []
    for there, base in zip(sample.pours[name], sample.pours["base"], strict=True):
        parts.append(_fold_means(there, folds) - _fold_means(base, folds))
    return metric.white(np.concatenate(parts, axis=1))


def product(first: FloatArray, second: FloatArray) -> float:
    """Crossnobis product of two sets of fold shifts, (folds, D) each: no fold meets itself."""
    folds = len(first)
    whole = float(first.sum(axis=0) @ second.sum(axis=0))
    return (whole - float((first * second).sum())) / (folds * (folds - 1))


def strength_of(sample: Sample, name: str, metric: Metric) -> Strength:
    """Length of the shift by ``name``, zero where its square comes out negative, with its standard error."""
    shifts = fold_shifts(sample, name, metric)
    folds = len(shifts)
    square = product(shifts, shifts)
    value = float(np.sqrt(max(0.0, square)))
    without = np.array([product(rest, rest) for f in range(folds) for rest in [np.delete(shifts, f, axis=0)]])
    spread = float(np.sqrt((folds - 1) / folds * ((without - without.mean()) ** 2).sum()))
    # Of the square; that of its root by the delta method, and of a root near zero by the root of that.
    error = spread / (2.0 * value) if square > spread else float(np.sqrt(spread))
    return Strength(value, float(np.hypot(error, value / np.sqrt(2.0 * metric.freedom))))


def _residuals(sample: Sample, condition: int) -> tuple[FloatArray, int]:
    """Deviations from the mean of their kind, of base pours and of those with a parameter moved, and the kinds."""
    kinds = ["base", *(f"{name} {side}" for name in sample.parameters for side in "-+")]
    groups = [sample.pours[kind][condition] for kind in kinds]
    # Each group's mean takes a degree of freedom.
    scaled = [
        (group - group.mean(axis=0)) * np.sqrt(len(group) / (len(group) - 1)) for group in groups if len(group) > 1
    ]
    return np.concatenate(scaled), len(scaled)


def _slope(sample: Sample, parameter: str) -> FloatArray:
    """What ``parameter`` does per standard deviation of its measurement, (D,)."""
    low, high = sample.pours[f"{parameter} -"], sample.pours[f"{parameter} +"]
    return np.concatenate([(b.mean(axis=0) - a.mean(axis=0)) / (2.0 * SIDE) for a, b in zip(low, high, strict=True)])


def _fold_means(pours: FloatArray, folds: int) -> FloatArray:
    """Means of every ``folds``-th pour, (folds, d)."""
    return np.stack([pours[f::folds].mean(axis=0) for f in range(folds)])


def _size(sample: Sample) -> int:
    return sum(block.shape[1] for block in sample.pours["base"])
