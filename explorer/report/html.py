"""A report as one self-contained HTML page: it includes plotly.js for its charts, and no request leaves it.

The same templates (``templates/``) make the pages of all reports, with every text escaped. The pages are calm and
readable, light or dark as the reader's system is, and have a print style.
"""

from __future__ import annotations

import base64
import gzip
import html
import json
import re
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from markupsafe import Markup
from plotly.offline import get_plotlyjs

from explorer.report.content import Drawing, Figure, Picture, Report, Shown, Spec, Strong, Struck, Table
from explorer.report.figures.style import CONFIG
from explorer.units import MISSING

if TYPE_CHECKING:
    from jinja2 import Environment

POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"
"""Content security policy: the browser refuses to load anything from elsewhere."""
NUMBER = re.compile(r"^(± )?[−+<>]?\d[\d.e−+]*( ?(°|%|σ|mm|1/mm|cm²|cm³|MPa|g|s|min|g/s|m/s|kg/m³))?( ± [\d.]+°?)?$")
LONGEST_LINE = 60
"""Characters in a table's cell above which its column is broken into lines."""
MOST_NAMED = 6
"""Traces named at most in the text that describes a chart."""


def page(report: Report) -> str:
    """The whole page; a report without a chart has no plotly.js."""
    has_charts = any(isinstance(one, Figure) for one in report.shown.values())
    numbers = {name: k for k, name in enumerate(report.shown, start=1)}
    return (
        templates()
        .get_template("page.html.j2")
        .render(
            report=report,
            numbers=numbers,
            policy=Markup(POLICY),
            config=CONFIG,
            plotly=packed_plotly() if has_charts else "",
        )
    )


@cache
def packed_plotly() -> str:
    """plotly.js (4.8 MB) in 2 MB: gzip, in base64; the page unpacks it by itself (``charts.js``)."""
    return base64.b64encode(gzip.compress(get_plotlyjs().encode(), mtime=0)).decode()


def escaped(text: str) -> Markup:
    """Text safe inside HTML; text between backticks becomes code, and a unit stays with its number."""
    unbroken = re.sub(r"(?<=\d) (?=[%°]|[mMkg]?[mgs]\b|cm[²³]|1/mm|MPa\b|kg/)", "\u00a0", text)
    found = re.sub(r"`([^`]+)`", r"<code>\1</code>", html.escape(unbroken, quote=True))
    if isinstance(text, Strong):
        return Markup(f"<strong>{found}</strong>")
    return Markup(f"<s>{found}</s>") if isinstance(text, Struck) else Markup(found)


def anchor(title: str) -> str:
    """Id of a section."""
    return re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-")


def embedded(spec: Spec) -> Markup:
    """A chart as JSON inside a script element; "<" is written as an escape, so no text can end the element."""
    text = json.dumps(spec, allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    return Markup(text.replace("<", "\\u003c"))


def alt(figure: Figure) -> str:
    """A chart in words, for readers who cannot see it: its axes and what is drawn in them."""
    traces = [html.unescape(str(trace["name"])) for trace in figure.spec["data"] if trace.get("name")]
    named = list(dict.fromkeys(traces))[:MOST_NAMED]
    return f"Chart. {axes_text(figure.spec)}{' Drawn: ' + ', '.join(named) + '.' if named else ''}".strip()


def axes_text(spec: Spec) -> str:
    """ "Across: …; up: …." by the titles of the axes, each once."""
    layout = spec["layout"]
    scene = layout.get("scene", {})
    found = []
    for letter, way in (("x", "Across"), ("y", "up"), ("z", "height")):
        axes = [one for key, one in (layout | scene).items() if re.fullmatch(rf"{letter}axis\d*", key)]
        titles = [html.unescape(text) for one in axes if (text := _title(one))]
        found += [f"{way}: {', '.join(dict.fromkeys(titles))}"] if titles else []
    return f"{'; '.join(found)}." if found else ""


def _title(axis: Mapping[str, Any]) -> str:
    """Title of an axis; without one, what stands along it."""
    text: str = axis.get("title", {}).get("text", "")
    return text or " and ".join(axis.get("ticktext", ()))


def captioned(one: Shown) -> str:
    """The caption below a figure; for a chart, with its axes."""
    return f"{axes_text(one.spec)} {one.caption}".strip() if isinstance(one, Figure) else one.caption


def column_classes(table: Table) -> list[str]:
    """Class of every column: "number" is aligned right, "sentence" is broken into lines."""
    found = []
    for column in zip(*table.rows, strict=True):
        is_number = all(cell == MISSING or NUMBER.match(cell) for cell in column)
        found.append("number" if is_number else "sentence" if any(len(cell) > LONGEST_LINE for cell in column) else "")
    return found or [""] * len(table.header)


def data_uri(picture: Picture) -> str:
    """A picture as a ``data:`` address, inside the page."""
    return f"data:image/png;base64,{base64.b64encode(picture.png).decode()}"


def drawn(drawing: Drawing) -> Markup:
    """The element itself, as this program made it with its texts escaped."""
    return Markup(drawing.svg)


@cache
def templates() -> Environment:
    """The templates with their filters."""
    # Imported here: the live page draws charts of reports without ever making a report.
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    made = Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        keep_trailing_newline=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters |= {
        "inline": escaped,
        "anchor": anchor,
        "embedded": embedded,
        "alt": alt,
        "captioned": captioned,
        "columns": column_classes,
        "data_uri": data_uri,
        "drawn": drawn,
        "kind": lambda block: type(block).__name__,
    }
    return made
