"""Sections as Markdown: the same facts and tables without the charts, suitable for an issue."""

from __future__ import annotations

import re
from collections.abc import Sequence

from explorer.report.content import (
    Block,
    Bullets,
    Caution,
    Code,
    Drawing,
    Facts,
    Figure,
    Folded,
    Picture,
    Report,
    Strong,
    Struck,
    Table,
    Text,
)

SPECIAL = re.compile(r"([\\*_\[\]<>#|~$]|&(?=#?\w+;))")
"""Characters that make emphasis, links, elements, headings, cells, struck or mathematical text, or entities."""


def document(report: Report) -> str:
    """The whole report."""
    about, banner = report.about, report.banner
    parts = [f"# {escaped(report.title)}", escaped(report.subtitle)]
    parts += [", ".join(escaped(one) for one in (about.author, about.date) if one)]
    if banner is not None:
        parts += [f"**{escaped(banner.headline)}** – {escaped(banner.why)}", f"Next: {escaped(banner.then)}"]
    parts += [f"Notes: {escaped(about.notes)}"] if about.notes else []
    parts = [part for part in parts if part]
    for section in report.sections:
        told = [text for block in section.blocks if (text := _block(block))]
        parts += [f"## {escaped(section.title)}", *told] if told else []
    return "\n\n".join(parts) + "\n"


def escaped(text: str) -> str:
    """Text in which Markdown and HTML see no markup; code spans stay, and line breaks become spaces."""
    pieces = re.split(r"(`[^`]+`)", text.replace("\n", " "))
    plain = "".join(
        piece.replace("|", r"\|") if piece.startswith("`") and len(piece) > 1 else SPECIAL.sub(r"\\\1", piece)
        for piece in pieces
    )
    mark = "**" if isinstance(text, Strong) else "~~" if isinstance(text, Struck) else ""
    return f"{mark}{plain}{mark}"


def _block(block: Block) -> str:
    match block:
        case Text(text):
            return escaped(text)
        case Caution(text):
            return f"> **Note:** {escaped(text)}"
        case Facts(pairs):
            return "\n".join(f"- **{escaped(what)}:** {escaped(value)}" for what, value in pairs)
        case Bullets(items):
            return "\n".join(f"- {escaped(item)}" for item in items)
        case Code(text):
            return f"```sh\n{text}\n```"
        case Table():
            return _table(block)
        case Figure() | Drawing() | Picture():
            return ""
        case Folded(title, blocks):
            return "\n\n".join([f"### {escaped(title)}", *(text for inner in blocks if (text := _block(inner)))])


def _table(table: Table) -> str:
    lines = [_row(table.header), "|" + "---|" * len(table.header), *map(_row, table.rows)]
    if table.caption:
        lines += ["", escaped(table.caption)]
    return "\n".join(lines)


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(map(escaped, cells))} |"
