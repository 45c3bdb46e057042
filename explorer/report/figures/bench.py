"""Charts of a bench test: a laboratory's curves and replicates, and what the solver's instrument read.

For a laboratory: every replicate, with the part that was taken as straight, or the mean with its interval. For the
solver: every column against the first.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from doe.laboratory import CurveFit, Derived, Estimate, LabResult
from doe.laboratory.linear_range import LinearRange
from doe.laboratory.result import CONDITIONS
from doe.laboratory.sieve import rosin_rammler, undersize
from doe.laboratory.tables import Reading, by_replicate
from explorer.files.run_result import BenchTestResult
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
    finite,
    label,
    line,
    points,
    side_by_side,
    suffix,
)
from explorer.units import ReadingUnit, reading_unit

PANEL_HEIGHT = 420
ROW = 34
"""Height of a row of replicates [px]."""
ACROSS = 3
"""Quantities side by side."""
MOST_POINTS = 10_000
"""Points of all curves of one chart."""
LEAST_POINTS = 3
"""Fewer readings of the solver's instrument make no curve: the table holds these few numbers."""
NEGLIGIBLE = 1e-9
"""Spread relative to the mean that counts as rounding."""
SAMPLES = (FACTOR, ASSUMPTION, TARGET, CHOSEN)


def curve_charts(result: LabResult) -> dict[str, Spec]:
    """Title → chart per component and quantity; empty if the readings are not curves."""
    groups: dict[str, list[CurveFit]] = {}
    for curve in result.curves:
        groups.setdefault(curve_title(curve), []).append(curve)
    return {title: force_displacement(curves, title) for title, curves in groups.items()}


def curve_title(curve: CurveFit) -> str:
    """Whose curve it is, and what it is for."""
    return f"{'-'.join(curve.of)}, {curve.quantity}"


def force_displacement(curves: list[CurveFit], title: str) -> Spec:
    """Points of every replicate and, over them, the fitted part, straight or Hertzian, extended to zero force."""
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
    """Whether the fitted part is a line, not Hertz’s law."""
    return isinstance(curve.fit, LinearRange)


def side_by_side_quantities(result: LabResult) -> list[dict[str, list[Derived]]]:
    """Results of replicates by quantity, in groups of as many quantities as a chart has panels."""
    found: dict[str, list[Derived]] = {}
    for one in result.derived:
        if one.name not in CONDITIONS:
            found.setdefault(one.name, []).append(one)
    names = [name for name, own in found.items() if any(map(_shows, own))]
    return [{name: found[name] for name in names[k : k + ACROSS]} for k in range(0, len(names), ACROSS)]


def _shows(one: Derived) -> bool:
    """Whether there is scatter to see: replicates of one value, such as a set speed, show none."""
    return one.summary.n == 1 or one.summary.sd > NEGLIGIBLE * abs(one.summary.mean)


def replicates(found: Mapping[str, list[Derived]]) -> Spec:
    """A panel for each quantity: its replicates with mean and interval, a row for each component or pair."""
    rows = list(dict.fromkeys(specimen(one) for own in found.values() for one in own))
    layout: Json = {"yaxis": axis("", categoryorder="array", categoryarray=list(map(label, rows[::-1])))}
    traces: list[Json] = []
    told: set[str] = set()
    for k, (domain, (name, own)) in enumerate(zip(side_by_side(len(found)), found.items(), strict=True)):
        unit = bench_unit(own[0].unit)
        words = name.replace("_", " ")
        layout[f"xaxis{suffix(k)}"] = axis(
            f"{words} [{unit.symbol}]" if unit.symbol else words, domain=domain, nticks=5
        )
        for trace in _panel(own, unit):
            place = {"xaxis": f"x{suffix(k)}", "yaxis": "y", "legendgroup": trace["name"]}
            traces.append(trace | place | {"showlegend": trace["name"] not in told})
            told.add(trace["name"])
    return chart(traces, layout, 120 + ROW * len(rows))


def _panel(own: Sequence[Derived], unit: ReadingUnit) -> Iterator[Json]:
    """Replicates, outliers and means; a single replicate has no interval."""
    seen = "%{y}, replicate %{text}: %{x:.4g}<extra></extra>"
    for name, colour, size, symbol, odd in (
        ("replicates", FACTOR, 7, "circle", False),
        ("outliers, kept", CHOSEN, 9, "x", True),
    ):
        x, y, told = [], [], []
        for one in own:
            for k, (replicate, value) in enumerate(zip(one.replicates, one.values, strict=True)):
                if (k in one.summary.outliers) == odd:
                    x.append(unit.of(value))
                    y.append(label(specimen(one)))
                    told.append(label(replicate))
        if x:
            marker = {"size": size, "symbol": symbol, "opacity": 0.6}
            yield points(x, y, name, colour, text=told, hovertemplate=seen, marker=marker)
    means = [unit.of(one.summary.mean) for one in own]
    half = [interval(one)[1] / unit.size for one in own]
    rows = [label(specimen(one)) for one in own]
    mark = points(means, rows, "mean, 95 % of it", ASSUMPTION, marker={"size": 10, "symbol": "diamond"})
    yield mark | {"error_x": error_bars(half, ASSUMPTION)}


def sieve_charts(readings: Sequence[Reading]) -> dict[str, Spec]:
    """Component → share of mass finer than each sieve, a line per sample, with the Rosin–Rammler line."""
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
    """The component or pair that was tested."""
    return "–".join(one.of).replace("_", " ")


def bench_unit(si: str) -> ReadingUnit:
    """Unit in which a report writes results of a bench test; slopes in degrees."""
    return ReadingUnit("°", math.pi / 180.0) if si == "rad" else reading_unit(si)


def interval(one: Derived) -> tuple[float, float]:
    """Mean and half its 95 % interval [SI], with the declared errors of the readings; NaN without an interval."""
    found = one.summary if one.reading is None else one.reading
    return one.summary.mean, 0.5 * (found.high - found.low)


def bench_charts(result: BenchTestResult) -> dict[str, Spec]:
    """Title → chart of every column over the first."""
    columns = list(result.series.items())
    if not columns or len(columns[0][1]) < LEAST_POINTS:
        return {}
    (name, across), *others = columns
    return {f"{other} over {name}": _curve(name, across, other, values) for other, values in others}


def _curve(name: str, across: Sequence[float], other: str, values: Sequence[float]) -> Spec:
    trace = {
        "type": "scatter",
        "mode": "lines+markers",
        "x": finite(across),
        "y": finite(values),
        "name": label(other),
        "line": {"color": FACTOR, "width": 2},
        "marker": {"size": 4},
        "showlegend": False,
    }
    return chart([trace], {"xaxis": axis(name), "yaxis": axis(other)})
