"""Charts of a bench test: a laboratory's force–displacement curves, and what the solver's instrument read.

Of the laboratory every replicate, with the part that was taken as straight; of the solver every column against the
first.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from doe.laboratory import CurveFit, LabResult
from explorer.errors import CommandError
from explorer.report.content import Figure, Section, Spec
from explorer.report.figures.style import CHOSEN, FACTOR, Json, axis, chart, label
from explorer.report.html import page

PANEL_HEIGHT = 420
LEAST_POINTS = 3
"""Fewer readings of the solver's instrument are a few numbers, which the table has, and no curve."""


def write_curves(path: Path, result: LabResult) -> None:
    """Write one chart per component and quantity to a page that needs nothing else; CommandError without curves."""
    if not result.curves:
        raise CommandError("--plot: single readings only, no curve to draw")
    figures = tuple(Figure(f"curves-{k + 1}", spec, "") for k, spec in enumerate(curve_charts(result).values()))
    title = f"{result.test}: {Path(result.file).name}"
    text = page(title, "Force–displacement curves of a bench test", (Section("Curves", figures),))
    path.write_text(text, encoding="utf-8")


def curve_charts(result: LabResult) -> dict[str, Spec]:
    """Title → chart per component and quantity; none where the readings are no curves."""
    groups: dict[str, list[CurveFit]] = {}
    for curve in result.curves:
        groups.setdefault(f"{'-'.join(curve.of)}, {curve.quantity}", []).append(curve)
    return {title: force_displacement(curves, title) for title, curves in groups.items()}


def force_displacement(curves: list[CurveFit], title: str) -> Spec:
    """Points of every replicate and, over them, its straight part, drawn on to zero force."""
    traces: list[Json] = []
    for curve in curves:
        first = curve is curves[0]
        traces.append(
            {
                "type": "scatter",
                "mode": "markers",
                "x": [1e3 * x for x in curve.displacement],
                "y": list(curve.force),
                "name": "points",
                "legendgroup": "points",
                "showlegend": first,
                "marker": {"size": 4, "color": FACTOR, "opacity": 0.5},
                "hovertemplate": f"replicate {label(curve.replicate)}: %{{x:.4g}} mm, %{{y:.4g}} N<extra></extra>",
            }
        )
        fit = curve.fit
        traces.append(
            {
                "type": "scatter",
                "mode": "lines",
                "x": [1e3 * x for x in (fit.origin, fit.first_displacement, fit.last_displacement)],
                "y": [0.0, fit.first_force, fit.last_force],
                "name": "straight part, on to zero force",
                "legendgroup": "straight",
                "showlegend": first,
                "line": {"color": CHOSEN, "width": 2},
                "hovertemplate": f"replicate {label(curve.replicate)}: {1e-6 * curve.modulus:.4g} MPa<extra></extra>",
            }
        )
    layout: Json = {
        "title": {"text": label(title)},
        "xaxis": axis("displacement [mm]"),
        "yaxis": axis("force [N]"),
        "margin": {"l": 60, "r": 24, "t": 80, "b": 52},
    }
    return chart(traces, layout, PANEL_HEIGHT)


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
