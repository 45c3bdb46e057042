"""The response surface in space: as a height over two factors, and the settings that give the target among three."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from explorer.report.content import Spec
from explorer.report.figures.model import FittedTarget
from explorer.report.figures.style import (
    BELOW_TO_ABOVE,
    CHOSEN,
    CLOUD,
    FACTOR,
    INK,
    TARGET,
    Json,
    axis,
    chart,
    label,
)
from explorer.report.units_for_people import axis_title, observable_title, unit_of_observable, unit_of_parameter

GRID = 25
CUBE = 17
"""Points along each side of the grids."""


def height_over(fitted: FittedTarget, pair: tuple[int, int]) -> Spec:
    """The model over two factors, the others at the optimum, with the observed runs above it."""
    model, region, unit, (i, j) = fitted.model, fitted.model.region, unit_of_observable(fitted.observable), pair
    sides = np.linspace(-1.0, 1.0, GRID)
    coded = np.broadcast_to(region.coded(fitted.section_point), (GRID, GRID, region.centre.size)).copy()
    coded[..., i], coded[..., j] = np.meshgrid(sides, sides)
    heights = model.predict(coded) / unit.size
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
    same = {"isomin": target, "isomax": target, "surface": {"count": 1}, "caps": _no_caps()}
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


def _no_caps() -> Json:
    return {side: {"show": False} for side in "xyz"}
