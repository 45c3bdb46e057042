"""Charts of a response surface: contours through the optimum, predicted against observed, residuals."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np
from scipy import stats

from explorer.report.content import Spec
from explorer.report.figures.model import Array, FittedTarget
from explorer.report.figures.style import (
    BELOW_TO_ABOVE,
    CHOSEN,
    DUMMY,
    FACTOR,
    INK,
    TARGET,
    Json,
    axis,
    chart,
    finite,
    line,
    points,
    side_by_side,
    suffix,
)
from explorer.report.units_for_people import axis_title, observable_title, unit_of_observable, unit_of_parameter

GRID = 41


def contours(fitted: FittedTarget) -> Spec:
    """The surface of a target over each pair of factors, the others at the optimum (before it: the middle).

    Runs of the design are projected on each panel; the thick line is where the model gives the target, where there is
    one.
    """
    unit, factors, region = unit_of_observable(fitted.observable), fitted.factors, fitted.model.region
    pairs = list(combinations(range(len(factors)), 2))
    grids = [_slice(fitted, i, j) / unit.size for i, j in pairs]
    level = float(np.mean(grids)) if fitted.target is None else unit.of(fitted.target)
    reach = max(float(np.abs(grid - level).max()) for grid in grids) or 1.0
    domains = side_by_side(len(pairs), 0.1)
    traces: list[Json] = []
    layout: Json = {"coloraxis": _colours(level, reach, observable_title(fitted.observable))}
    for panel, (i, j) in enumerate(pairs):
        axes = {"xaxis": f"x{suffix(panel)}", "yaxis": f"y{suffix(panel)}"}
        scale = [unit_of_parameter(factors[k].path).size for k in (i, j)]
        x, y = (
            ((region.centre[k] + region.half_width[k] * np.linspace(-1, 1, GRID)) / size).tolist()
            for k, size in zip((i, j), scale, strict=True)
        )
        shared: Json = {"type": "contour", "x": x, "y": y, "z": np.round(grids[panel], 6).tolist(), **axes}
        traces.append(
            shared
            | {
                "coloraxis": "coloraxis",
                "name": "model",
                "line": {"width": 0.6, "color": "rgba(43, 47, 52, 0.35)"},
                "contours": {"coloring": "heatmap", "showlabels": True, "labelfont": {"size": 10, "color": INK}},
                "hovertemplate": "%{x:.4g}, %{y:.4g}: %{z:.2f}<extra></extra>",
            }
        )
        at_target = {"start": level, "end": level, "size": 1.0, "coloring": "none"}
        line_at_target = (
            shared
            | {"contours": at_target, "line": {"color": TARGET, "width": 4}, "showscale": False, "hoverinfo": "skip"}
            | {"name": "model = target", "showlegend": panel == 0}
        )
        traces += [] if fitted.target is None else [line_at_target]
        traces += _marks(fitted, (i, j), scale, axes, panel == 0)
        layout[f"xaxis{suffix(panel)}"] = axis(
            axis_title(factors[i].path, factors[i].name), domain=domains[panel], anchor=f"y{suffix(panel)}"
        )
        layout[f"yaxis{suffix(panel)}"] = axis(axis_title(factors[j].path, factors[j].name), anchor=f"x{suffix(panel)}")
    return chart(traces, layout, 420)


def fit(fitted: FittedTarget) -> Spec:
    """Left: predicted against observed per run; right: externally studentized residuals over the prediction."""
    unit = unit_of_observable(fitted.observable)
    observed = [unit.of(value) for value in fitted.model.observed.tolist()]
    predicted = [unit.of(value) for value in fitted.model.predicted.tolist()]
    studentized = finite(fitted.anova.studentized_residuals)
    ends = [min(observed + predicted), max(observed + predicted)]
    left, right = side_by_side(2, 0.12)
    residuals = {"xaxis": "x2", "yaxis": "y2", "showlegend": False}
    traces = [
        {
            "type": "scatter",
            "mode": "lines",
            "x": ends,
            "y": ends,
            "name": "predicted = observed",
            "line": line(DUMMY, "dash"),
        },
        points(observed, predicted, "runs of the design", FACTOR, marker={"opacity": 0.75}),
        points(predicted, studentized, "residual", FACTOR, marker={"opacity": 0.75}, **residuals),
    ]
    title = observable_title(fitted.observable)
    layout = {
        "xaxis": axis(f"observed: {title}", domain=left),
        "yaxis": axis("predicted"),
        "xaxis2": axis(f"predicted: {title}", domain=right, anchor="y2"),
        "yaxis2": axis("studentized residual", anchor="x2", zeroline=True, zerolinewidth=1.5),
    }
    return chart(traces, layout, 380)


def residual_quantiles(fitted: FittedTarget) -> Spec:
    """Studentized residuals over the quantiles of t that a right model would give them, and the line y = x."""
    df = fitted.model.df_residual
    known = sorted(r for r in fitted.anova.studentized_residuals.tolist() if math.isfinite(r))
    # Externally studentized residuals follow t with one degree of freedom less than the error.
    wanted = [float(stats.t.ppf((k + 0.5) / len(known), max(1, df - 1))) for k in range(len(known))]
    ends = [min(wanted, default=-1.0), max(wanted, default=1.0)]
    traces = [
        {"type": "scatter", "mode": "lines", "x": ends, "y": ends, "name": "as expected", "line": line(DUMMY, "dash")},
        points(wanted, known, "runs of the design", FACTOR, marker={"opacity": 0.75}),
    ]
    layout = {
        "xaxis": axis(f"quantile of t ({max(1, df - 1)} degrees of freedom)"),
        "yaxis": axis("studentized residual"),
    }
    return chart(traces, layout, 380)


def _slice(fitted: FittedTarget, i: int, j: int) -> Array:
    """The model on a grid over factors i (columns) and j (rows), the others at the point of the sections."""
    across, up = np.meshgrid(np.linspace(-1, 1, GRID), np.linspace(-1, 1, GRID))
    fixed = fitted.model.region.coded(fitted.section_point)
    coded = np.broadcast_to(fixed, (GRID, GRID, fixed.size)).copy()
    coded[..., i], coded[..., j] = across, up
    return fitted.model.predict(coded)


def _marks(fitted: FittedTarget, pair: tuple[int, int], scale: list[float], axes: Json, in_legend: bool) -> list[Json]:
    """Runs of the design, the measured parameters where they lie in the region, and the optimum if there is one."""
    natural = fitted.design[:, pair] / scale
    reference = np.array([float(fitted.factors[k].reference) for k in pair]) / scale
    low, high = fitted.low[list(pair)] / scale, fitted.high[list(pair)] / scale
    runs = {"size": 7, "color": "#ffffff", "line": {"color": INK, "width": 1.2}}
    star = {"size": 13, "symbol": "star", "line": {"color": "#ffffff", "width": 1}}
    diamond = {"size": 10, "symbol": "diamond", "color": "#ffffff", "line": {"color": INK, "width": 1.5}}
    shown: Json = {"showlegend": in_legend, **axes}
    marks = [points(natural[:, 0].tolist(), natural[:, 1].tolist(), "points of the design", INK, marker=runs, **shown)]
    if ((low <= reference) & (reference <= high)).all():
        x, y = (float(value) for value in reference)
        marks.append(points([x], [y], fitted.reference_name, INK, marker=diamond, **shown))
    if fitted.chosen is None:
        return marks
    at = np.array(fitted.chosen)[list(pair)] / scale
    return [*marks, points([float(at[0])], [float(at[1])], fitted.chosen_name, CHOSEN, marker=star, **shown)]


def _colours(level: float, reach: float, title: str) -> Json:
    bar = {"title": {"text": title, "side": "right"}, "thickness": 12, "outlinewidth": 0}
    return {"colorscale": BELOW_TO_ABOVE, "cmin": level - reach, "cmax": level + reach, "colorbar": bar}
