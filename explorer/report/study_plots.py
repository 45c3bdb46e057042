"""The charts that a study's result, or what there is of it so far, has something for."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from itertools import combinations

from explorer.report.content import Spec
from explorer.report.figures.effects import all_effects, errors_at_hand, half_normal, pareto_against
from explorer.report.figures.main_effects import main_effects
from explorer.report.figures.noise import noise_of_estimators
from explorer.report.figures.optimum import cloud, ranges
from explorer.report.figures.style import short_rows, stacked
from explorer.report.figures.surface import contours, fit, residual_quantiles
from explorer.report.figures.surface_3d import height_over, solutions
from explorer.report.figures.verification import verification
from explorer.report.figures.walks import ascent_path, scan
from explorer.report.findings import ErrorName, Plain
from explorer.report.identified import cloud_caution
from explorer.report.plot import Plot, Plots
from explorer.report.units_for_people import observable_label

Named = Iterator[tuple[str, Plot]]


def study_plots(result: Plain) -> Plots:
    """Title → plot of every stage that is there, in the order of the stages."""
    return {title: plot for stage, plots in STAGES.items() if result.get(stage) for title, plot in plots(result)}


def _pilot(result: Plain) -> Named:
    caption = "Whiskers: 95 % intervals; bias: its range over the ways to fill a cone with bodies."
    yield (
        "Noise of the estimators",
        Plot(lambda: short_rows(stacked(noise_of_estimators(result["pilot"]))), caption, 1.7),
    )


def _screening(result: Plain) -> Named:
    part = result["screening"]
    for error in errors_at_hand(part):
        caption = "Dashed: limit for one factor (t, 95 %); solid: for all factors at once (Bonferroni). Grey: dummies."
        yield f"Pareto of effects, by {error}", Plot(partial(_pareto, part, error), caption, 1.5)
    if any(effect["effect"] is not None for effect in part["analysis"]["effects"]):
        caption = "Effects of pure noise lie on a line through zero; Lenth's margins, 95 %."
        yield "Half-normal", Plot(partial(half_normal, part), caption)
        yield "Main effects", Plot(partial(main_effects, part), "The largest ones; whiskers: 95 %; dotted: mean.", 1.1)
        # The chart of all effects shows the assumptions beside them once they are there.
        beside = result if "assumptions" in result else result | {"assumptions": None}
        caption = "Low → high, each over its own range, 95 % intervals; hollow: too few bodies to be tested."
        yield "Effects with intervals", Plot(lambda: short_rows(all_effects(beside)), caption, 1.6)


def _scan(result: Plain) -> Named:
    yield "Scan of an assumption", Plot(partial(scan, result), "Band: the target and its margin of equivalence.")


def _ascent(result: Plain) -> Named:
    caption = "Band: the target and its margin of equivalence; dotted: what the screening predicted."
    yield "Ascent path", Plot(partial(ascent_path, result), caption)


def _surface(result: Plain) -> Named:
    names = [factor["name"] for factor in result["surface"]["factors"]]
    for index, of in _targets(result, "surface"):
        caption = "The others at the optimum, or the middle before there is one. Thick line: model = target."
        yield f"Contours{of}", Plot(partial(_one_below_the_other, contours, result, index), caption, 2.2)
        for i, j in combinations(range(len(names)), 2):
            caption = "Observed pours are drawn at their own height, whatever the other factor was."
            title = f"Surface in 3-D, {names[i]} and {names[j]}{of}"
            yield title, Plot(partial(height_over, result, index, (i, j)), caption, 0.95)
        caption = "Points on the line: the model gives what was poured. Below: what is left, in its own spread."
        yield f"Predicted and observed{of}", Plot(partial(_one_below_the_other, fit, result, index), caption, 1.5)
        caption = "Residuals of a right model with normal noise lie on the line."
        yield f"Residual quantiles{of}", Plot(partial(residual_quantiles, result, index), caption)
        if len(names) == 3:
            caption = "Every setting on the green sheet gives the target: one angle cannot fix three factors."
            yield f"Solution surface{of}", Plot(partial(solutions, result, index), caption, 0.95)


def _optimum(result: Plain) -> Named:
    yield (
        "Optimum and its refits",
        Plot(
            lambda: stacked(cloud(result)),
            f"Each dot: the point chosen from one resampling. {cloud_caution(result['optimum'])}".rstrip(),
            2.0,
        ),
    )
    yield "Ranges of the optimum", Plot(lambda: short_rows(ranges(result)), "Shares of the screened ranges.", 0.9)


def _verification(result: Plain) -> Named:
    for index, of in _targets(result, "verification"):
        caption = "Band: the margin of equivalence around the measured mean."
        yield f"Verification{of}", Plot(partial(verification, result, index), caption)


def _pareto(screening: Plain, error: ErrorName) -> Spec:
    return short_rows(pareto_against(screening, [error]))


def _one_below_the_other(make: Callable[[Plain, int], Spec], result: Plain, index: int) -> Spec:
    return stacked(make(result, index))


def _targets(result: Plain, stage: str) -> Iterator[tuple[int, str]]:
    """Number of every target, and its name where there are several."""
    targets = result["study"]["targets"]
    for index, target in enumerate(targets):
        yield index, "" if len(targets) == 1 else f": {observable_label(target['observable'])}"


STAGES: dict[str, Callable[[Plain], Named]] = {
    "pilot": _pilot,
    "screening": _screening,
    "scan": _scan,
    "ascent": _ascent,
    "surface": _surface,
    "optimum": _optimum,
    "verification": _verification,
}
