"""Charts of a bench test: a laboratory's curves and replicates, and what the solver's instrument read.

Of the laboratory every replicate, with the part that was taken as straight, or the mean with its interval; of the
solver every column against the first.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from doe.laboratory import CurveFit, Derived, Estimate, LabResult
from doe.laboratory.linear_range import LinearRange
from doe.laboratory.result import CONDITIONS
from doe.laboratory.sieve import rosin_rammler, undersize
from doe.laboratory.tables import Reading, by_replicate
from explorer.report.content import Spec
from explorer.report.figures.style import (
    ASSUMPTION,
    CHOSEN,
    FACTOR,
    TARGET,
    Json,
    axis,
    chart,
    error_bars,
    label,
    line,
    points,
)
from explorer.units import ReadingUnit, enumeration, reading_unit

PANEL_HEIGHT = 420
ROW = 34
"""Height of a row of replicates [px]."""
MOST_POINTS = 10_000
"""Of the curves of one chart."""
LEAST_POINTS = 3
"""Fewer readings of the solver's instrument are a few numbers, which the table has, and no curve."""
SAMPLES = (FACTOR, ASSUMPTION, TARGET, CHOSEN)


def curve_charts(result: LabResult) -> dict[str, Spec]:
    """Title → chart per component and quantity; none where the readings are no curves."""
    groups: dict[str, list[CurveFit]] = {}
    for curve in result.curves:
        groups.setdefault(curve_title(curve), []).append(curve)
    return {title: force_displacement(curves, title) for title, curves in groups.items()}


def curve_title(curve: CurveFit) -> str:
    """Whose curve it is, and for what."""
    return f"{'-'.join(curve.of)}, {curve.quantity}"


def force_displacement(curves: list[CurveFit], title: str) -> Spec:
    """Points of every replicate and, over them, the part that counts, straight or Hertzian, drawn on to zero force."""
    traces: list[Json] = []
    step = max(1, -(-sum(len(curve.force) for curve in curves) // MOST_POINTS))
    for curve in curves:
        first = curve is curves[0]
        traces.append(
            {
                "type": "scatter",
                "mode": "markers",
                "x": [1e3 * x for x in curve.displacement[::step]],
                "y": list(curve.force[::step]),
                "name": "points",
                "legendgroup": "points",
                "showlegend": first,
                "marker": {"size": 4, "color": FACTOR, "opacity": 0.5},
                "hovertemplate": f"replicate {label(curve.replicate)}: %{{x:.4g}} mm, %{{y:.4g}} N<extra></extra>",
            }
        )
        x, force = curve.fit.drawn
        traces.append(
            {
                "type": "scatter",
                "mode": "lines",
                "x": [1e3 * at for at in x],
                "y": list(force),
                "name": f"{'straight' if is_straight(curve) else 'Hertzian'} part, on to zero force",
                "legendgroup": "straight",
                "showlegend": first,
                "line": {"color": CHOSEN, "width": 2},
                "hovertemplate": f"replicate {label(curve.replicate)}: {1e-6 * curve.modulus:.4g} MPa<extra></extra>",
            }
        )
    layout: Json = {
        "title": {"text": label(title.replace("_", " "))},
        "xaxis": axis("displacement [mm]"),
        "yaxis": axis("force [N]"),
        "margin": {"l": 60, "r": 24, "t": 80, "b": 52},
    }
    return chart(traces, layout, PANEL_HEIGHT)


def is_straight(curve: CurveFit) -> bool:
    """Whether its part that counts is a line, not Hertz’s law."""
    return isinstance(curve.fit, LinearRange)


def by_unit(result: LabResult) -> list[list[Derived]]:
    """What replicates gave, in groups of one unit, which share a chart."""
    groups: dict[str, list[Derived]] = {}
    for one in result.derived:
        if one.name not in CONDITIONS:
            groups.setdefault(one.unit, []).append(one)
    return list(groups.values())


def _names_of(found: Sequence[Derived]) -> str:
    return enumeration(list(dict.fromkeys(one.name.replace("_", " ") for one in found)))


def replicates(found: Sequence[Derived]) -> Spec:
    """Every replicate with the mean and its interval, a row for each quantity; a single one has no interval."""
    unit = bench_unit(found[0].unit)
    names = dict.fromkeys(one.name for one in found)
    rows = [f"{one.name.replace('_', ' ') if len(names) > 1 else ''} {specimen(one)}".strip() for one in found]
    single: tuple[list[float], list[str], list[str]] = ([], [], [])
    apart: tuple[list[float], list[str], list[str]] = ([], [], [])
    for row, one in zip(rows, found, strict=True):
        for k, (name, value) in enumerate(zip(one.replicates, one.values, strict=True)):
            x, y, told = apart if k in one.summary.outliers else single
            x.append(unit.of(value))
            y.append(label(row))
            told.append(f"replicate {label(name)}")
    seen = "%{y}, %{text}: %{x:.4g}<extra></extra>"
    traces = [
        points(
            x, y, name, colour, text=told, hovertemplate=seen, marker={"size": size, "symbol": symbol, "opacity": 0.6}
        )
        for name, colour, size, symbol, (x, y, told) in (
            ("replicates", FACTOR, 7, "circle", single),
            ("outliers, kept", CHOSEN, 9, "x", apart),
        )
        if x
    ]
    half = [interval(one)[1] / unit.size for one in found]
    means = [unit.of(one.summary.mean) for one in found]
    mean = points(
        means, list(map(label, rows)), "mean, 95 % of it", ASSUMPTION, marker={"size": 10, "symbol": "diamond"}
    )
    traces.append(mean | {"error_x": error_bars(half, ASSUMPTION)})
    title = f"{_names_of(found)} [{unit.symbol}]" if unit.symbol else _names_of(found)
    layout: Json = {
        "xaxis": axis(title),
        "yaxis": axis("", categoryorder="array", categoryarray=list(map(label, rows[::-1]))),
    }
    return chart(traces, layout, 110 + ROW * len(rows))


def sieve_charts(readings: Sequence[Reading]) -> dict[str, Spec]:
    """Component → share of the mass that is finer than each sieve, a line per sample, with the Rosin–Rammler line."""
    groups: dict[str, list[Reading]] = {}
    for row in readings:
        groups.setdefault(row.of[0], []).append(row)
    return {name: _undersize(by_replicate(rows)) for name, rows in groups.items()}


def _undersize(samples: Mapping[str, list[Reading]]) -> Spec:
    traces: list[Json] = []
    for k, (name, rows) in enumerate(samples.items()):
        x, finer = undersize(rows)
        colour = SAMPLES[k % len(SAMPLES)]
        at = [1e3 * float(one) for one in x]
        traces.append(points(at, [100.0 * float(one) for one in finer], f"sample {name}", colour))
        size, exponent = rosin_rammler(rows)
        if math.isfinite(size):
            dense = np.geomspace(x[0], x[-1], 80)
            shares = -100.0 * np.expm1(-((dense / size) ** exponent))
            traces.append(
                {
                    "type": "scatter",
                    "mode": "lines",
                    "x": (1e3 * dense).tolist(),
                    "y": shares.tolist(),
                    "name": label(f"Rosin–Rammler, sample {name}"),
                    "line": line(colour, "dash"),
                }
            )
    layout: Json = {"xaxis": axis("opening of the sieve [mm]"), "yaxis": axis("finer by mass [%]", range=[0, 102])}
    return chart(traces, layout, PANEL_HEIGHT)


def specimen(one: Derived | Estimate) -> str:
    """Of which component or pair."""
    return "–".join(one.of).replace("_", " ")


def bench_unit(si: str) -> ReadingUnit:
    """Unit in which a report writes what a bench test gave; slopes in degrees."""
    return ReadingUnit("°", math.pi / 180.0) if si == "rad" else reading_unit(si)


def interval(one: Derived) -> tuple[float, float]:
    """Mean and half its 95 % interval [SI], with the declared errors of the readings; NaN without an interval."""
    found = one.summary if one.reading is None else one.reading
    return one.summary.mean, 0.5 * (found.high - found.low)


def bench_charts(data: dict[str, Any]) -> dict[str, Spec]:
    """Title → chart, from what `explorer.tables.pours.bench_data` gives."""
    columns = list(data["series"].items())
    if not columns or len(columns[0][1]) < LEAST_POINTS:
        return {}
    (name, across), *others = columns
    return {f"{other} over {name}": _curve(name, across, other, values) for other, values in others}


def _curve(name: str, across: list[float | None], other: str, values: list[float | None]) -> Spec:
    trace = {
        "type": "scatter",
        "mode": "lines+markers",
        "x": across,
        "y": values,
        "name": label(other),
        "line": {"color": FACTOR, "width": 2},
        "marker": {"size": 4},
        "showlegend": False,
    }
    return chart([trace], {"xaxis": axis(name), "yaxis": axis(other)})
