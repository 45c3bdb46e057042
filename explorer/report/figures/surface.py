"""Charts of a response surface: contours through the optimum, the fit and its residuals, and the surface in space.

In space, it is a height over two factors, or the settings of three factors that give the target.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy import stats

from explorer.report.content import Spec
from explorer.report.figures.model import Array, FittedTarget, PairPanel, chosen_star, pair_panels
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
    rounded,
    side_by_side,
)
from explorer.units import axis_title, counted, observable_title, unit_of_observable, unit_of_parameter

GRID, SOLID_GRID, CUBE = 41, 25, 17
"""Points along each side of the grids: in a plane, for a height in space, for a body in space."""


def contours(fitted: FittedTarget) -> Spec:
    """The surface of a target over each pair of factors, the others at the optimum (before it: the middle).

    Runs of the design are projected onto each panel; the thick line, if there is a target, is where the model gives it.
    """
    unit = unit_of_observable(fitted.observable)
    panels, axes = pair_panels(fitted)
    grids = [section(fitted, panel.pair, GRID) / unit.size for panel in panels]
    level = float(np.mean(grids)) if fitted.target is None else unit.of(fitted.target)
    reach = max(float(np.abs(grid - level).max()) for grid in grids) or 1.0
    traces: list[Json] = []
    for panel, grid in zip(panels, grids, strict=True):
        x, y = sides(fitted, panel, GRID)
        shared: Json = {"type": "contour", "x": x, "y": y, "z": rounded(grid), **panel.axes}
        traces.append(
            shared
            | {
                "coloraxis": "coloraxis",
                "name": "model",
                "line": {"width": 0.6, "color": "rgba(43, 47, 52, 0.35)"},
                "contours": {"coloring": "heatmap", "showlabels": True, "labelfont": {"size": 10, "color": INK}},
                "hovertemplate": "%{x:.4g}, %{y:.4g}: %{z:.4g}<extra></extra>",
            }
        )
        at_target = {"start": level, "end": level, "size": 1.0, "coloring": "none"}
        line_at_target = (
            shared
            | {"contours": at_target, "line": {"color": TARGET, "width": 4}, "showscale": False, "hoverinfo": "skip"}
            | {"name": "model = target", "showlegend": panel.in_legend}
        )
        traces += [] if fitted.target is None else [line_at_target]
        traces += _marks(fitted, panel)
    return chart(traces, axes | {"coloraxis": _colours(level, reach, observable_title(fitted.observable))}, 420)


def sides(fitted: FittedTarget, panel: PairPanel, points_along: int) -> tuple[list[float], list[float]]:
    """Positions along both sides of a panel, from end to end of the region, in the displayed units."""
    region, coded = fitted.model.region, np.linspace(-1.0, 1.0, points_along)
    x, y = (
        ((region.centre[k] + region.half_width[k] * coded) / size).tolist()
        for k, size in zip(panel.pair, panel.sizes, strict=True)
    )
    return x, y


def section(fitted: FittedTarget, pair: tuple[int, int], side: int) -> Array:
    """The model [SI] on a grid over a pair of factors, ``side`` points each, the first along the columns.

    The other factors are at the point of the section.
    """
    i, j = pair
    fixed = fitted.model.region.coded(fitted.section_point)
    coded = np.broadcast_to(fixed, (side, side, fixed.size)).copy()
    coded[..., i], coded[..., j] = np.meshgrid(np.linspace(-1, 1, side), np.linspace(-1, 1, side))
    return fitted.model.predict(coded)


def _marks(fitted: FittedTarget, panel: PairPanel) -> list[Json]:
    """Runs of the design, the measured parameters if they lie in the region, and the optimum if there is one."""
    pair, sizes = list(panel.pair), np.array(panel.sizes)
    natural = fitted.design[:, pair] / sizes
    reference = np.array([float(fitted.factors[k].reference) for k in pair]) / sizes
    low, high = fitted.low[pair] / sizes, fitted.high[pair] / sizes
    runs = {"size": 7, "color": "#ffffff", "line": {"color": INK, "width": 1.2}}
    diamond = {"size": 10, "symbol": "diamond", "color": "#ffffff", "line": {"color": INK, "width": 1.5}}
    shown: Json = panel.axes | {"showlegend": panel.in_legend}
    marks = [points(natural[:, 0].tolist(), natural[:, 1].tolist(), "points of the design", INK, marker=runs, **shown)]
    if ((low <= reference) & (reference <= high)).all():
        x, y = (float(value) for value in reference)
        marks.append(points([x], [y], fitted.reference_name, INK, marker=diamond, **shown))
    return [*marks, *chosen_star(fitted, panel)]


def _colours(level: float, reach: float, title: str) -> Json:
    bar = {"title": {"text": title, "side": "right"}, "thickness": 12, "outlinewidth": 0, "exponentformat": "power"}
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
    """Studentized residuals over the quantiles of t that a correct model would give them, and the line y = x."""
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
        "xaxis": axis(f"quantile of t ({counted(max(1, df - 1), 'degree of freedom')})"),
        "yaxis": axis("studentized residual"),
    }
    return chart(traces, layout, 380)


def height_over(fitted: FittedTarget, pair: tuple[int, int]) -> Spec:
    """The model over two factors, the others at the optimum, with the observed runs above it."""
    model, region, unit, (i, j) = fitted.model, fitted.model.region, unit_of_observable(fitted.observable), pair
    sides = np.linspace(-1.0, 1.0, SOLID_GRID)
    heights = section(fitted, pair, SOLID_GRID) / unit.size
    level = float(heights.mean()) if fitted.target is None else unit.of(fitted.target)
    reach = float(np.abs(heights - level).max()) or 1.0
    sizes = [unit_of_parameter(fitted.factors[k].path).size for k in pair]
    x, y = (((region.centre[k] + region.half_width[k] * sides) / s).tolist() for k, s in zip(pair, sizes, strict=True))
    at = region.natural(model.points)
    traces: list[Json] = [
        {"type": "surface", "x": x, "y": y, "z": rounded(heights), "colorscale": BELOW_TO_ABOVE}
        | {"cmin": level - reach, "cmax": level + reach, "showscale": False, "opacity": 0.85, "name": "model"}
        | {"contours": {"z": {"show": True, "start": level, "end": level, "size": 1, "color": TARGET, "width": 6}}}
        | {"hovertemplate": "%{x:.4g}, %{y:.4g}: %{z:.4g}<extra>model</extra>"},
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
    heights = rounded(fitted.model.predict(coded))
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
