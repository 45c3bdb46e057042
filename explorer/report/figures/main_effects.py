"""Main effects: the mean of the response at the low and at the high level of each factor."""

from __future__ import annotations

import math

from explorer.report.content import Spec
from explorer.report.figures.effects import EffectsOf
from explorer.report.figures.style import DUMMY, FACTOR, Json, axis, chart, error_bars, label, line, points, suffix
from explorer.report.units_for_people import observable_title, parameter_label, unit_of_observable

MOST = 8
"""Factors that are drawn, those with the largest effects."""
ACROSS = 4
GAP = 0.03
ROW_GAP = 0.16


def main_effects(screening: EffectsOf) -> Spec | None:
    """Small charts with one axis, the largest effects first; None where no effect could be estimated.

    The interval of a level's mean follows from that of the effect e = ȳ(high) − ȳ(low) of a balanced design: its half
    width is that of e divided by √2.
    """
    analysis, unit = screening.analysis, unit_of_observable(screening.response)
    effects = analysis.factor_effects()[:MOST]
    if not effects or math.isnan(analysis.mean):
        return None
    words = {factor.name: parameter_label(factor.path) for factor in screening.factors}
    middle = unit.of(analysis.mean)
    traces: list[Json] = []
    layout: Json = {"showlegend": False, "shapes": [], "annotations": []}
    rows = -(-len(effects) // ACROSS)
    for k, effect in enumerate(effects):
        shift = 0.5 * unit.of(effect.effect)
        width = unit.of(analysis.half_width(effect)) / 2**0.5
        place = {"xaxis": f"x{suffix(k)}", "yaxis": f"y{suffix(k)}"}
        drawn = {"mode": "lines+markers", "line": line(FACTOR), "error_y": error_bars([width, width], FACTOR)}
        name = effect.name
        # A name that spells its parameter out needs no second wording.
        title = name.replace("_", " ") if "_" in name else f"{name} · {words[name]}"
        hover = {"hovertemplate": label(name) + " %{x}: %{y:.2f}" + unit.symbol + "<extra></extra>"}
        traces.append(
            points(["low", "high"], [middle - shift, middle + shift], name, FACTOR, **drawn, **place, **hover)
        )
        layout |= _place(k, rows, title)
        layout["shapes"].append(
            {"type": "line", "xref": f"x{suffix(k)} domain", "yref": f"y{suffix(k)}", "x0": 0, "x1": 1}
            | {"y0": middle, "y1": middle, "line": line(DUMMY, "dot")}
        )
    layout["yaxis"]["title"] = {"text": observable_title(screening.response)}
    return chart(traces, layout, 230 * rows)


def _place(k: int, rows: int, title: str) -> Json:
    width, height = (1.0 - GAP * (ACROSS - 1)) / ACROSS, (1.0 - ROW_GAP * (rows - 1)) / rows
    column, row = k % ACROSS, k // ACROSS
    left, top = column * (width + GAP), 1.0 - row * (height + ROW_GAP)
    x = axis(title, domain=[left, left + width], anchor=f"y{suffix(k)}", range=[-0.4, 1.4])
    x["title"]["font"] = {"size": 10}
    y = axis("", domain=[max(0.0, top - height), top], anchor=f"x{suffix(k)}", showticklabels=column == 0)
    return {f"xaxis{suffix(k)}": x, f"yaxis{suffix(k)}": y | ({"matches": "y"} if k else {})}
