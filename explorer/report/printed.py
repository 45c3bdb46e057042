"""A chart's plotly specification drawn for print by matplotlib: SVG and PDF, 85 and 180 mm wide, 8 pt.

One translator serves the trace types of this program's charts (scatter, bar, contour, heatmap), so a figure on paper
shows the same as the one on the page. Charts in space are drawn in the plane: a surface as contours, the settings that
give a target as one line for each of several values of the third factor.
"""

from __future__ import annotations

import html
import io
import math
import re
from collections.abc import Iterator, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.transforms import blended_transform_factory

from explorer.report.content import DataTable, Spec
from explorer.report.figures.style import Json, short_rows, stacked

INCH = 1.0 / 25.4
"""[1/mm]"""
WIDTHS = (85, 180)
"""One and two columns of a journal [mm]."""
PAGE_PX = 1060.0
"""Width of a chart on the page, against which its height is given [px]."""
PX = 0.5
"""Points on paper per pixel on the page, for marks and lines."""
NAME_ROOM = np.array([0.12, 0.05])
"""Share of a panel needed by a name beside a mark."""
LEAST, MOST_HEIGHT = 35.0, 230.0
"""Limits of the height of a figure [mm]."""
LETTER, SMALL_LETTER = 1.45, 1.3
"""Width of a letter of 8 and of 7 pt [mm]."""
LEVELS = 5
"""Number of lines for the settings in space that give a target."""
STYLE = {
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.labelsize": 8.0,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "legend.fontsize": 7.0,
    "axes.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "svg.hashsalt": "repose-explorer",
    "svg.fonttype": "none",
    "pdf.fonttype": 42,
    "font.family": "DejaVu Sans",
}
SYMBOLS = {"circle": "o", "diamond": "D", "star": "*", "cross": "P", "x": "X", "square": "s", "triangle-up": "^"}
DASHES = {"solid": "-", "dash": (0, (5, 2.5)), "dot": (0, (1, 1.8)), "dashdot": "-."}
ALIGN = {"left": "left", "right": "right", "center": "center", "top": "top", "bottom": "bottom", "middle": "center"}


def printed(spec: Spec) -> dict[str, bytes]:
    """File name → content: SVG and PDF of each width."""
    found = {}
    for width in WIDTHS:
        figure = drawn(spec, width)
        figure.draw_without_rendering()
        figure.set_layout_engine("none")  # keep the layout for both files
        for kind, stamp in (("svg", {"Date": None}), ("pdf", {"CreationDate": None})):
            file = io.BytesIO()
            with mpl.rc_context(STYLE):
                figure.savefig(file, format=kind, metadata=stamp)
            found[f"{width}mm.{kind}"] = file.getvalue()
    return found


def drawn(spec: Spec, width: float) -> Figure:
    """The chart as a matplotlib figure, ``width`` [mm] wide."""
    flat = _in_the_plane(spec)
    if width < WIDTHS[-1]:
        flat = _narrow(flat)
    layout = flat["layout"]
    height = min(MOST_HEIGHT, max(LEAST, WIDTHS[-1] * layout["height"] / PAGE_PX))
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(width * INCH, height * INCH), layout="constrained")
        figure.get_layout_engine().set(w_pad=0.03, h_pad=0.03, wspace=0.03, hspace=0.04)
        panels = _panels(figure, flat)
        for number, trace in enumerate(flat["data"]):
            axes, layout_x, layout_y = panels[trace.get("xaxis", "x"), trace.get("yaxis", "y")]
            _draw(axes, trace, flat, (layout_x, layout_y), number)
        rows = max(len(name) for axes, _, y in panels.values() for name in ("", *_row_names(axes, y)))
        for axes, layout_x, layout_y in panels.values():
            _finish(axes, layout_x, layout_y, (width - SMALL_LETTER * rows, 0.8 * height))
        for shape in layout.get("shapes", ()):
            _shape(_place(panels, shape), shape)
        for note in layout.get("annotations", ()):
            _note(_place(panels, note), note)
        _colour_bar(figure, flat, [axes for axes, _, _ in panels.values()])
        _legend(figure, flat, width)
    return figure


def figure_data(name: str, spec: Spec) -> DataTable:
    """What a chart shows, one line per point: trace, panel, x, y, z, ends of its error bars, and its value in space."""
    header = ("trace", "panel", "x", "y", "z", "x_minus", "x_plus", "y_minus", "y_plus", "value")
    return DataTable(name, header, tuple(row for trace in spec["data"] for row in _points_of(trace)))


def _points_of(trace: Json) -> Iterator[tuple[Any, ...]]:
    head = (plain(str(trace.get("name", trace["type"]))), trace.get("xaxis", "x").removeprefix("x") or "1")
    x, y, z = trace["x"], trace["y"], trace.get("z")
    if z is not None and trace["type"] in ("contour", "heatmap", "surface"):
        for b, row in zip(y, z, strict=True):
            for a, value in zip(x, row, strict=True):
                yield (*head, a, b, value, None, None, None, None, None)
        return
    nothing = [None] * len(x)
    bars = [side for key in ("error_x", "error_y") for side in _bars(trace.get(key), len(x))]
    for row in zip(x, y, nothing if z is None else z, *bars, trace.get("value", nothing), strict=True):
        yield (*head, *(plain(cell) if isinstance(cell, str) else cell for cell in row))


def _bars(error: Json | None, n: int) -> tuple[Sequence[Any], Sequence[Any]]:
    """Lower and upper lengths of error bars."""
    if error is None:
        return [None] * n, [None] * n
    upper: Sequence[Any] = error["array"]
    return error.get("arrayminus", upper), upper


def plain(text: str) -> str:
    """Text of a chart without plotly's HTML, safe from matplotlib's formulas."""
    return html.unescape(re.sub(r"<[^>]+>", "", re.sub(r"<br ?/?>", "\n", text))).replace("$", r"\$")


# In the plane, and narrow


def _in_the_plane(spec: Spec) -> Spec:
    """A chart in space as one in the plane of its first two axes."""
    scene = spec["layout"].get("scene")
    if scene is None:
        return spec
    titles = {name: scene[name]["title"]["text"] for name in ("xaxis", "yaxis", "zaxis")}
    layout = {key: one for key, one in spec["layout"].items() if key != "scene"}
    layout |= {name: {"title": {"text": titles[name]}} for name in ("xaxis", "yaxis")}
    traces: list[Json] = []
    for trace in spec["data"]:
        if trace["type"] == "surface":
            level = trace["contours"]["z"]
            scale = {"colorscale": trace["colorscale"], "cmin": trace["cmin"], "cmax": trace["cmax"]}
            layout["coloraxis"] = scale | {"colorbar": {"title": {"text": titles["zaxis"]}}}
            grid = {"type": "contour", "x": trace["x"], "y": trace["y"], "z": trace["z"], "name": trace["name"]}
            edge = {"color": "rgba(43, 47, 52, 0.35)", "width": 0.6}
            filled = {"contours": {"coloring": "heatmap", "showlabels": True}, "line": edge}
            at_level = {"start": level["start"], "end": level["start"], "coloring": "none"}
            traces.append(grid | filled | {"coloraxis": "coloraxis"})
            line = {"color": level["color"], "width": 4}
            traces.append(grid | {"contours": at_level, "line": line, "name": "level of the middle colour"})
        elif trace["type"] == "isosurface":
            traces += _lines_in_space(trace, titles["zaxis"])
        else:
            traces.append({key: one for key, one in trace.items() if key != "z"} | {"type": "scatter"})
    return {"data": traces, "layout": layout}


def _lines_in_space(trace: Json, title: str) -> list[Json]:
    """One contour for each of ``LEVELS`` values of the third axis."""
    sides = [sorted(set(trace[axis])) for axis in "xyz"]
    values = np.reshape(trace["value"], [len(side) for side in sides])
    colours = mpl.colormaps["viridis"](np.linspace(0.0, 0.85, LEVELS))
    found = []
    for k, colour in zip(np.linspace(0, len(sides[2]) - 1, LEVELS).round().astype(int), colours, strict=True):
        at = {"start": trace["isomin"], "end": trace["isomin"], "coloring": "none"}
        name = f"{title.partition(':')[0]} = {sides[2][k]:.4g}"
        grid = {"type": "contour", "x": sides[0], "y": sides[1], "z": values[:, :, k].T.tolist(), "contours": at}
        found.append(grid | {"name": name, "line": {"color": mpl.colors.to_hex(colour), "width": 3}})
    return found


def _narrow(spec: Spec) -> Spec:
    """For one column: panels in a row go below each other, and names of rows are cut."""
    layout = spec["layout"]
    if any(isinstance(value, str) for trace in spec["data"] for value in trace.get("y", ())[:1]):
        spec = short_rows(spec)
        layout = spec["layout"]
    in_a_row = [key for key in layout if key.startswith("xaxis")]
    if len(in_a_row) > 1 and not any("domain" in layout.get(key, {}) for key in layout if re.match(r"yaxis\d", key)):
        own = spec["layout"]["height"]
        spec = stacked(spec)
        spec["layout"]["height"] = len(in_a_row) * own * 0.9
    elif "scaleanchor" in layout.get("yaxis", {}):
        spec = {"data": spec["data"], "layout": layout | {"height": 0.65 * layout["height"]}}
    elif len(in_a_row) > 1:
        spec = {"data": spec["data"], "layout": layout | {"height": layout["height"] * 1.15}}
    return spec


# Panels and axes

Array = npt.NDArray[np.float64]
Panel = tuple[Axes, Json, Json]
Panels = dict[tuple[str, str], Panel]


def _panels(figure: Figure, spec: Spec) -> Panels:
    """Axes by the names of their x and y axes, on a grid given by the domains of the layout."""
    layout = spec["layout"]
    pairs = list(dict.fromkeys((trace.get("xaxis", "x"), trace.get("yaxis", "y")) for trace in spec["data"]))
    sides = [(_axis(layout, x), _axis(layout, y)) for x, y in pairs]
    lefts = sorted({round(x.get("domain", [0.0, 1.0])[0], 3) for x, _ in sides})
    tops = sorted({round(y.get("domain", [0.0, 1.0])[1], 3) for _, y in sides}, reverse=True)
    grid = figure.add_gridspec(len(tops), len(lefts))
    found: Panels = {}
    for pair, (x, y) in zip(pairs, sides, strict=True):
        row = tops.index(round(y.get("domain", [0.0, 1.0])[1], 3))
        column = lefts.index(round(x.get("domain", [0.0, 1.0])[0], 3))
        first = next((axes for (_, other), (axes, _, _) in found.items() if other == pair[1]), None)
        matched = found[pairs[0]][0] if y.get("matches") and found else first
        axes = figure.add_subplot(grid[row, column], sharey=matched)
        if first is not None or y.get("showticklabels") is False:
            axes.tick_params(labelleft=False)
        found[pair] = (axes, x, y if first is None else {key: one for key, one in y.items() if key != "title"})
    return found


def _axis(layout: Json, name: str) -> Json:
    found: Json = layout.get(f"{name[0]}axis{name[1:]}", {})
    return found


def _place(panels: Panels, one: Json) -> Axes:
    """The panel that a shape or a note belongs to, by its references."""
    x, y = (one[key].partition(" ")[0] for key in ("xref", "yref"))
    for pair in ((x, y), next((pair for pair in panels if pair[0] == x), ("", "")), next(iter(panels))):
        if pair in panels:
            return panels[pair][0]
    raise AssertionError("a chart has a panel")


def _finish(axes: Axes, x: Json, y: Json, size: tuple[float, float]) -> None:
    """Set titles, ticks and limits; ``size``: width and height of all panels together [mm]."""
    letters = {
        letter: max(12, int((one.get("domain", (0.0, 1.0))[1] - one.get("domain", (0.0, 1.0))[0]) * room / LETTER) - 3)
        for letter, one, room in (("x", x, size[0]), ("y", y, size[1]))
    }
    for side, layout in ((axes.xaxis, x), (axes.yaxis, y)):
        letter = side.axis_name
        text = plain(layout.get("title", {}).get("text", ""))
        side.set_label_text(_broken(text, letters[letter]))
        ticks, names = layout.get("tickvals"), layout.get("ticktext")
        if ticks is not None and not isinstance(ticks[0], str):
            side.set_ticks(ticks, labels=[plain(name) for name in names] if names else None)
        elif ticks is not None and names is not None:
            shown = dict(zip(map(plain, ticks), names, strict=True))
            present = [label.get_text() for label in side.get_ticklabels()]
            side.set_ticks(side.get_ticklocs(), labels=[plain(shown.get(name, name)) for name in present])
        elif layout.get("dtick"):
            low, high = axes.get_xlim() if letter == "x" else axes.get_ylim()
            side.set_ticks(np.arange(math.ceil(low), high + 1e-9, layout["dtick"]))
        limits = layout.get("range")
        if letter == "x" and not hasattr(side, "names") and ticks is None and not layout.get("dtick"):
            axes.locator_params(axis="x", nbins=max(3, letters["x"] // 8))
        if limits:
            (axes.set_xlim if letter == "x" else axes.set_ylim)(*limits)
        elif layout.get("rangemode") == "tozero":
            low, high = axes.dataLim.intervalx if letter == "x" else axes.dataLim.intervaly
            ends = {"left" if letter == "x" else "bottom": 0.0} if low >= 0.0 else {}
            ends |= {"right" if letter == "x" else "top": 0.0} if high <= 0.0 else {}
            (axes.set_xlim if letter == "x" else axes.set_ylim)(**ends)
        if hasattr(side, "names") and letter == "y":
            axes.set_ylim(-0.6, len(side.names) - 0.4)
        if layout.get("zeroline"):
            (axes.axvline if letter == "x" else axes.axhline)(0.0, color="#8b86a3", linewidth=0.6, zorder=0.5)
        if "scaleanchor" in layout:
            axes.set_aspect("equal", adjustable="box")


def _row_names(axes: Axes, y: Json) -> list[str]:
    """Names along the y axis as they will be printed."""
    names = getattr(axes.yaxis, "names", [])
    shown = (
        dict(zip(map(plain, y.get("tickvals", ())), map(plain, y.get("ticktext", ())), strict=False)) if names else {}
    )
    return [line for name in names for line in shown.get(name, name).split("\n")]


def _broken(text: str, most: int = 34) -> str:
    """A long title of a vertical axis, broken into lines."""
    lines = [""]
    for word in text.split(" "):
        lines = [*lines, word] if len(lines[-1]) + len(word) > most else [*lines[:-1], f"{lines[-1]} {word}".strip()]
    return "\n".join(lines)


# Traces


def _draw(axes: Axes, trace: Json, spec: Spec, sides: tuple[Json, Json], number: int) -> None:
    order = 2.0 + 0.01 * number
    match trace["type"]:
        case "scatter" | "scatter3d":
            _scatter(axes, trace, sides, order, any(one["type"] == "contour" for one in spec["data"]))
        case "bar":
            _bar(axes, trace, spec, sides, order)
        case "contour":
            _contour(axes, trace, spec, order)
        case "heatmap":
            # A colour scale of its own covers its own values.
            own = {"colorscale": trace.get("colorscale"), "cmin": 0.0, "cmax": float(np.max(trace["z"]))}
            scale = own if own["colorscale"] else spec["layout"]["coloraxis"]
            axes.pcolormesh(
                trace["x"], trace["y"], np.array(trace["z"], dtype=float), cmap=_colour_map(scale),
                vmin=scale["cmin"], vmax=scale["cmax"], shading="nearest", rasterized=True, zorder=order - 1.5,
            )  # fmt: skip
        case other:
            raise ValueError(f"no way to print a trace of the type {other!r}")


def _values(axes: Axes, values: Sequence[Any], letter: str, layout: Json) -> Any:
    """Numbers with NaN for gaps; names as positions along the axis, from the layout or their order."""
    names = [value for value in values if isinstance(value, str)]
    if not names:
        return np.array([math.nan if value is None else value for value in values], dtype=float)
    side = axes.xaxis if letter == "x" else axes.yaxis
    known: list[str] = getattr(side, "names", [plain(name) for name in layout.get("categoryarray", ())])
    known = list(dict.fromkeys([*known, *map(plain, names)]))
    side.names = known
    side.set_ticks(range(len(known)), labels=known)
    return np.array([known.index(plain(value)) for value in values], dtype=float)


def _scatter(axes: Axes, trace: Json, sides: tuple[Json, Json], order: float, on_map: bool) -> None:
    x, y = (_values(axes, trace[k], k, side) for k, side in zip("xy", sides, strict=True))
    marker, stroke = trace.get("marker", {}), trace.get("line", {})
    opacity = trace.get("opacity", 1.0)
    if "fill" in trace or trace.get("contours", {}).get("type") == "constraint":
        axes.fill(x, y, color=_rgba(trace["fillcolor"]), linewidth=0.0, zorder=order - 1.0)
        return
    colour = marker.get("color", stroke.get("color", "#656ee0"))
    for key in ("error_x", "error_y"):
        error = trace.get(key)
        if error is not None:
            sizes = np.array(_bars(error, len(x)), dtype=float)
            bars = {key.replace("error_", "") + "err": np.nan_to_num(sizes)}
            axes.errorbar(
                x, y, **bars, fmt="none", ecolor=_rgba(error["color"]), elinewidth=0.9, capsize=1.8, zorder=order - 0.4
            )
    mode = trace.get("mode", "lines")
    if "lines" in mode:
        axes.plot(
            x, y, color=_rgba(stroke.get("color", colour), opacity), linewidth=_stroke(stroke),
            linestyle=DASHES[stroke.get("dash", "solid")], solid_capstyle="butt", zorder=order - 0.5,
        )  # fmt: skip
    if "markers" in mode:
        # On a map, marks at the edge are not clipped.
        axes.scatter(x, y, s=_area(marker), zorder=order, clip_on=not on_map, **_mark(marker, colour, opacity))
    if "text" in mode:
        _names(axes, x, y, trace["text"])


def _names(axes: Axes, x: Array, y: Array, names: Sequence[str]) -> None:
    """Write names beside marks, the highest first; one that would overlap another is left out."""
    reach = np.ptp(axes.dataLim.get_points(), axis=0) * NAME_ROOM
    shown: list[Array] = []
    for k in np.argsort(-y):
        place = np.array([x[k], y[k]])
        if names[k] and all((np.abs(place - other) > reach).any() for other in shown):
            shown.append(place)
            where: Json = {"textcoords": "offset points", "ha": "right", "va": "center", "fontsize": 6.5}
            axes.annotate(plain(names[k]), (x[k], y[k]), (-4, 0), **where)


def _stroke(line: Json) -> float:
    """Width of a line [pt]."""
    return max(0.7, 1.2 * PX * float(line.get("width", 1.5)))


def _area(marker: Json) -> float:
    larger = 1.5 if marker.get("symbol", "").startswith("star") else 1.0
    return float(marker.get("size", 8) * PX * larger) ** 2


def _mark(marker: Json, colour: Any, opacity: float) -> Json:
    """Shape, face and edge of a mark."""
    symbol, edge = marker.get("symbol", "circle"), marker.get("line", {})
    alpha = opacity * marker.get("opacity", 1.0)
    face = [_rgba(one, alpha) for one in colour] if isinstance(colour, list) else [_rgba(colour, alpha)]
    found: Json = {"marker": SYMBOLS[symbol.removesuffix("-open")], "linewidths": edge.get("width", 0.0) * PX}
    if symbol.endswith("-open"):
        return found | {"facecolors": "none", "edgecolors": face, "linewidths": 0.9}
    return found | {"facecolors": face, "edgecolors": _rgba(edge["color"]) if "color" in edge else "none"}


def _bar(axes: Axes, trace: Json, spec: Spec, sides: tuple[Json, Json], order: float) -> None:
    place = _values(axes, trace["y"], "y", sides[1])
    group = [one for one in spec["data"] if one["type"] == "bar" and one.get("xaxis") == trace.get("xaxis")]
    stacked_up = spec["layout"].get("barmode") == "stack"
    thick = (1.0 - spec["layout"].get("bargap", 0.2)) / (1 if stacked_up else len(group))
    shift = 0.0 if stacked_up else (group.index(trace) - 0.5 * (len(group) - 1)) * thick
    sizes, *below = (
        np.nan_to_num(np.array([math.nan if v is None else v for v in one["x"]], dtype=float))
        for one in (trace, *(group[: group.index(trace)] if stacked_up else ()))
    )
    look = {"color": trace["marker"]["color"], "alpha": trace["marker"].get("opacity", 1.0), "zorder": order}
    axes.barh(place + shift, sizes, height=thick, left=sum(below, np.zeros(len(place))), **look)


def _contour(axes: Axes, trace: Json, spec: Spec, order: float) -> None:
    x, y, z = (np.array(trace[key], dtype=float) for key in "xyz")
    how, stroke = trace["contours"], trace.get("line", {})
    width = max(0.4, stroke.get("width", 1.0) * PX)
    if how.get("type") == "constraint":
        # As in plotly, shade where z > value, the only operation in our charts, does not hold.
        if np.nanmin(z) < how["value"]:
            levels = [float(np.nanmin(z)) - 1.0, how["value"]]
            axes.contourf(x, y, z, levels, colors=[_rgba(trace["fillcolor"])], zorder=0.3)
        return
    if how["coloring"] == "none" and "start" in how:
        step = how.get("size", 1.0)
        levels = np.arange(how["start"], how.get("end", how["start"]) + 0.5 * step, step).tolist()
        if found := [level for level in levels if np.nanmin(z) <= level <= np.nanmax(z)]:
            dash = {"dot": "dotted", "dash": "dashed"}.get(stroke.get("dash", ""), "solid")
            axes.contour(
                x, y, z, found, colors=[_rgba(stroke["color"])], linewidths=width, linestyles=dash, zorder=order
            )
        axes.set_xlim(x.min(), x.max())
        axes.set_ylim(y.min(), y.max())
        return
    if how["coloring"] == "heatmap":
        scale = spec["layout"][trace["coloraxis"]]
        axes.pcolormesh(
            x, y, z, cmap=_colour_map(scale), vmin=scale["cmin"], vmax=scale["cmax"], shading="gouraud",
            rasterized=True, zorder=0.2,
        )  # fmt: skip
    if np.nanmax(z) > np.nanmin(z):
        lines = axes.contour(
            x, y, z, trace.get("ncontours", 7), colors=[_rgba(stroke["color"])], linewidths=width, zorder=order
        )
        if how.get("showlabels"):
            axes.clabel(lines, fontsize=6, fmt="%.3g", colors="#2b2f34")


def _colour_map(scale: Json) -> LinearSegmentedColormap:
    return LinearSegmentedColormap.from_list("of the page", [(at, _rgba(colour)) for at, colour in scale["colorscale"]])


def _rgba(colour: str, opacity: float = 1.0) -> tuple[float, float, float, float]:
    """A colour as plotly writes it."""
    if colour.startswith("rgba"):
        *parts, alpha = (float(part) for part in re.findall(r"[\d.]+", colour))
        red, green, blue = (part / 255.0 for part in parts)
        return red, green, blue, alpha * opacity
    red, green, blue, alpha = to_rgba(colour)
    return red, green, blue, alpha * opacity


# Shapes, notes, keys


def _transform(axes: Axes, one: Json) -> Any:
    x = axes.transAxes if one["xref"].endswith("domain") else axes.transData
    y = axes.transAxes if one["yref"].endswith("domain") else axes.transData
    return blended_transform_factory(x, y)


def _shape(axes: Axes, shape: Json) -> None:
    at, stroke = _transform(axes, shape), shape.get("line", {})
    limits = axes.get_xlim(), axes.get_ylim()
    if shape["type"] == "rect":
        size = shape["x1"] - shape["x0"], shape["y1"] - shape["y0"]
        # A band as faint as on the screen would be invisible on paper.
        red, green, blue, alpha = _rgba(shape["fillcolor"])
        face = red, green, blue, max(0.16, alpha)
        axes.add_patch(
            Rectangle((shape["x0"], shape["y0"]), *size, transform=at, facecolor=face, linewidth=0, zorder=0.1)
        )
    else:
        line = Line2D(
            [shape["x0"], shape["x1"]], [shape["y0"], shape["y1"]], transform=at, color=_rgba(stroke["color"]),
            zorder=1.5, linewidth=_stroke(stroke), linestyle=DASHES[stroke.get("dash", "solid")],
        )  # fmt: skip
        axes.add_line(line)
    _make_room(axes, shape, limits)


def _make_room(axes: Axes, shape: Json, limits: tuple[tuple[float, float], tuple[float, float]]) -> None:
    """Extend the axes to include a line or band outside the data."""
    for letter, (low, high), put in zip("xy", limits, (axes.set_xlim, axes.set_ylim), strict=True):
        if not shape[f"{letter}ref"].endswith("domain"):
            ends = shape[f"{letter}0"], shape[f"{letter}1"]
            room = 0.03 * (high - low)
            put(
                min(low, min(ends) - room if min(ends) < low else low),
                max(high, max(ends) + room if max(ends) > high else high),
            )


def _note(axes: Axes, note: Json) -> None:
    align = {"ha": ALIGN[note.get("xanchor", "center")], "va": ALIGN[note.get("yanchor", "middle")]}
    axes.text(note["x"], note["y"], plain(note["text"]), transform=_transform(axes, note), fontsize=6.5, **align)


def _colour_bar(figure: Figure, spec: Spec, panels: list[Axes]) -> None:
    scale = spec["layout"].get("coloraxis")
    if scale is None:
        return
    norm = mpl.colors.Normalize(scale["cmin"], scale["cmax"])
    colours = mpl.cm.ScalarMappable(norm, _colour_map(scale))
    bar = figure.colorbar(
        colours,
        ax=panels,
        aspect=30 if len(panels) < 2 or panels[0].get_subplotspec().get_gridspec().ncols > 1 else 60,
        pad=0.02,
    )
    bar.set_label(_broken(plain(scale["colorbar"]["title"]["text"])))
    bar.outline.set_visible(False)


def _legend(figure: Figure, spec: Spec, width: float) -> None:
    """One entry per trace that plotly's own legend shows, above the panels."""
    if spec["layout"].get("showlegend") is False:
        return
    shown: dict[str, Any] = {}
    for trace in spec["data"]:
        name = plain(str(trace.get("name", "")))
        if not name or not trace.get("showlegend", True) or name in shown or trace["type"] == "heatmap":
            continue
        if trace["type"] == "contour" and trace["contours"].get("coloring", "none") != "none":
            continue
        shown[name] = _key(trace)
    if len(shown) < 2:
        return
    # As many columns as leave room for the longest name, at some 1.5 mm a letter.
    columns = max(1, min(len(shown), int(width // (12.0 + 1.35 * max(map(len, shown))))))
    figure.legend(
        list(shown.values()), list(shown), loc="outside upper left", ncols=columns, frameon=False, handlelength=1.6,
        columnspacing=1.2, borderpad=0.1, labelspacing=0.3,
    )  # fmt: skip


def _key(trace: Json) -> Any:
    """The symbol before a name in the legend."""
    marker, stroke = trace.get("marker", {}), trace.get("line", {})
    if trace["type"] == "bar":
        colour = marker["color"]
        return Patch(color=colour[0] if isinstance(colour, list) else colour)
    if "fill" in trace or trace.get("contours", {}).get("type") == "constraint":
        return Patch(color=_rgba(trace["fillcolor"]))
    key = Line2D([], [], linestyle="none")
    mode = "lines" if trace["type"] == "contour" else trace.get("mode", "lines")
    if "lines" in mode:
        dash = DASHES[stroke.get("dash", "solid")]
        opacity = trace.get("opacity", 1.0)
        key = Line2D([], [], color=_rgba(stroke["color"], opacity), linestyle=dash, linewidth=min(6.0, _stroke(stroke)))
    if "markers" in mode:
        colour = marker.get("color", "#656ee0")
        look = _mark(marker, colour[0] if isinstance(colour, list) else colour, trace.get("opacity", 1.0))
        face = look["facecolors"] if look["facecolors"] == "none" else look["facecolors"][0]
        edge = look["edgecolors"][0] if isinstance(look["edgecolors"], list) else look["edgecolors"]
        key.set(marker=look["marker"], markersize=min(6.0, max(3.0, marker.get("size", 8) * PX)))
        key.set(markerfacecolor=face, markeredgecolor=edge, markeredgewidth=look["linewidths"])
    return key
