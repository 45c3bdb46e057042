"""Steepest ascent towards a target: a straight walk through the ranges in the direction of the fitted
effects.

In coded units (low = -1, high = +1) the direction of factor i is d_i = effect_i/|effect_base|, with the
factor of the largest |effect| as base, so that a step moves factor i by d_i x (base step). Because a *target*
is wanted and no maximum, all steps are run and the pair between which the error changes sign brackets the
target. Source: Box and Wilson 1951, J. R. Stat. Soc. B 13:1; Myers, Montgomery and Anderson-Cook 2016, ch. 5.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from doe.errors import StatisticsError
from doe.record import Record

FloatArray = npt.NDArray[np.float64]

LEAST_SHARE = 0.25
"""Half-width of a region, at least, as a share of a factor's range."""


@dataclass(frozen=True)
class AscentFactor:
    """A factor with its screened range in natural units and its effect, mean(high) - mean(low), of the
    response.
    """

    name: str
    low: float
    high: float
    effect: float


@dataclass(frozen=True)
class AscentPath(Record):
    """Steps in running order.

    coded, natural: shape (steps, factors), natural in the unit of each factor. predicted: first-order response
    per step, shape (steps,).
    """

    names: tuple[str, ...]
    base: str
    direction: FloatArray
    coded: FloatArray
    natural: FloatArray
    predicted: FloatArray
    low: FloatArray
    high: FloatArray


@dataclass(frozen=True)
class Bracket(Record):
    """Where a path meets the target.

    lower, upper: indices of the steps on both sides, equal when the target was not met. position: the
    interpolated place of the target, counted in steps. resolved: both ends differ from the target by more
    than 1.96 standard errors (None without standard errors). errors: response - target per step; crossings:
    number of sign changes.
    """

    target: float
    lower: int
    upper: int
    position: float
    reached: bool
    resolved: bool | None
    nearest: int
    crossings: int
    errors: FloatArray
    relative_errors_percent: FloatArray
    statement: str


@dataclass(frozen=True)
class Region(Record):
    """A box in natural units for the next design: coded x = (value - centre)/half_width; arrays of shape
    (factors,).
    """

    names: tuple[str, ...]
    centre: FloatArray
    half_width: FloatArray
    notes: tuple[str, ...]

    def natural(self, coded: npt.ArrayLike) -> FloatArray:
        """Return coded points, shape (..., factors), in natural units."""
        return self.centre + np.asarray(coded, dtype=np.float64) * self.half_width

    def coded(self, natural: npt.ArrayLike) -> FloatArray:
        """Return natural points, shape (..., factors), in coded units."""
        return (np.asarray(natural, dtype=np.float64) - self.centre) / self.half_width


def ascent_path(factors: Sequence[AscentFactor], centre_response: float, steps: int = 6) -> AscentPath:
    """Return the walk along the direction of the effects, from the lowest predicted response to the highest.

    It passes the centre, where the response is `centre_response`, and begins and ends where the base factor meets
    its range; the others move less and stay within theirs.

    Raises StatisticsError for fewer than two steps, an empty range, a non-finite effect or effects all zero.
    """
    effects, low, high = _require_factors(factors)
    if steps < 2:
        raise StatisticsError(f"steps = {steps}; allowed are 2 or more")
    base = int(np.argmax(np.abs(effects)))
    direction = effects / abs(effects[base])
    coded = np.linspace(-1.0, 1.0, steps)[:, None] * direction
    names = tuple(factor.name for factor in factors)
    return AscentPath(
        names=names,
        base=names[base],
        direction=direction,
        coded=coded,
        natural=(low + high) / 2 + coded * (high - low) / 2,
        predicted=centre_response + coded @ effects / 2,
        low=low,
        high=high,
    )


def bracket(path_means: npt.ArrayLike, target: float, standard_errors: npt.ArrayLike | None = None) -> Bracket:
    """Find the neighbouring steps between which the response passes the target.

    path_means: mean response per step, NaN where no run is valid (such a step is passed over), shape
    (steps,). standard_errors: of those means, same shape. Of several sign changes the one whose two errors
    are smallest counts. When there is none the nearest step is returned with a statement. Raises
    StatisticsError without a valid step.
    """
    means = np.asarray(path_means, dtype=np.float64)
    valid = np.flatnonzero(~np.isnan(means))
    if valid.size == 0:
        raise StatisticsError("path_means holds no valid step")
    errors = means - target
    nearest = int(valid[np.argmin(np.abs(errors[valid]))])
    pairs = [(int(i), int(j)) for i, j in pairwise(valid) if errors[i] * errors[j] <= 0]
    relative = 100 * np.abs(errors) / abs(target) if target != 0 else np.full(means.shape, math.nan)
    if not pairs:
        side = "below" if errors[nearest] < 0 else "above"
        statement = (
            f"The path does not reach {target:g}: every step stays {side} it; "
            f"the nearest is step {nearest + 1} with {means[nearest]:.4g}."
        )
        return Bracket(target, nearest, nearest, float(nearest), False, None, nearest, 0, errors, relative, statement)
    lower, upper = min(pairs, key=lambda pair: abs(errors[pair[0]]) + abs(errors[pair[1]]))
    gap = errors[upper] - errors[lower]
    position = lower + (upper - lower) * (float(-errors[lower] / gap) if gap != 0 else 0.5)
    resolved = None
    statement = f"The response passes {target:g} between step {lower + 1} and step {upper + 1}."
    if standard_errors is not None:
        spread = np.asarray(standard_errors, dtype=np.float64)
        resolved = bool(all(abs(errors[k]) > 1.96 * spread[k] for k in (lower, upper)))
        if not resolved:
            statement += " At least one of them lies within replicate noise of the target, so the place is uncertain."
    if len(pairs) > 1:
        statement += f" It passes {len(pairs)} times along the path; the pair with the smallest errors is taken."
    return Bracket(target, lower, upper, position, True, resolved, nearest, len(pairs), errors, relative, statement)


def region_around(path: AscentPath, found: Bracket, minimum_share: float = LEAST_SHARE) -> Region:
    """Return the box of the Box–Behnken design: centred where the path meets the target, within the ranges.

    The half-width of a factor is one step of the path, but at least `minimum_share` of its range (a factor
    that the path hardly moves would otherwise drown in noise) and at most half of it. A box that would leave
    the range is shifted back inside, which `notes` says. Raises StatisticsError unless 0 < minimum_share <=
    0.5.
    """
    if not 0 < minimum_share <= 0.5:
        raise StatisticsError(f"minimum_share = {minimum_share} must lie in (0, 0.5]")
    steps = np.arange(path.natural.shape[0])
    wanted = np.array([np.interp(found.position, steps, column) for column in path.natural.T])
    step = np.abs(np.diff(path.natural, axis=0)).max(axis=0)
    span = path.high - path.low
    half_width = np.clip(step, minimum_share * span, span / 2)
    centre = np.clip(wanted, path.low + half_width, path.high - half_width)
    notes = []
    for j, name in enumerate(path.names):
        if abs(centre[j] - wanted[j]) > 1e-9 * span[j]:
            notes.append(f"The centre of {name} moves from {wanted[j]:.4g} to {centre[j]:.4g} to stay in its range.")
        if half_width[j] > step[j] * (1 + 1e-9):
            notes.append(f"The half-width of {name} is widened from {step[j]:.3g} to {half_width[j]:.3g}.")
    return Region(path.names, centre, half_width, tuple(notes))


def _require_factors(factors: Sequence[AscentFactor]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return effects, lows and highs, each of shape (factors,), after checking them."""
    if not factors:
        raise StatisticsError("factors is empty; at least one is needed")
    for factor in factors:
        if not factor.low < factor.high:
            raise StatisticsError(f"factor {factor.name}: low = {factor.low:g} must be below high = {factor.high:g}")
        if not math.isfinite(factor.effect):
            raise StatisticsError(f"factor {factor.name}: effect = {factor.effect} must be finite")
    effects = np.array([factor.effect for factor in factors])
    if not effects.any():
        raise StatisticsError("all effects are zero, so the path has no direction")
    return (
        effects,
        np.array([factor.low for factor in factors]),
        np.array([factor.high for factor in factors]),
    )
