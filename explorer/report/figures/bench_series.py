"""Curves of a bench test on the solver: every column against the first."""

from __future__ import annotations

from typing import Any

from explorer.report.content import Spec
from explorer.report.figures.style import FACTOR, axis, chart, label

LEAST_POINTS = 3
"""Below that a column is a few numbers, which the table has, and no curve."""


def bench_charts(data: dict[str, Any]) -> dict[str, Spec]:
    """Title → chart, from what `explorer.tables.bench_test.bench_data` gives."""
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
