"""A Gaussian process fitted to the runs: does it predict unseen runs better than the polynomial?

y = m + f(x) + e with f ~ GP(0, s_f^2 exp(-1/2 sum ((x_j - x'_j)/l_j)^2)), e ~ N(0, s_n^2), m with a flat prior;
x coded, l_j the distance over which factor j changes the response (a long one: hardly any effect). With
R = correlations + g I, g = s_n^2/s_f^2, and P = R^-1 - R^-1 1 (1'R^-1 1)^-1 1'R^-1, the l_j and g maximise the
restricted likelihood, that is, they minimise

    (n - 1) ln(y'Py) + ln|R| + ln(1'R^-1 1)     and then s_f^2 = y'Py/(n - 1).

If a set I of runs is left out, their prediction errors are (P_II)^-1 (Py)_I; for a single run, (Py)_i/P_ii with the
variance s_f^2/P_ii. Nothing is refitted, l_j and g stay fixed (Rasmussen and Williams 2006, Gaussian Processes for
Machine Learning, eq. 5.12, with P for the inverse because m is fitted again; Dubrule 1983, Math. Geol. 15:687). This
corresponds to PRESS of a polynomial, whose terms stay fixed as well.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
import numpy.typing as npt
from scipy import linalg, stats
from scipy.optimize import brentq, minimize
from scipy.stats import qmc

from doe.analysis.optimum import ResponseTarget
from doe.analysis.replicates import valid_runs
from doe.analysis.steepest_ascent import Region
from doe.errors import StatisticsError
from doe.record import Record

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
LENGTHS = (0.1, 100.0)
"""Least and greatest length, in half-widths of the region."""
NOISE = (1e-8, 1e4)
"""Least and greatest g."""
STARTS = tuple(product((0.5, 1.0, 3.0), (1e-4, 0.1)))
"""Starting values of the length (for all factors) and g in the maximisation of the likelihood."""
FEWEST_RUNS, MOST_RUNS = 5, 500
SAMPLE = 4096
"""Number of points of the region among which settings are searched for."""
MOST_RAYS = 40


@dataclass(frozen=True)
class GaussianProcess(Record):
    """A fitted process. lengths: coded, (k,). signal, noise: standard deviations s_f, s_n, unit of the response.

    Per run: points (n, k) coded, observed, row_of_run, left_out (observed less predicted without the run), left_out_sd.
    press, press_by_row: sums of squared prediction errors with single runs, or whole rows of the design, left out; with
    the corresponding R^2 about the mean.
    """

    region: Region
    lengths: FloatArray
    signal: float
    noise: float
    mean: float
    points: FloatArray
    observed: FloatArray
    row_of_run: IntArray
    left_out: FloatArray
    left_out_sd: FloatArray
    press: float
    press_by_row: float
    r_squared_predicted: float
    r_squared_predicted_by_row: float

    @cached_property
    def _solved(self) -> tuple[FloatArray, FloatArray]:
        """Inverse of R, and weights of the correlations of a point in its prediction."""
        ratio = (self.noise / self.signal) ** 2 * np.eye(len(self.points))
        inverse: FloatArray = np.asarray(np.linalg.inv(correlations(self.points, self.points, self.lengths) + ratio))
        return inverse, inverse @ (self.observed - self.mean)

    def predict(self, coded: npt.ArrayLike) -> FloatArray:
        """Return the mean response at coded points, shape (..., k) -> (...)."""
        x = np.asarray(coded, dtype=np.float64)
        near = correlations(x.reshape(-1, x.shape[-1]), self.points, self.lengths)
        return np.asarray(self.mean + near @ self._solved[1]).reshape(x.shape[:-1])

    def standard_error(self, coded: npt.ArrayLike) -> FloatArray:
        """Return the standard deviation of m + f at coded points, shape (..., k) -> (...)."""
        x = np.asarray(coded, dtype=np.float64)
        near, inverse = correlations(x.reshape(-1, x.shape[-1]), self.points, self.lengths), self._solved[0]
        ones = inverse.sum(axis=1)
        spread = 1 - np.einsum("mi,ij,mj->m", near, inverse, near) + (1 - near @ ones) ** 2 / ones.sum()
        return np.asarray(self.signal * np.sqrt(np.maximum(spread, 0.0))).reshape(x.shape[:-1])


@dataclass(frozen=True)
class ProcessTarget(Record):
    """The setting for a target: of all settings that give it, the one nearest the reference; if none does, the setting
    where the process comes nearest to it. point: natural, (k,). predicted with its 95 % interval and the reachable
    values: unit of the response. compatible_low, compatible_high: range of each factor over that part of the region
    (compatible_share) whose mean differs from the target by no more than 1.96 standard errors; NaN where there is none.
    """

    target: float
    reached: bool
    point: FloatArray
    predicted: float
    predicted_low: float
    predicted_high: float
    reachable_low: float
    reachable_high: float
    compatible_low: FloatArray
    compatible_high: FloatArray
    compatible_share: float


def correlations(one: FloatArray, other: FloatArray, lengths: FloatArray) -> FloatArray:
    """Return the correlations of f between points, (m, k) and (n, k) -> (m, n)."""
    apart = ((one[:, None, :] - other[None, :, :]) / lengths) ** 2
    return np.asarray(np.exp(-apart.sum(axis=-1) / 2))


def fit_process(coded: FloatArray, responses: FloatArray, region: Region) -> GaussianProcess:
    """Fit a process to every valid run; shapes as in `doe.analysis.surface.fit_surface`.

    Raises StatisticsError for too few or too many runs, or a response that never changes.
    """
    _, row, observed = valid_runs(responses, len(coded))
    points = coded[row]
    n, k = points.shape
    if not FEWEST_RUNS <= n <= MOST_RUNS:
        raise StatisticsError(
            f"responses: {n} valid runs; allowed for a Gaussian process: {FEWEST_RUNS} to {MOST_RUNS}"
        )
    scale = float(observed.std())
    if scale <= 8 * np.finfo(np.float64).eps * float(np.abs(observed).max()):
        raise StatisticsError("responses: the same in every run; a Gaussian process needs responses that vary")
    y = (observed - observed.mean()) / scale
    bounds = np.log([LENGTHS] * k + [NOISE])
    starts = [np.log([*[length] * k, noise]) for length, noise in STARTS]
    tries = [minimize(_deviance, x, (points, y), jac=True, method="L-BFGS-B", bounds=bounds) for x in starts]
    best = min(tries, key=lambda one: float(one.fun)).x
    lengths, ratio = np.exp(best[:-1]), float(np.exp(best[-1]))
    inverse, projected = _projected(points, lengths, ratio)
    missed = projected @ y
    signal = scale * float(np.sqrt(y @ missed / (n - 1)))
    left_out = scale * missed / np.diag(projected)
    by_row = sum(
        float((np.linalg.solve(projected[np.ix_(own, own)], missed[own]) ** 2).sum()) * scale**2
        for own in (np.flatnonzero(row == one) for one in np.unique(row))
        if len(own) < n
    )
    press, total = float(left_out @ left_out), float(((observed - observed.mean()) ** 2).sum())
    return GaussianProcess(
        region=region,
        lengths=lengths,
        signal=signal,
        noise=signal * float(np.sqrt(ratio)),
        mean=float(observed.mean()) + scale * float(inverse.sum(axis=0) @ y / inverse.sum()),
        points=points,
        observed=observed,
        row_of_run=row,
        left_out=left_out,
        left_out_sd=signal / np.sqrt(np.diag(projected)),
        press=press,
        press_by_row=by_row,
        r_squared_predicted=1 - press / total,
        r_squared_predicted_by_row=1 - by_row / total,
    )


def _projected(points: FloatArray, lengths: FloatArray, ratio: float) -> tuple[FloatArray, FloatArray]:
    """R^-1 and P."""
    factor = linalg.cho_factor(correlations(points, points, lengths) + ratio * np.eye(len(points)))
    inverse = linalg.cho_solve(factor, np.eye(len(points)))
    ones = inverse.sum(axis=1)
    return inverse, inverse - np.outer(ones, ones) / ones.sum()


def _deviance(logs: FloatArray, points: FloatArray, y: FloatArray) -> tuple[float, FloatArray]:
    """The function to minimise and its gradient, in the logarithms of the lengths and of g."""
    lengths, ratio = np.exp(logs[:-1]), float(np.exp(logs[-1]))
    try:
        inverse, projected = _projected(points, lengths, ratio)
    except linalg.LinAlgError:  # points too near each other for so little noise
        return 1e10, np.zeros(len(logs))
    missed = projected @ y
    squares = float(y @ missed)
    n = len(y)
    found = (n - 1) * np.log(squares) - np.linalg.slogdet(inverse)[1] + np.log(inverse.sum())
    # d/dt = tr(P dR) - (n - 1) (Py)' dR (Py)/(y'Py)
    pull = projected - (n - 1) / squares * np.outer(missed, missed)
    weighted = pull * correlations(points, points, lengths)
    slopes = [(weighted * (np.subtract.outer(x, x) / one) ** 2).sum() for x, one in zip(points.T, lengths, strict=True)]
    return float(found), np.array([*slopes, ratio * np.trace(pull)])


def process_target(found: GaussianProcess, target: ResponseTarget) -> ProcessTarget:
    """Return the setting nearest to the reference (coded distance) at which the process gives the target."""
    region, k = found.region, found.points.shape[1]
    sample = 2 * qmc.Sobol(k, rng=np.random.default_rng(0)).random(SAMPLE) - 1
    corners = np.array(list(product((-1.0, 1.0), repeat=min(k, 10))))
    if k <= 10:
        sample = np.vstack([sample, corners])
    reference = np.clip(region.coded(target.reference), -1.0, 1.0)
    error = found.predict(sample) - target.value
    bounds = [(-1.0, 1.0)] * k

    def extreme(sign: float) -> FloatArray:
        start = sample[int(np.argmax(sign * error))]
        return np.asarray(
            minimize(lambda x: -sign * float(found.predict(x)), start, method="L-BFGS-B", bounds=bounds).x
        )

    ends = [extreme(-1.0), extreme(1.0)]
    reach = [float(found.predict(end)) for end in ends]
    reached = reach[0] <= target.value <= reach[1]
    if reached:
        point = _nearest(found, target.value, reference, np.vstack([sample, ends]))
    else:
        point = ends[0] if target.value < reach[0] else ends[1]
    mean, half = float(found.predict(point)), float(stats.norm.ppf(0.975) * found.standard_error(point))
    margin = stats.norm.ppf(0.975) * np.hypot(found.standard_error(sample), target.standard_error)
    near = sample[np.abs(error) <= margin]
    none = np.full(k, np.nan)
    return ProcessTarget(
        target=target.value,
        reached=reached,
        point=region.natural(point),
        predicted=mean,
        predicted_low=mean - half,
        predicted_high=mean + half,
        reachable_low=reach[0],
        reachable_high=reach[1],
        compatible_low=region.natural(near.min(axis=0)) if len(near) else none,
        compatible_high=region.natural(near.max(axis=0)) if len(near) else none,
        compatible_share=len(near) / len(sample),
    )


def _nearest(found: GaussianProcess, target: float, reference: FloatArray, sample: FloatArray) -> FloatArray:
    """The setting nearest to the reference: where rays from it first cross the target, refined along the target."""
    start = float(found.predict(reference)) - target
    if start == 0:
        return reference
    error = found.predict(sample) - target
    beyond = sample[np.sign(error) != np.sign(start)]
    nearest = beyond[np.argsort(((beyond - reference) ** 2).sum(axis=1))[:MOST_RAYS]]
    crossing = [
        reference + brentq(lambda s, end=end: float(found.predict(reference + s * (end - reference))) - target, 0, 1)
        * (end - reference)
        for end in nearest
    ]  # fmt: skip
    crossing.sort(key=lambda x: float(((x - reference) ** 2).sum()))
    best = crossing[0]
    for one in crossing[:3]:
        refined = minimize(
            lambda x: float(((x - reference) ** 2).sum()),
            one,
            method="SLSQP",
            bounds=[(-1.0, 1.0)] * len(one),
            constraints={"type": "eq", "fun": lambda x: float(found.predict(x)) - target},
            options={"ftol": 1e-12},
        )
        on_target = abs(float(found.predict(refined.x)) - target) <= 1e-6 * found.signal
        if on_target and refined.fun < ((best - reference) ** 2).sum():
            best = np.asarray(refined.x)
    return best
