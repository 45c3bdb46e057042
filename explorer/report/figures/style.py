"""Colours and elements that the charts share.

Every colour is legible on a light and on a dark page, and people with the common forms of colour blindness can also
tell any two apart (a test checks both).
"""

from __future__ import annotations

import html
import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from explorer.report.content import Spec

Json = dict[str, Any]

FACTOR = "#656ee0"
ASSUMPTION = "#d47828"
DUMMY = "#8b86a3"
TARGET = "#27a477"
CHOSEN = "#d73349"
INK = "#2b2f34"
"""Lines on a filled area that is light on every page."""
MARGIN_BAND = "rgba(39, 164, 119, 0.08)"
INTERVAL_BAND = "rgba(101, 110, 224, 0.22)"
CLOUD = "rgba(101, 110, 224, 0.4)"
BELOW_TO_ABOVE = [[0.0, FACTOR], [0.5, "#efece6"], [1.0, ASSUMPTION]]
"""Colour scale of a surface: below, at and above the target."""
LEAST_SPREAD = 1e-9
"""Spread relative to the largest number below which it counts as rounding."""


CONFIG: Json = {
    "displaylogo": False,
    "modeBarButtonsToRemove": ["select2d", "lasso2d"],
    "showSendToCloud": False,
    "plotlyServerURL": "",
    "toImageButtonOptions": {"format": "svg"},
}
"""plotly.js's options for every chart, in a report and on the live page; its picture button gives SVG, for print.

By default plotly.js 4 (plotly 7) offers "Share chart…", which uploads the data to cloud.plotly.com, and a logo that
links to plotly.com. Charts hold unpublished data, so both are off. The library's code keeps that address as a default;
the empty plotlyServerURL overrides it, and the button's own code stops if there is none.
"""


def label(text: str) -> str:
    """Text for a chart; plotly reads a little HTML, so names are escaped."""
    return html.escape(text, quote=False)


def chart(traces: list[Json], layout: Json, height: int = 380) -> Spec:
    """A chart from its traces, with the same margins and legend as all others."""
    common: Json = {
        "height": height,
        "margin": {"l": 60, "r": 24, "t": 28, "b": 52},
        "legend": {"orientation": "h", "x": 0, "y": 1.02, "yanchor": "bottom"},
        "hovermode": "closest",
    }
    return {"data": traces, "layout": common | layout}


def axis(title: str, **more: Any) -> Json:
    """An axis with a title; very small and large numbers as powers of ten (the default would be 20n and 1B)."""
    return {"title": {"text": label(title)}, "automargin": True, "exponentformat": "power", **more}


def side_by_side(panels: int, gap: float = 0.06) -> list[list[float]]:
    """Domains of ``panels`` charts in a row."""
    width = (1.0 - gap * (panels - 1)) / panels
    return [[k * (width + gap), min(1.0, k * (width + gap) + width)] for k in range(panels)]


def stacked(spec: Spec, gap: float = 0.16) -> Spec:
    """A chart with its row of panels stacked in a column, for a narrow place; a shared y axis is repeated."""
    layout = dict(spec["layout"])
    panels = sum(1 for key in layout if key.startswith("xaxis"))
    height = (1.0 - gap * (panels - 1)) / panels
    shared = [k for k in range(1, panels) if f"yaxis{suffix(k)}" not in layout]
    for k in range(panels):
        top = 1.0 - k * (height + gap)
        y = layout["yaxis"] | {"title": {"text": ""}} if k in shared else layout[f"yaxis{suffix(k)}"]
        layout[f"xaxis{suffix(k)}"] = layout[f"xaxis{suffix(k)}"] | {"domain": [0.0, 1.0], "anchor": f"y{suffix(k)}"}
        domain = [max(0.0, top - height), top]
        layout[f"yaxis{suffix(k)}"] = y | {"domain": domain, "anchor": f"x{suffix(k)}"}
    own = {f"x{suffix(k)}": f"y{suffix(k)}" for k in shared}
    traces = [t | {"yaxis": own[t["xaxis"]]} if t.get("xaxis") in own else t for t in spec["data"]]
    for key in ("shapes", "annotations"):
        if key in layout:
            layout[key] = [
                one | {"yref": f"{own[one['xref']]} domain"} if one.get("xref") in own else one for one in layout[key]
            ]
    return {"data": traces, "layout": layout | {"height": panels * layout["height"]}}


def short_rows(spec: Spec) -> Spec:
    """A chart with row names cut at " · " and without a beginning common to all, for a narrow place.

    Hovering still shows the full names.
    """
    rows = dict.fromkeys(row for trace in spec["data"] for row in trace["y"] if isinstance(row, str))
    names = [row.split(" · ")[0] for row in rows]
    beginnings = {name.partition(", ")[0] for name in names if ", " in name}
    if len(names) > 1 and len(beginnings) == 1 and all(", " in name for name in names):
        names = [name.partition(", ")[2] for name in names]
    ticks = {"tickvals": list(rows), "ticktext": [name.replace(", ", ",<br>") for name in names]}
    axes = {key: one | ticks for key, one in spec["layout"].items() if key.startswith("yaxis")}
    return {"data": spec["data"], "layout": spec["layout"] | axes}


def finite(values: Iterable[float]) -> list[float | None]:
    """Numbers for a chart: None, which leaves a gap, for a missing one."""
    return [float(value) if math.isfinite(value) else None for value in values]


def rounded(values: npt.NDArray[np.floating[Any]]) -> list[Any]:
    """The numbers of a grid or a curve, rounded to a hundred-thousandth of their spread or finer.

    They are short in a file and exact on any screen, however small or large they are.
    """
    spread = max(float(np.ptp(values)), LEAST_SPREAD * float(np.abs(values).max()))
    return np.round(values, 5 - math.floor(math.log10(spread)) if spread else 0).tolist()


def suffix(panel: int) -> str:
    """What plotly appends to "x" and "y" for a panel: nothing for the first, then "2", "3", …"""
    return "" if panel == 0 else str(panel + 1)


def points(x: list[Any], y: list[Any], name: str, colour: str, **more: Any) -> Json:
    """Markers with a name in the legend."""
    marker = {"color": colour, "size": 8} | more.pop("marker", {})
    return {"type": "scatter", "mode": "markers", "x": x, "y": y, "name": label(name), "marker": marker, **more}


def error_bars(half_widths: Sequence[float], colour: str) -> Json:
    """Symmetric intervals; none if the half-width is not known."""
    widths = [width if math.isfinite(width) else 0.0 for width in half_widths]
    return {"type": "data", "array": widths, "color": colour, "thickness": 1.5, "width": 4}


def horizontal_line(y: float, colour: str, panel: int = 0, dash: str = "solid") -> Json:
    """A line across a panel at height ``y``."""
    place = {"xref": f"x{suffix(panel)} domain", "yref": f"y{suffix(panel)}"}
    return {"type": "line", **place, "x0": 0, "x1": 1, "y0": y, "y1": y, "line": line(colour, dash)}


def vertical_line(x: float, colour: str, panel: int = 0, dash: str = "solid") -> Json:
    """A line up a panel at ``x``."""
    place = {"xref": f"x{suffix(panel)}", "yref": f"y{suffix(panel)} domain"}
    return {"type": "line", **place, "x0": x, "x1": x, "y0": 0, "y1": 1, "line": line(colour, dash)}


def horizontal_band(low: float, high: float, colour: str) -> Json:
    """A band across the first panel."""
    place = {"xref": "x domain", "yref": "y", "x0": 0, "x1": 1, "y0": low, "y1": high}
    return {"type": "rect", **place, "fillcolor": colour, "line": {"width": 0}, "layer": "below"}


def line(colour: str, dash: str = "solid", width: float = 1.5) -> Json:
    """Stroke of a line."""
    return {"color": colour, "dash": dash, "width": width}


def note(text: str, x: float, y: float, panel: int = 0, **more: Any) -> Json:
    """A short text at a place in a panel; y is a share of its height."""
    place = {"xref": f"x{suffix(panel)}", "yref": f"y{suffix(panel)} domain", "x": x, "y": y}
    return {"text": label(text), "showarrow": False, "font": {"size": 11}, **place, **more}
