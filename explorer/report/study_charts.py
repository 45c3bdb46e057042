"""The charts for which a study's result, complete or partial, has content: chosen by title, then drawn."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import combinations

from doe.analysis.screening import ErrorSource
from doe.stages.screening import ScreeningResult
from doe.stages.surface import OptimumResult
from doe.studies.study_result import AnyStudy
from explorer.report.content import Spec
from explorer.report.figures.effects import all_effects, errors_at_hand, half_normal, main_effects, pareto_against
from explorer.report.figures.model import MOST_PANELS, FittedTarget, cloud, fitted_targets, ranges
from explorer.report.figures.posterior import corner, overlaid
from explorer.report.figures.pours import ascent_path, noise_of_estimators, scan, verification
from explorer.report.figures.style import short_rows, stacked
from explorer.report.figures.surface import contours, fit, height_over, residual_quantiles, solutions
from explorer.report.identified import cloud_caution
from explorer.units import observable_label


@dataclass(frozen=True)
class Plot:
    """``make`` gives the chart, ``caption`` says what its marks mean, ``aspect`` is height over width."""

    make: Callable[[], Spec | None]
    caption: str
    aspect: float = 0.85


Plots = dict[str, Plot]
"""Title → plot, in the order of the selection list."""

Named = Iterator[tuple[str, Plot]]
FEWEST_SEEDS = 4
"""Seeds of the pilot from which its noise is drawn: the interval of σ then ends at 3.7 times σ (χ², 3 degrees)."""


def study_plots(result: AnyStudy) -> Plots:
    """Title → plot of every stage present, in the order of the stages."""
    makers = (_pilot, _screening, _scan, _ascent, _surface, _optimum, _verification)
    return {title: plot for plots in makers for title, plot in plots(result)}


def _pilot(result: AnyStudy) -> Named:
    pilot = result.pilot
    # The interval of σ over two seeds reaches up to 32 times σ: a chart of that shows nothing.
    if pilot is None or min(noise.runs for noise in pilot.noise.values()) < FEWEST_SEEDS:
        return
    caption = "Whiskers: 95 % intervals; bias: its range over the ways to fill a cone with bodies."
    yield "Noise of the estimators", Plot(lambda: short_rows(stacked(noise_of_estimators(pilot))), caption, 1.7)


def _screening(result: AnyStudy) -> Named:
    part = result.screening
    if part is None:
        return
    for error in errors_at_hand(part.analysis):
        caption = "Dashed: limit for one factor (t, 95 %); solid: for all factors at once (Bonferroni). Grey: dummies."
        yield f"Pareto of effects, by {error}", Plot(partial(_pareto, part, error), caption, 1.5)
    if any(math.isfinite(effect.effect) for effect in part.analysis.effects):
        caption = "Effects of pure noise lie on a line through zero; Lenth's margins, 95 %."
        yield "Half-normal", Plot(partial(half_normal, part), caption)
        yield "Main effects", Plot(partial(main_effects, part), "The largest ones; whiskers: 95 %; dotted: mean.", 1.1)
        # The chart of all effects also shows the assumptions once they exist.
        caption = "Low → high, each over its own range, 95 % intervals; hollow: too few bodies to be tested."
        yield "Effects with intervals", Plot(lambda: short_rows(all_effects(part, result.assumptions)), caption, 1.6)


def _scan(result: AnyStudy) -> Named:
    if result.scan is not None:
        caption = "Band: the target, and how far off still counts as met."
        yield "Scan of an assumption", Plot(partial(scan, result.scan, result.study.targets[0]), caption)


def _ascent(result: AnyStudy) -> Named:
    if result.ascent is not None:
        caption = "Band: the target, and how far off still counts as met; dotted: what the screening predicted."
        # A result from before there were several walks has one, whatever its targets.
        for seen, target, of in zip(result.ascent.walks, result.study.targets, _of_targets(result), strict=False):
            yield f"Ascent path{of}", Plot(partial(ascent_path, result.ascent, seen, target), caption)


def _surface(result: AnyStudy) -> Named:
    for fitted, of in zip(fitted_targets(result), _of_targets(result), strict=False):
        yield from surface_plots(fitted, of)


def surface_plots(fitted: FittedTarget, of: str = "") -> Named:
    """Title → plot of a response surface; ``of`` ends the titles."""
    names = [factor.name for factor in fitted.factors]
    if 1 < len(names) <= MOST_PANELS:
        caption = "The others at the optimum, or the middle before there is one. Thick line: model = target."
        yield f"Contours{of}", Plot(lambda: stacked(contours(fitted)), caption, 2.2)
    for i, j in combinations(range(len(names)), 2):
        caption = "Observed pours are drawn at their own height, whatever the other factor was."
        title = f"Surface in 3-D, {names[i]} and {names[j]}{of}"
        yield title, Plot(partial(height_over, fitted, (i, j)), caption, 0.95)
    caption = "Points on the line: the model gives what was poured. Below: what is left, in its own spread."
    yield f"Predicted and observed{of}", Plot(lambda: stacked(fit(fitted)), caption, 1.5)
    caption = "Residuals of a right model with normal noise lie on the line."
    yield f"Residual quantiles{of}", Plot(partial(residual_quantiles, fitted), caption)
    if len(names) == 3:
        caption = "Every setting on the green sheet gives the target: one angle cannot fix three factors."
        yield f"Solution surface{of}", Plot(partial(solutions, fitted), caption, 0.95)


def _optimum(result: AnyStudy) -> Named:
    found = result.optimum
    if found is None:
        return
    targets = fitted_targets(result)
    if len(targets) > 1:
        caption = "Full: the model gives the target; dotted: as far off as still counts as met; filled: all are met."
        yield "Targets over each other", Plot(lambda: stacked(overlaid(targets)), caption, 2.2)
    if (joint := found.posterior) is not None:
        told = "all targets leave" if len(targets) > 1 else "the target leaves"
        caption = f"What {told} of the factors on the fitted surface; bands: 95 %; darker: likelier."
        yield "Posterior of the factors", Plot(partial(corner, joint, found.factors), caption, 0.95)
    yield from optimum_plots(targets[0], found)


def optimum_plots(fitted: FittedTarget, optimum: OptimumResult) -> Named:
    """Title → plot of how well the optimum of a surface is known."""
    if 1 < len(fitted.factors) <= MOST_PANELS:
        caption = f"Each dot: the point chosen from one resampling. {cloud_caution(optimum)}".rstrip()
        yield "Optimum and its refits", Plot(lambda: stacked(cloud(fitted)), caption, 2.0)
    caption = "Shares of the screened ranges."
    yield "Ranges of the optimum", Plot(lambda: short_rows(ranges(fitted)), caption, 0.9)


def _verification(result: AnyStudy) -> Named:
    if result.verification is not None:
        for index, of in enumerate(_of_targets(result)):
            caption = "Band: around the measured mean, how far off still counts as met."
            yield f"Verification{of}", Plot(partial(verification, result.verification, index), caption)


def _pareto(screening: ScreeningResult, error: ErrorSource) -> Spec:
    return short_rows(pareto_against(screening, [error]))


def _of_targets(result: AnyStudy) -> list[str]:
    """Ends of titles: the name of each target if there are several."""
    targets = result.study.targets
    return [""] if len(targets) == 1 else [f": {observable_label(target.observable)}" for target in targets]
