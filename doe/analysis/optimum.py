"""Optimum: of all settings that give the target, the one nearest to the measured parameters, with its uncertainty.

The settings with model = target form a surface in the cube, so one target cannot fix several factors. The
chosen point minimises sum ((x_i - reference_i)/scale_i)^2 on that surface. Reported with it: the bootstrap
interval of the point (the target's own standard error included), the range that each factor can take on the
surface (its width), and the share of the cube whose predicted mean is compatible with the target at 95 %.
The interval is that of the point chosen by this rule; it states what is known about a factor only if the factor is
identified. The bootstrap fits the same model to many resampled copies of the runs, in one solve.
Source: Davison and Hinkley 1997, Bootstrap Methods and their Application, ch. 6; Myers, Montgomery and Anderson-Cook
2016, ch. 6-7.

With several targets, the setting is chosen whose predicted responses miss them least, relative to the uncertainties:

    J(x) = Σ_t w_t (ŷ_t(x) − T_t)² / s_t²

with s_t² = sd_t²/n_t + (standard error of the model at the centre)², so that each target is weighted by how precisely
it is measured and modelled; ties (a valley of equal J) are broken by the distance to the measured parameters. This is
weighted least squares on response surfaces. The desirability of Derringer & Suich 1980 is reported as well, with the
margins of equivalence as its limits; it is not maximised, because outside a margin it has no slope.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy import stats
from scipy.optimize import minimize

from doe.analysis.joint_posterior import least_error
from doe.analysis.level_set import REFINEMENTS, crossings, extremes, nearest_points
from doe.analysis.surface import Surface, fitted_coefficients, quadratic_form
from doe.analysis.surface_anova import analyse_surface
from doe.errors import StatisticsError
from doe.record import Record
from doe.target import Target

FloatArray = npt.NDArray[np.float64]
Resampling = Literal["replicates within points", "residuals"]

WIDTH_LINES = 81
WIDTH_LINES_4 = 31
CLOUD_REFINEMENTS_4 = 9
"""The same for four or more factors, whose lines form a grid of three or more dimensions, and the number of refinements
of a refit's point there, to about 1e-3 half-widths.
"""
SHARE_LEVELS = 21
TIE = 1e-3
"""Weight of the squared coded distance to the reference, which decides only where the misfit does not."""


@dataclass(frozen=True)
class ResponseTarget(Record):
    """The wanted response, its standard error, and the setting to stay near (natural, (k,))."""

    value: float
    standard_error: float
    reference: FloatArray


@dataclass(frozen=True)
class Optimum(Record):
    """The chosen setting. Arrays of shape (factors,) in natural units unless named coded.

    predicted with its 95 % confidence interval is in the unit of the response, as are the reachable values.
    point_low, point_high: 95 % bootstrap interval of the chosen point; bootstrap_points: shape (refits,
    factors). share_reached: share of refits in which the target is reachable. solution_low, solution_high:
    range of each factor on the surface model = target; solution_share: that range as a share of the cube.
    compatible_share: share of the cube whose mean differs from the target by no more than its 95 % margin.
    """

    names: tuple[str, ...]
    target: float
    target_standard_error: float
    reached: bool
    point_coded: FloatArray
    point: FloatArray
    predicted: float
    predicted_low: float
    predicted_high: float
    reachable_low: float
    reachable_low_at: FloatArray
    reachable_high: float
    reachable_high_at: FloatArray
    reference: FloatArray
    scale: FloatArray
    distance: float
    point_low: FloatArray
    point_high: FloatArray
    bootstrap_points: FloatArray
    resampling: Resampling
    share_reached: float
    solution_low: FloatArray
    solution_high: FloatArray
    solution_share: FloatArray
    unidentified: tuple[str, ...]
    compatible_share: float
    better_than_noise: bool
    statement: str

    def identifies(self, k: int) -> bool:
        """Return whether the target identifies factor ``k``; a target that is out of reach identifies none."""
        return self.reached and self.names[k] not in self.unidentified


@dataclass(frozen=True)
class Compromise(Record):
    """The chosen point (natural and coded), the predictions there, and each target's share of the misfit.

    ``misfit`` is J without the tie-breaker; ``standardised`` the signed (ŷ − T)/s per target.
    """

    point: FloatArray
    point_coded: FloatArray
    predicted: FloatArray
    standardised: FloatArray
    misfit: float
    statement: str
    desirability: FloatArray = field(default_factory=lambda: np.zeros(0))
    """Desirability of each target at the chosen point: 1 at the target, falling linearly to 0 at target ± margin
    (Derringer & Suich 1980, doi 10.1080/00224065.1980.11980968, exponent 1); overall, the weighted geometric mean."""


def find_optimum(
    surface: Surface,
    target: float,
    reference: npt.ArrayLike,
    scale: npt.ArrayLike | None = None,
    refits: int = 1000,
    seed: int = 0,
    unidentified_share: float = 0.5,
    target_standard_error: float = 0.0,
) -> Optimum:
    """Return the point of {model = target} nearest to the reference, with its uncertainty.

    reference, scale: natural units, shape (factors,); by default the scale is the half-width of the region,
    so that distance is measured in coded units. A factor counts as unidentified when it can take at least
    `unidentified_share` of its range while the model stays at the target. When the target cannot be reached,
    the point is where the model comes nearest to it. target_standard_error: of the measured mean, unit of the
    response; every refit draws its own target from it.

    Raises StatisticsError for wrong shapes, a scale that is not positive or refits < 500.
    """
    region, k = surface.region, len(surface.names)
    natural_reference = _vector("reference", reference, k)
    natural_scale = region.half_width.copy() if scale is None else _vector("scale", scale, k)
    if not (natural_scale > 0).all():
        raise StatisticsError(f"scale = {natural_scale.tolist()} must be positive")
    if refits < 500:
        raise StatisticsError(f"refits = {refits}; a 95 % interval needs at least 500")
    coded_reference, coded_scale = region.coded(natural_reference), natural_scale / region.half_width

    fitted = surface.coefficients[None, :]
    points, reachable = nearest_points(fitted, target, coded_reference, coded_scale)
    point, reached = points[0], bool(reachable[0])
    resampled, resampling = bootstrap_coefficients(surface, refits, seed)
    # A separate random stream: the refits stay the same whether or not the target is uncertain.
    drawn = target + target_standard_error * np.random.default_rng([seed, 1]).standard_normal(refits)
    refinements = REFINEMENTS if k < 4 else CLOUD_REFINEMENTS_4
    cloud, cloud_reached = nearest_points(resampled, drawn, coded_reference, coded_scale, refinements)
    low, high = np.percentile(cloud, [2.5, 97.5], axis=0)
    bounds = extremes(fitted, k)
    solution_low, solution_high = solution_range(surface, target)
    share = np.nan_to_num((solution_high - solution_low) / 2)
    unidentified = tuple(name for name, part in zip(surface.names, share, strict=True) if part >= unidentified_share)
    interval_low, interval_high = surface.confidence_interval(point)
    found = Optimum(
        names=surface.names,
        target=target,
        target_standard_error=target_standard_error,
        reached=reached,
        point_coded=point,
        point=region.natural(point),
        predicted=float(surface.predict(point)),
        predicted_low=float(interval_low),
        predicted_high=float(interval_high),
        reachable_low=float(bounds.low[0]),
        reachable_low_at=region.natural(bounds.low_at[0]),
        reachable_high=float(bounds.high[0]),
        reachable_high_at=region.natural(bounds.high_at[0]),
        reference=natural_reference,
        scale=natural_scale,
        distance=float(np.sqrt((((point - coded_reference) / coded_scale) ** 2).sum())),
        point_low=region.natural(low),
        point_high=region.natural(high),
        bootstrap_points=region.natural(cloud),
        resampling=resampling,
        share_reached=float(cloud_reached.mean()),
        solution_low=region.natural(solution_low),
        solution_high=region.natural(solution_high),
        solution_share=share,
        unidentified=unidentified,
        compatible_share=compatible_share(surface, target, target_standard_error),
        better_than_noise=analyse_surface(surface).better_than_noise,
        statement="",
    )
    return replace(found, statement=_statement(found))


def find_compromise(models: Sequence[Surface], targets: Sequence[Target], reference: npt.ArrayLike) -> Compromise:
    """Minimise J over the cube, starting from the 27 points of a 3-level grid (deterministic; L-BFGS-B)."""
    region = models[0].region
    k = len(region.names)
    home = region.coded(np.asarray(reference, dtype=float))
    centre = np.zeros((1, k))
    spread = np.array(
        [
            max(math.hypot(t.standard_error, float(m.standard_error(centre)[0])), least_error(m, t))
            for m, t in zip(models, targets, strict=True)
        ]
    )
    weight = np.array([t.weight for t in targets])
    goal = np.array([t.mean for t in targets])

    level, slope, curvature = quadratic_form(np.array([m.coefficients for m in models]), k)

    def residuals(x: FloatArray) -> FloatArray:
        return np.asarray((level + slope @ x + curvature @ x @ x - goal) / spread)

    def cost(x: FloatArray) -> tuple[float, FloatArray]:
        """J with the tie-breaker, and its gradient."""
        missed, away = residuals(x), x - home
        rise = (slope + 2.0 * curvature @ x) / spread[:, None]
        return float(weight @ missed**2 + TIE * away @ away), 2.0 * ((weight * missed) @ rise + TIE * away)

    starts = [np.array(x, dtype=float) for x in product((-0.9, 0.0, 0.9), repeat=k)]
    best = min((minimize(cost, x, jac=True, bounds=[(-1.0, 1.0)] * k) for x in starts), key=lambda found: found.fun)
    missed = residuals(best.x)
    misfit = float(weight @ missed**2)
    worst = int(np.argmax(np.abs(missed)))
    statement = f"The targets are missed by at most {abs(missed[worst]):.1f} standard errors (target {worst + 1})."
    if abs(missed[worst]) > 2.0:
        statement += " They contradict each other within this model and region."
    if np.ptp(weight) > 0.0:
        statement += " The weights move this setting, not the 95 % intervals."
    predicted = missed * spread + goal
    margin = np.array([t.margin for t in targets])
    return Compromise(
        point=region.natural(best.x),
        point_coded=np.asarray(best.x),
        predicted=predicted,
        standardised=missed,
        misfit=misfit,
        statement=statement,
        desirability=np.maximum(0.0, 1.0 - np.abs(predicted - goal) / margin),
    )


def solution_range(surface: Surface, target: float) -> tuple[FloatArray, FloatArray]:
    """Return the least and greatest coded value of each factor on {model = target}, each of shape (factors,).

    Sampled by axis-parallel lines 2/80 apart (2/30 for four or more factors); NaN if the cube contains no such point.
    """
    k = len(surface.names)
    lines = WIDTH_LINES if k < 4 else WIDTH_LINES_4
    points, valid = crossings(surface.coefficients[None, :], target, np.zeros((1, k)), 1.0, lines)
    found = points[0][valid[0]]
    if not len(found):
        return np.full(k, np.nan), np.full(k, np.nan)
    return found.min(axis=0), found.max(axis=0)


def compatible_share(surface: Surface, target: float, target_standard_error: float = 0.0, level: float = 0.95) -> float:
    """Return the share of the cube where |model - target| <= t(level) standard errors, on a 21^k grid of cells.

    The standard error is that of the difference: sqrt(se(model)^2 + target_standard_error^2), with the degrees of
    freedom of the surface.
    """
    k = len(surface.names)
    middles = (np.arange(SHARE_LEVELS) + 0.5) * 2 / SHARE_LEVELS - 1
    grid = np.array(list(product(middles, repeat=k)))
    error = np.hypot(surface.standard_error(grid), target_standard_error)
    margin = stats.t.ppf((1 + level) / 2, surface.df_residual) * error
    return float((np.abs(surface.predict(grid) - target) <= margin).mean())


def bootstrap_coefficients(surface: Surface, refits: int, seed: int) -> tuple[FloatArray, Resampling]:
    """Return coefficients of `refits` resampled fits, shape (refits, p), and what was resampled.

    With two or more runs at every distinct point the replicates are drawn within their point; deviations from
    the point's mean are scaled by sqrt(n/(n - 1)), because n values underestimate their variance by that
    factor. Otherwise residuals are drawn over all runs, scaled by 1/sqrt(1 - leverage) and centred.
    """
    generator = np.random.default_rng(seed)
    if np.bincount(surface.point_of_run).min() >= 2:
        resampled, method = _within_points(surface, refits, generator), "replicates within points"
    else:
        resampled, method = _residuals(surface, refits, generator), "residuals"
    coefficients = np.zeros((refits, surface.coefficients.size))
    fitted = fitted_coefficients(surface.model_matrix, resampled).T
    coefficients[:, surface.included] = fitted[:, : int(surface.included.sum())]
    return coefficients, method  # type: ignore[return-value]


def _statement(found: Optimum) -> str:
    """Return the result in one or two sentences."""
    target, unidentified = found.target, found.unidentified
    place = ", ".join(f"{name} = {value:.4g}" for name, value in zip(found.names, found.point, strict=True))
    if found.reached and unidentified:
        ranges = ", ".join(
            f"{name} in {low:.4g} … {high:.4g}"
            for name, low, high in zip(found.names, found.solution_low, found.solution_high, strict=True)
            if name in unidentified
        )
        text = f"The target {target:.4g} does not identify {', '.join(unidentified)}: the model gives it with {ranges}"
        text += " (not in every combination). " if len(unidentified) > 1 else ". "
        text += f"Chosen by rule, nearest to the reference among the settings that give the target: {place}."
    elif found.reached:
        text = f"The model gives {target:.4g} at {place}, the solution nearest to the reference."
    else:
        text = f"The model does not reach {target:.4g} in the region; "
        text += f"its nearest value is {found.predicted:.4g} at {place}."
    if not found.better_than_noise:
        text += " The surface is not better than noise, so this point is not a calibration."
    return text


def _vector(name: str, values: npt.ArrayLike, k: int) -> FloatArray:
    vector = np.asarray(values, dtype=np.float64)
    if vector.shape != (k,) or not np.isfinite(vector).all():
        raise StatisticsError(f"{name} = {vector.tolist()} must hold {k} finite numbers")
    return vector


def _within_points(surface: Surface, refits: int, generator: np.random.Generator) -> FloatArray:
    """Return resampled responses, shape (runs, refits)."""
    resampled = np.empty((surface.observed.size, refits))
    for point in range(int(surface.point_of_run.max()) + 1):
        runs = np.flatnonzero(surface.point_of_run == point)
        mean = surface.observed[runs].mean()
        deviations = (surface.observed[runs] - mean) * np.sqrt(runs.size / (runs.size - 1))
        resampled[runs] = mean + generator.choice(deviations, size=(runs.size, refits))
    return resampled


def _residuals(surface: Surface, refits: int, generator: np.random.Generator) -> FloatArray:
    """Return resampled responses, shape (runs, refits); runs of leverage one have no residual."""
    free = surface.leverage < 1 - 1e-9
    scaled = (surface.observed - surface.predicted)[free] / np.sqrt(1 - surface.leverage[free])
    draws = generator.choice(scaled - scaled.mean(), size=(surface.observed.size, refits))
    return np.asarray(surface.predicted[:, None] + draws)
