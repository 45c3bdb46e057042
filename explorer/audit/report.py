"""The audit as a report: the same sections as HTML and as Markdown."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from doe.audit import Audit, Figure
from explorer.audit.sentences import counted, recomputed_text, reproduced_by_place
from explorer.files.run_folder import json_text
from explorer.files.whole_file import write_whole
from explorer.report.content import Block, Bullets, Facts, Folded, Section, Table, Text
from explorer.report.html import page
from explorer.report.markdown import document
from explorer.report.units_for_people import MISSING

WHAT = (
    "A figure is reproduced if the recomputed value rounds to the print, allowing for the rounding of the printed "
    "numbers it is computed from. Everything is recomputed from the publication's own tables; nothing is simulated."
)


def write_audit(audit: Audit, folder: Path) -> None:
    """Write ``audit.json``, ``report.html`` and ``report.md`` into ``folder``; each appears complete or not at all."""
    texts = {
        "audit.json": json_text(audit.to_dict()) + "\n",
        "report.html": audit_html(audit),
        "report.md": document(*_headings(audit), audit_sections(audit)),
    }
    for name, text in texts.items():
        write_whole(folder / name, text)


def audit_html(audit: Audit) -> str:
    """The page."""
    return page(*_headings(audit), audit_sections(audit))


def _headings(audit: Audit) -> tuple[str, str]:
    return f"Audit: {audit.title}", audit.source or "A published study, recomputed from its own tables"


def audit_sections(audit: Audit) -> tuple[Section, ...]:
    """In short, what differs, remarks, what cannot be checked, what is reproduced."""
    return tuple(section for section in _sections(audit) if section.blocks)


def _sections(audit: Audit) -> Iterator[Section]:
    facts = (("Figures", str(len(audit.figures))), ("Of them", counted(audit)), ("Remarks", str(len(audit.remarks))))
    yield Section("In short", (Facts(facts), Text(WHAT)))
    yield Section("What differs", _table(audit.having("differs"), "How it was recomputed"))
    remarks = tuple(f"{remark.where}: {remark.text}" for remark in audit.remarks)
    yield Section("Remarks", (Bullets(remarks),) if remarks else ())
    yield Section("What cannot be checked", _unchecked(audit.having("cannot be checked")))
    yield Section("What is reproduced", _reproduced(audit))


def _table(figures: tuple[Figure, ...], how: str) -> tuple[Block, ...]:
    if not figures:
        return ()
    rows = tuple((f.where, f.quantity, f.printed or MISSING, recomputed_text(f), f.how) for f in figures)
    return (Table(("Where", "Figure", "Printed", "Recomputed", how), rows),)


def _unchecked(figures: tuple[Figure, ...]) -> tuple[Block, ...]:
    if not figures:
        return ()
    rows = tuple((f.where or MISSING, f.quantity, f.printed or MISSING, f.how) for f in figures)
    return (Table(("Where", "Figure", "Printed", "Why"), rows),)


def _reproduced(audit: Audit) -> tuple[Block, ...]:
    figures = audit.having("reproduced")
    if not figures:
        return ()
    counts = Table(("Where", "Check", "Figures"), reproduced_by_place(audit))
    return counts, Folded("Every one of them", _table(figures, "How it was recomputed"))
