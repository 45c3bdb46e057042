"""The profiler: the model along each factor through one point, with its interval, and the target."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from explorer.report.content import Spec
from explorer.report.figures.model import FittedTarget
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
from explorer.units import axis_title, observable_title, unit_of_observable, unit_of_parameter

TRACE_POINTS = 31
ROW_GAP = 0.13
"""Space between two rows, for the title of the axis [share of the height]."""


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


def prediction(fitted: FittedTarget, natural: Sequence[float]) -> tuple[float, float]:
    """Mean of the model at ``natural`` (SI) and half its 95 % interval, in the unit of the screen."""
    here, unit = fitted.model.region.coded(natural), unit_of_observable(fitted.observable)
    return unit.of(float(fitted.model.predict(here))), unit.of(float(fitted.model.half_width(here)))


def _goal(row: int, goal: float, margin: float) -> list[Json]:
    """The target across a row, with its margin."""
    domain = {"xref": f"x{suffix(row)} domain", "yref": f"y{suffix(row)}", "x0": 0, "x1": 1}
    return [
        {"type": "rect", **domain, "y0": goal - margin, "y1": goal + margin, "fillcolor": MARGIN_BAND}
        | {"line": {"width": 0}, "layer": "below"},
        {"type": "line", **domain, "y0": goal, "y1": goal, "line": line(TARGET, "dash")},
    ]


def _row(row: int, rows: int, title: str, limits: list[float]) -> Json:
    gap = min(ROW_GAP, 0.5 / rows)  # the rows keep at least half of the height, however many
    height = (1.0 - gap * (rows - 1)) / rows
    top = 1.0 - row * (height + gap)
    return {
        f"xaxis{suffix(row)}": axis(title, anchor=f"y{suffix(row)}"),
        f"yaxis{suffix(row)}": axis("", anchor=f"x{suffix(row)}", domain=[max(0.0, top - height), top], range=limits),
    }
