"""Sections as one HTML page that needs nothing else: plotly.js stands in it, and no request leaves it.

It is calm, readable, and light or dark as the reader's system is.
"""

from __future__ import annotations

import html
import json
import re
from collections.abc import Sequence

from plotly.offline import get_plotlyjs

from explorer.report.content import Block, Bullets, Caution, Code, Facts, Figure, Folded, Section, Spec, Table, Text
from explorer.report.figures.style import CONFIG
from explorer.units import MISSING

STYLE = """
:root { --ink: #23272c; --soft: #5d656e; --page: #fdfcfa; --card: #f4f2ee; --line: #dedad2; --accent: #3d7fb8;
  --caution: #f8efdf; --caution-line: #d07a2c; color-scheme: light dark; }
@media (prefers-color-scheme: dark) { :root { --ink: #e4e2de; --soft: #a2a8ae; --page: #191b1e; --card: #212428;
  --line: #363b41; --accent: #6fa8d8; --caution: #2d261c; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--page); color: var(--ink); line-height: 1.55;
  font: 16px/1.55 system-ui, "Segoe UI", "Helvetica Neue", Arial, sans-serif; font-variant-numeric: tabular-nums; }
main, header, footer { max-width: 1120px; margin: 0 auto; padding: 0 28px; }
header { padding-top: 44px; }
h1 { font-size: 1.75rem; font-weight: 600; margin: 0 0 4px; letter-spacing: -0.01em; }
h2 { font-size: 1.25rem; font-weight: 600; margin: 52px 0 10px; padding-top: 14px; border-top: 1px solid var(--line); }
header p, figcaption, caption, footer { color: var(--soft); font-size: 0.9rem; }
p, ul { max-width: 78ch; }
nav { display: flex; flex-wrap: wrap; gap: 4px 18px; margin: 18px 0 0; font-size: 0.92rem; }
a { color: var(--accent); text-decoration: none; }
a:hover { text-decoration: underline; }
code, pre { font: 0.87em/1.5 ui-monospace, "SF Mono", Menlo, Consolas, monospace; }
code { background: var(--card); padding: 1px 3px; border-radius: 4px; }
pre { background: var(--card); padding: 12px 16px; border-radius: 8px; overflow-x: auto; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 8px 22px; background: var(--card); border-radius: 10px;
  padding: 18px 22px; margin: 16px 0; }
dt { color: var(--soft); max-width: 22ch; }
dd { margin: 0; }
.caution { background: var(--caution); border-left: 3px solid var(--caution-line); border-radius: 0 8px 8px 0;
  padding: 9px 16px; margin: 10px 0; max-width: none; }
.scroll { overflow-x: auto; margin: 16px 0; }
table { border-collapse: collapse; font-size: 0.87rem; min-width: 40%; }
caption { caption-side: bottom; text-align: left; padding-top: 7px; }
th { text-align: left; font-weight: 600; color: var(--soft); vertical-align: bottom; max-width: 15ch; }
th, td { padding: 5px 14px 5px 0; border-bottom: 1px solid var(--line); }
td { white-space: nowrap; }
td.sentence { white-space: normal; min-width: 40ch; }
.number { text-align: right; }
figure { margin: 22px 0; }
figcaption { margin-top: 6px; }
details { margin: 14px 0; }
summary { cursor: pointer; color: var(--accent); }
footer { margin-top: 60px; padding-bottom: 40px; }
@media (max-width: 700px) { dl { grid-template-columns: 1fr; gap: 2px; } dd { margin-bottom: 8px; } }
"""

SCRIPT = """
const dark = window.matchMedia("(prefers-color-scheme: dark)");
const ofPage = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
function template() {
  const axis = { gridcolor: ofPage("--line"), linecolor: ofPage("--line"), zerolinecolor: ofPage("--soft"),
    zeroline: false, ticks: "outside", tickcolor: ofPage("--line") };
  const layout = { paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
    font: { color: ofPage("--ink"), family: getComputedStyle(document.body).fontFamily, size: 12.5 },
    modebar: { bgcolor: "rgba(0,0,0,0)", color: ofPage("--line"), activecolor: ofPage("--accent") } };
  for (const k of ["", "2", "3", "4", "5", "6"]) { layout["xaxis" + k] = axis; layout["yaxis" + k] = axis; }
  return { layout };
}
const charts = [...document.querySelectorAll("figure > script")].map(source => {
  const place = source.nextElementSibling, chart = JSON.parse(source.textContent);
  Plotly.newPlot(place, chart.data, { ...chart.layout, template: template() }, { ...config, responsive: true });
  return place;
});
dark.addEventListener("change", () => charts.forEach(place => Plotly.relayout(place, { template: template() })));
"""

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
