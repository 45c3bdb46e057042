"""Sections as one HTML page that needs nothing else: plotly.js stands in it, and no request leaves it."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Sequence

from plotly.offline import get_plotlyjs

from explorer.report.content import Block, Bullets, Caution, Code, Facts, Figure, Folded, Section, Spec, Table, Text
from explorer.report.figures.style import CONFIG
from explorer.report.page_style import SCRIPT, STYLE
from explorer.report.units_for_people import MISSING

POLICY = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:"
"""Content security policy: what would load something from elsewhere is refused by the browser."""
NUMBER = re.compile(r"^(± )?[−+<>]?\d[\d.e−+]*( ?(°|%|σ|mm|1/mm|cm²|cm³|MPa|g|s|min|g/s|m/s|kg/m³))?( ± [\d.]+°?)?$")


LONGEST_LINE = 60
"""Characters of a table's cell beyond which its column is broken into lines."""


def page(title: str, subtitle: str, sections: Sequence[Section]) -> str:
    """The whole page."""
    links = "\n".join(f'<a href="#{anchor(section.title)}">{escaped(section.title)}</a>' for section in sections)
    body = "\n".join(_section(section) for section in sections)
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{POLICY}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{escaped(title)}</title>
<style>{STYLE}</style>
</head>
<body>
<header>
<h1>{escaped(title)}</h1>
<p>{escaped(subtitle)}</p>
<nav>
{links}
</nav>
</header>
<main>
{body}
</main>
<script id="plotly">{get_plotlyjs()}</script>
<script>const config = {json.dumps(CONFIG)};
{SCRIPT}</script>
</body>
</html>
"""


def escaped(text: str) -> str:
    """Text safe inside HTML; what stands between backticks becomes code, and a unit stays with its number."""
    unbroken = re.sub(r"(?<=\d) (?=[%°]|[mMkg]?[mgs]\b|cm[²³]|1/mm|MPa\b|kg/)", "\u00a0", text)
    return re.sub(r"`([^`]+)`", r"<code>\1</code>", html.escape(unbroken, quote=True))


def anchor(title: str) -> str:
    """Id of a section."""
    return re.sub(r"[^a-z0-9]+", "-", title.lower()).strip("-")


def embedded(spec: Spec) -> str:
    """A chart as JSON inside a script element; "<" is written as an escape, so no text can end the element."""
    return json.dumps(spec, allow_nan=False, ensure_ascii=False, separators=(",", ":")).replace("<", "\\u003c")


def _section(section: Section) -> str:
    blocks = "\n".join(_block(block) for block in section.blocks)
    return f'<section id="{anchor(section.title)}">\n<h2>{escaped(section.title)}</h2>\n{blocks}\n</section>'


def _block(block: Block) -> str:
    match block:
        case Text(text):
            return f"<p>{escaped(text)}</p>"
        case Caution(text):
            return f'<p class="caution">{escaped(text)}</p>'
        case Facts(pairs):
            return f"<dl>{''.join(f'<dt>{escaped(what)}</dt><dd>{escaped(value)}</dd>' for what, value in pairs)}</dl>"
        case Bullets(items):
            return f"<ul>{''.join(f'<li>{escaped(item)}</li>' for item in items)}</ul>"
        case Code(text):
            return f"<pre>{html.escape(text)}</pre>"
        case Table():
            return _table(block)
        case Figure():
            return _figure(block)
        case Folded(title, blocks):
            inside = "\n".join(_block(inner) for inner in blocks)
            return f"<details><summary>{escaped(title)}</summary>\n{inside}\n</details>"


def _figure(figure: Figure) -> str:
    source = f'<script type="application/json">{embedded(figure.spec)}</script>'
    caption = f"<figcaption>{escaped(figure.caption)}</figcaption>" if figure.caption else ""
    height = figure.spec["layout"]["height"]
    return f'<figure id="{figure.name}">{source}<div style="height:{height}px"></div>{caption}</figure>'


def _table(table: Table) -> str:
    numeric = [all(_is_number(row[k]) for row in table.rows) for k in range(len(table.header))]
    long = [any(len(row[k]) > LONGEST_LINE for row in table.rows) for k in range(len(table.header))]
    kinds = [
        ' class="number"' if is_number else ' class="sentence"' if is_long else ""
        for is_number, is_long in zip(numeric, long, strict=True)
    ]
    head = "".join(f"<th{kind}>{escaped(cell)}</th>" for kind, cell in zip(kinds, table.header, strict=True))
    rows = "\n".join(
        f"<tr>{''.join(f'<td{kind}>{escaped(cell)}</td>' for kind, cell in zip(kinds, row, strict=True))}</tr>"
        for row in table.rows
    )
    caption = f"<caption>{escaped(table.caption)}</caption>" if table.caption else ""
    return (
        f'<div class="scroll"><table>{caption}<thead><tr>{head}</tr></thead>\n<tbody>\n{rows}\n</tbody></table></div>'
    )


def _is_number(cell: str) -> bool:
    return cell == MISSING or NUMBER.match(cell) is not None
