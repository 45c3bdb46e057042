"""Steepest ascent towards a target: a straight walk through the ranges in the direction of the fitted
effects.

In coded units (low = -1, high = +1) the direction of factor i is d_i = effect_i/|effect_base|, with the
factor of the largest |effect| as base, so that a step moves factor i by d_i x (base step). Because a *target*
is wanted and not a maximum, all steps are run, and the pair between which the error changes sign brackets the
target. Source: Box and Wilson 1951, J. R. Stat. Soc. B 13:1; Myers, Montgomery and Anderson-Cook 2016, ch. 5.

With several targets, the walk leads to the point where they are missed least by the criterion that chooses the optimum
(`optimum.py`), with the first-order models ŷ_t(x) = ȳ_t + b_t·x of the screening, b_t = effects of target t/2:

    J(x) = Σ_t w_t (ŷ_t(x) − T_t)²/s_t² + |x|²

s_t² = (standard error of the target)² + (that of ȳ_t)². The minimum has the closed form

    x* = (I + Σ_t w_t b_t b_tᵀ/s_t²)⁻¹ Σ_t w_t b_t (T_t − ȳ_t)/s_t²

and the walk follows the line through the centre and x*. |x|² gives half a range the same weight as one standard error,
so that an effect within noise hardly turns the walk. With one target, x* is a multiple of b, and this is the walk of
steepest ascent; the gradient of J alone would follow whichever target is known best. Source: damped least squares,
Levenberg 1944, Q. Appl. Math. 2:164, which is ridge analysis (Myers, Montgomery and Anderson-Cook 2016, ch. 6); several
responses in one criterion: ibid. ch. 7; desirability, reported as well: Derringer and Suich 1980, J. Qual. Technol.
12:214, doi 10.1080/00224065.1980.11980968.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from doe.errors import StatisticsError
from doe.record import Record

FloatArray = npt.NDArray[np.float64]

LEAST_SHARE = 0.25
"""Least half-width of a region, as a share of a factor's range."""
REACHED = 2.0
"""Standard errors by which a target may be missed and still count as met by a path, as in `optimum.py`."""
RISE = 3.84
"""Rise of the misfit at the ends of the 95 % interval of a place on a path: chi-squared, one degree of freedom."""


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

    lower, upper: indices of the steps on both sides, equal if the target was not met. position: the
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
class FirstOrder:
    """First-order model of one target over the screened ranges.

    mean: response at the centre; effects: mean(high) - mean(low) of each factor, shape (factors,); goal: the measured
    value; spread: s_t, standard error of the goal and of `mean` together, above zero; weight: w_t.
    """

    mean: float
    effects: FloatArray
    goal: float
    spread: float
    weight: float


@dataclass(frozen=True)
class Approach(Record):
    """Where a path comes nearest to several targets at once, between its steps along straight lines.

    standardised: (mean - goal)/s per target and step, shape (targets, steps). misfit: J = sum of weight x
    standardised^2 per step and desirability, shape (steps,), NaN where a target has no valid run. position: place of
    the least J, counted in steps; lower, upper: the steps on both sides; missed: the standardised misses there, shape
    (targets,). reached: none of them is more than 2. resolved: J rises by more than 3.84 (chi-squared, one degree of
    freedom, 95 %) on both sides.
    """

    standardised: FloatArray
    misfit: FloatArray
    desirability: FloatArray
    lower: int
    upper: int
    position: float
    missed: FloatArray
    reached: bool
    resolved: bool

    def words(self, names: Sequence[str]) -> str:
        """Return the result as sentences; names: of the targets."""
        worst = int(np.argmax(np.abs(self.missed)))
        text = (
            f"All {len(names)} targets together are missed least at step {self.position + 1:.1f}, by at most "
            f"{abs(self.missed[worst]):.1f} standard errors ({names[worst]})."
        )
        if not self.reached:
            return f"{text} The path does not meet all of them."
        return text if self.resolved else f"{text} The steps do not tell that place from the ends of the path."


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


def joint_path(
    names: Sequence[str], low: npt.ArrayLike, high: npt.ArrayLike, models: Sequence[FirstOrder], steps: int = 6
) -> AscentPath:
    """Return the walk through the centre towards x*, where the first-order models miss their goals least (see above).

    low, high: screened ranges, natural units, shape (factors,). The walk is that of `ascent_path` with x* in place of
    the effects: it comes from the opposite side and continues as far as the ranges allow. `predicted` is that of the
    first model. Raises StatisticsError like `ascent_path`, also if all goals are met at the centre, which leaves no
    direction.
    """
    slopes = np.array([model.effects / 2 for model in models])
    precision = np.array([model.weight / model.spread**2 for model in models])
    missing = np.array([model.goal - model.mean for model in models])
    matrix = np.eye(slopes.shape[1]) + (slopes.T * precision) @ slopes
    towards = np.linalg.solve(matrix, slopes.T @ (precision * missing))
    ends = zip(names, np.asarray(low, dtype=float), np.asarray(high, dtype=float), towards, strict=True)
    path = ascent_path([AscentFactor(name, float(a), float(b), float(x)) for name, a, b, x in ends], 0.0, steps)
    return replace(path, predicted=models[0].mean + path.coded @ slopes[0])


def approach(
    means: npt.ArrayLike,
    goals: npt.ArrayLike,
    spreads: npt.ArrayLike,
    weights: npt.ArrayLike,
    margins: npt.ArrayLike,
) -> Approach:
    """Find where a path misses several targets least.

    means: mean response, NaN where no run is valid; spreads: standard error of mean and goal together; both of shape
    (targets, steps). goals, weights, margins: shape (targets,). Desirability: max(0, 1 - |mean - goal|/margin), over
    the targets as the geometric mean by weight. Raises StatisticsError without a step at which every target has a
    valid run.
    """
    means, goals, weights = (np.asarray(one, dtype=np.float64) for one in (means, goals, weights))
    standardised = (means - goals[:, None]) / np.asarray(spreads, dtype=np.float64)
    misfit = weights @ standardised**2
    valid = np.flatnonzero(np.isfinite(misfit))
    if valid.size == 0:
        raise StatisticsError("no step of the path has a valid run for every target")
    single = np.maximum(0.0, 1.0 - np.abs(means - goals[:, None]) / np.asarray(margins, dtype=np.float64)[:, None])
    places = [(int(valid[0]), int(valid[0]), 0.0)]
    for i, j in pairwise(valid):
        change = standardised[:, j] - standardised[:, i]
        steep = float(weights @ change**2)
        share = float(np.clip(-(weights * change) @ standardised[:, i] / steep, 0.0, 1.0)) if steep > 0 else 0.5
        places.append((int(i), int(j), share))

    def at(place: tuple[int, int, float]) -> FloatArray:
        i, j, share = place
        return np.asarray(standardised[:, i] + share * (standardised[:, j] - standardised[:, i]))

    best = min(places, key=lambda place: float(weights @ at(place) ** 2))
    lower, upper, share = best
    missed = at(best)
    least, position = float(weights @ missed**2), lower + share * (upper - lower)
    rises = [misfit[side][np.isfinite(misfit[side])] for side in (slice(0, upper), slice(lower + 1, None))]
    reached = bool(np.abs(missed).max() <= REACHED)
    resolved = all(bool((side > least + RISE).any()) for side in rises)
    return Approach(
        standardised=standardised,
        misfit=misfit,
        desirability=np.prod(single ** (weights / weights.sum())[:, None], axis=0),
        lower=lower,
        upper=upper,
        position=position,
        missed=missed,
        reached=reached,
        resolved=resolved,
    )


def bracket(path_means: npt.ArrayLike, target: float, standard_errors: npt.ArrayLike | None = None) -> Bracket:
    """Find the neighbouring steps between which the response passes the target.

    path_means: mean response per step, NaN where no run is valid (such a step is skipped), shape
    (steps,). standard_errors: of those means, same shape. If there are several sign changes, the one with the
    smallest two errors is taken; if there is none, the nearest step is returned with a statement. Raises
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
    # A step that meets the target ends one pair and begins the next.
    passes = sum(errors[i] != 0 or i == valid[0] for i, _ in pairs)
    if passes > 1:
        statement += f" It passes {passes} times along the path; the pair with the smallest errors is taken."
    return Bracket(target, lower, upper, position, True, resolved, nearest, passes, errors, relative, statement)


def region_around(path: AscentPath, found: Bracket | Approach, minimum_share: float = LEAST_SHARE) -> Region:
    """Return the box of the next design, within the ranges, centred where the path meets the target or best meets all.

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
