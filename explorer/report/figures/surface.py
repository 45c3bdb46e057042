"""Charts of a response surface: contours through the optimum, the fit and its residuals, and the surface in space.

In space it is a height over two factors, and the settings that give the target among three.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations

import numpy as np
from scipy import stats

from explorer.report.content import Spec
from explorer.report.figures.model import Array, FittedTarget
from explorer.report.figures.style import (
    BELOW_TO_ABOVE,
    CHOSEN,
    CLOUD,
    DUMMY,
    FACTOR,
    INK,
    TARGET,
    Json,
    axis,
    chart,
    finite,
    label,
    line,
    points,
    side_by_side,
    suffix,
)
from explorer.units import axis_title, observable_title, unit_of_observable, unit_of_parameter

GRID, SOLID_GRID, CUBE = 41, 25, 17
"""Points along each side of the grids: in a plane, of a height in space, of a body in space."""


def contours(fitted: FittedTarget) -> Spec:
    """The surface of a target over each pair of factors, the others at the optimum (before it: the middle).

    Runs of the design are projected on each panel; the thick line is where the model gives the target, where there is
    one.
    """
    unit, factors, region = unit_of_observable(fitted.observable), fitted.factors, fitted.model.region
    pairs = list(combinations(range(len(factors)), 2))
    grids = [section(fitted, i, j, GRID) / unit.size for i, j in pairs]
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


def section(fitted: FittedTarget, i: int, j: int, side: int) -> Array:
    """The model [SI] on a grid over factors i (columns), j (rows), ``side`` points each, the others at the section."""
    fixed = fitted.model.region.coded(fitted.section_point)
    coded = np.broadcast_to(fixed, (side, side, fixed.size)).copy()
    coded[..., i], coded[..., j] = np.meshgrid(np.linspace(-1, 1, side), np.linspace(-1, 1, side))
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


def height_over(fitted: FittedTarget, pair: tuple[int, int]) -> Spec:
    """The model over two factors, the others at the optimum, with the observed runs above it."""
    model, region, unit, (i, j) = fitted.model, fitted.model.region, unit_of_observable(fitted.observable), pair
    sides = np.linspace(-1.0, 1.0, SOLID_GRID)
    heights = section(fitted, i, j, SOLID_GRID) / unit.size
    level = float(heights.mean()) if fitted.target is None else unit.of(fitted.target)
    reach = max(float(np.abs(heights - level).max()), 1e-9)
    sizes = [unit_of_parameter(fitted.factors[k].path).size for k in pair]
    x, y = (((region.centre[k] + region.half_width[k] * sides) / s).tolist() for k, s in zip(pair, sizes, strict=True))
    at = region.natural(model.points)
    traces: list[Json] = [
        {"type": "surface", "x": x, "y": y, "z": heights.round(5).tolist(), "colorscale": BELOW_TO_ABOVE}
        | {"cmin": level - reach, "cmax": level + reach, "showscale": False, "opacity": 0.85, "name": "model"}
        | {"contours": {"z": {"show": True, "start": level, "end": level, "size": 1, "color": TARGET, "width": 6}}}
        | {"hovertemplate": "%{x:.4g}, %{y:.4g}: %{z:.2f}<extra>model</extra>"},
        _dots(
            [
                (at[:, i] / sizes[0]).tolist(),
                (at[:, j] / sizes[1]).tolist(),
                [unit.of(value) for value in model.observed.tolist()],
            ],
            "runs",
            {"size": 3.5, "color": FACTOR},
        ),
    ]
    chosen = fitted.chosen
    if chosen is not None:
        height = [unit.of(float(model.predict(region.coded(chosen))))]
        star = {"size": 7, "color": CHOSEN, "symbol": "diamond"}
        traces.append(_dots([[chosen[i] / sizes[0]], [chosen[j] / sizes[1]], height], fitted.chosen_name, star))
    titles = [axis_title(fitted.factors[k].path, fitted.factors[k].name) for k in pair]
    return _in_space(traces, [*titles, observable_title(fitted.observable)])


def solutions(fitted: FittedTarget) -> Spec | None:
    """All settings of three factors at which the model gives the target, with the chosen one and its refits.

    None unless there are three factors and a target.
    """
    factors, target = fitted.factors, fitted.target
    if len(factors) != 3 or target is None:
        return None
    side = np.linspace(-1.0, 1.0, CUBE)
    coded = np.stack(np.meshgrid(side, side, side, indexing="ij"), axis=-1).reshape(-1, 3)
    sizes = np.array([unit_of_parameter(factor.path).size for factor in factors])
    x, y, z = (fitted.model.region.natural(coded) / sizes).T
    heights = fitted.model.predict(coded).round(6).tolist()
    same = {
        "isomin": target,
        "isomax": target,
        "surface": {"count": 1},
        "caps": {edge: {"show": False} for edge in "xyz"},
    }
    colour = [[0.0, TARGET], [1.0, TARGET]]
    traces: list[Json] = [
        {"type": "isosurface", "x": x.tolist(), "y": y.tolist(), "z": z.tolist(), "name": "model = target"}
        | {"value": heights, "colorscale": colour, "showscale": False, "opacity": 0.45}
        | same
        | {"hoverinfo": "skip", "showlegend": True}
    ]
    if fitted.optimum is not None:
        found = fitted.optimum.single
        refits = (found.bootstrap_points / sizes)[::4]
        traces.append(_dots(refits.T.tolist(), "bootstrap refits", {"size": 2, "color": CLOUD}))
        measured, chosen = found.reference / sizes, np.array(fitted.chosen) / sizes
        open_diamond = {"size": 6, "color": "#ffffff", "symbol": "diamond", "line": {"color": INK, "width": 2}}
        traces.append(_dots([[float(v)] for v in measured], fitted.reference_name, open_diamond))
        star = {"size": 7, "color": CHOSEN, "symbol": "diamond"}
        traces.append(_dots([[float(v)] for v in chosen], fitted.chosen_name, star))
    return _in_space(traces, [axis_title(factor.path, factor.name) for factor in factors])


def _dots(places: Sequence[Sequence[float]], name: str, marker: Json) -> Json:
    """Marks at the x, y and z in ``places``."""
    x, y, z = map(list, places)
    place = {"type": "scatter3d", "mode": "markers", "x": x, "y": y, "z": z, "name": label(name), "marker": marker}
    return place | {"hovertemplate": "%{x:.4g}, %{y:.4g}, %{z:.4g}<extra>" + label(name) + "</extra>"}


def _in_space(traces: list[Json], titles: list[str]) -> Spec:
    names = ("xaxis", "yaxis", "zaxis")
    scene = {name: axis(title, tickfont={"size": 10}) for name, title in zip(names, titles, strict=True)}
    for one in scene.values():
        one.pop("automargin")  # axes in space have none
        one["title"]["font"] = {"size": 11}
    camera = {"eye": {"x": 1.5, "y": -1.6, "z": 0.9}}
    return chart(traces, {"scene": scene | {"camera": camera}, "margin": {"l": 4, "r": 4, "t": 28, "b": 4}}, 460)
