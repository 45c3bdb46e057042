"""The response surface of one target with what charts mark on it (runs, target, reference, optimum), and its profiler.

A study's surface and that of a design from any laboratory are drawn by the same charts; both come as `FittedTarget`.
The profiler is the model along each factor through one point, with its interval, and the target.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.analysis.surface import Surface
from doe.analysis.surface_anova import SurfaceAnova
from doe.stages.surface import OptimumResult, SurfaceResult
from doe.studies.study import Factor
from doe.studies.study_result import AnyStudy
from doe.target import Target
from explorer.report.content import Spec
from explorer.report.figures.style import (
    CHOSEN,
    FACTOR,
    INTERVAL_BAND,
    MARGIN_BAND,
    TARGET,
    Json,
    axis,
    chart,
    line,
    points,
    suffix,
)
from explorer.report.identified import BY_RULE, all_identified
from explorer.units import axis_title, observable_title, unit_of_observable, unit_of_parameter

Array = npt.NDArray[np.float64]

TRACE_POINTS = 31
"""Points along each factor of the profiler."""
ROW_GAP = 0.13
"""Space between two rows of the profiler, for the title of the axis [share of the height]."""


@dataclass(frozen=True)
class FittedTarget:
    """Natural values in SI, the response in the unit of the store; k factors."""

    model: Surface
    anova: SurfaceAnova
    factors: tuple[Factor, ...]
    design: Array
    """Natural levels of the points of the design, shape (points, k)."""
    observable: str
    target: float | None
    margin: float
    optimum: OptimumResult | None
    reference_name: str = "measured parameters"
    """What the reference values of the factors are called."""

    @property
    def low(self) -> Array:
        """Lower end of the region, shape (k,)."""
        return self.model.region.centre - self.model.region.half_width

    @property
    def high(self) -> Array:
        """Upper end of the region, shape (k,)."""
        return self.model.region.centre + self.model.region.half_width

    @property
    def chosen(self) -> list[float] | None:
        """The optimum in the order of the factors (natural); None before there is one."""
        return None if self.optimum is None else [self.optimum.values[factor.path] for factor in self.factors]

    @property
    def chosen_name(self) -> str:
        """What the chosen point is called."""
        return "optimum" if self.optimum is None or all_identified(self.optimum) else BY_RULE

    @property
    def section_point(self) -> list[float]:
        """Where sections through the surface are laid (natural): the optimum, or the middle of the region before it."""
        return self.chosen or self.model.region.centre.tolist()


def fitted_targets(result: AnyStudy) -> tuple[FittedTarget, ...]:
    """One per target of a study; none before its surface."""
    if result.surface is None:
        return ()
    return tuple(_fitted(result.surface, k, target, result.optimum) for k, target in enumerate(result.study.targets))


def _fitted(surface: SurfaceResult, k: int, target: Target, optimum: OptimumResult | None) -> FittedTarget:
    return FittedTarget(
        model=surface.models[k],
        anova=surface.anova[k],
        factors=surface.factors,
        design=surface.natural,
        observable=target.observable,
        target=target.mean,
        margin=target.margin,
        optimum=optimum,
    )


def profiler(fitted: FittedTarget, natural: Sequence[float]) -> Spec:
    """One row per factor: the mean of the target over its range, the others at ``natural`` (SI), band 95 %."""
    factors, unit = fitted.factors, unit_of_observable(fitted.observable)
    here = fitted.model.region.coded(natural)
    k, coded = len(factors), np.linspace(-1.0, 1.0, TRACE_POINTS)
    along = np.broadcast_to(here, (k, TRACE_POINTS, k)).copy()
    for row in range(k):
        along[row, :, row] = coded
    means = fitted.model.predict(along) / unit.size
    widths = fitted.model.half_width(along) / unit.size
    height = unit.of(float(fitted.model.predict(here)))
    traces: list[Json] = []
    layout: Json = {"showlegend": False, "shapes": []}
    goal = None if fitted.target is None else unit.of(fitted.target)
    ends = [float(np.min(means - widths)), float(np.max(means + widths)), *([] if goal is None else [goal])]
    room = 0.05 * (max(ends) - min(ends))
    region = fitted.model.region
    for row, factor in enumerate(factors):
        size = unit_of_parameter(factor.path).size
        x = ((region.centre[row] + region.half_width[row] * coded) / size).tolist()
        at = natural[row] / size
        low, high = (means[row] - widths[row]).round(5).tolist(), (means[row] + widths[row]).round(5).tolist()
        place: Json = {"xaxis": f"x{suffix(row)}", "yaxis": f"y{suffix(row)}"}
        band: Json = {"type": "scatter", "mode": "lines", "fill": "toself", "fillcolor": INTERVAL_BAND}
        traces += [
            band | place | {"x": x + x[::-1], "y": high + low[::-1], "line": {"width": 0}, "hoverinfo": "skip"},
            {"type": "scatter", "mode": "lines", "x": x, "y": means[row].round(5).tolist(), "line": line(FACTOR)}
            | place
            | {"hovertemplate": "%{x:.4g}: %{y:.2f}<extra></extra>"},
            points([at], [height], "here", CHOSEN, marker={"size": 10}, **place),
        ]
        layout |= _row(row, k, axis_title(factor.path, factor.name), [min(ends) - room, max(ends) + room])
        if goal is not None:
            layout["shapes"] += _goal(row, goal, unit.of(fitted.margin))
    layout["yaxis"]["title"] = {"text": observable_title(fitted.observable)}
    return chart(traces, layout, 170 * k)


def _row(row: int, rows: int, title: str, limits: list[float]) -> Json:
    gap = min(ROW_GAP, 0.5 / rows)  # the rows keep at least half of the height, however many
    height = (1.0 - gap * (rows - 1)) / rows
    top = 1.0 - row * (height + gap)
    return {
        f"xaxis{suffix(row)}": axis(title, anchor=f"y{suffix(row)}"),
        f"yaxis{suffix(row)}": axis("", anchor=f"x{suffix(row)}", domain=[max(0.0, top - height), top], range=limits),
    }


def _goal(row: int, goal: float, margin: float) -> list[Json]:
    """The target across a row, with its margin."""
    domain = {"xref": f"x{suffix(row)} domain", "yref": f"y{suffix(row)}", "x0": 0, "x1": 1}
    return [
        {"type": "rect", **domain, "y0": goal - margin, "y1": goal + margin, "fillcolor": MARGIN_BAND}
        | {"line": {"width": 0}, "layer": "below"},
        {"type": "line", **domain, "y0": goal, "y1": goal, "line": line(TARGET, "dash")},
    ]


def prediction(fitted: FittedTarget, natural: Sequence[float]) -> tuple[float, float]:
    """Mean of the model at ``natural`` (SI) and half its 95 % interval, in the unit of the screen."""
    here, unit = fitted.model.region.coded(natural), unit_of_observable(fitted.observable)
    return unit.of(float(fitted.model.predict(here))), unit.of(float(fitted.model.half_width(here)))
