"""The findings of an audit for a reader: a text for the terminal, and the same sections as HTML and as Markdown.

What differs comes first; what is reproduced is counted by its table, what needs a slack is listed with it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

from doe.audit import Audit, Figure, Status
from doe.provenance import About
from explorer.files.run_folder import json_text
from explorer.files.run_result import versions
from explorer.report import content
from explorer.report.content import Banner, Block, Bullets, DataTable, Facts, Folded, Report, Section, Table, Text, Word
from explorer.report.figures.style import ASSUMPTION, CHOSEN, DUMMY, TARGET, axis, chart, label
from explorer.report.folder import write_report
from explorer.report.html import page
from explorer.report.methods import audit_methods
from explorer.terminal.text_table import text_table
from explorer.units import MISSING

HEADINGS: dict[Status, str] = {
    "differs": "differ",
    "cannot be checked": "cannot be checked",
    "only if rounded": "reproduced only if rounded",
    "reproduced exactly": "reproduced exactly",
}
REPRODUCED: tuple[Status, ...] = ("reproduced exactly", "only if rounded")
NOBODY = About()
COLOURS: dict[Status, str] = {
    "differs": CHOSEN,
    "cannot be checked": DUMMY,
    "only if rounded": ASSUMPTION,
    "reproduced exactly": TARGET,
}
NOWHERE = "no place named"
ROW = 26
"""Height of a bar [px]."""
WHAT = (
    "A figure is reproduced exactly if the recomputed value rounds to the print. The figures of an analysis of "
    "variance are first held against one another, as far as the rounding of each allows, and then against the runs. "
    "What comes out only if the runs, or other inputs, were rounded before they were printed is listed with the slack "
    "that this gives. Everything is recomputed from the publication's own tables; nothing is simulated."
)


@dataclass(frozen=True)
class AuditResult(Audit):
    """The content of ``audit.json``: the findings, and who made them and with what."""

    NAME: ClassVar[str] = "audit.json"

    about: About = NOBODY
    versions: dict[str, str | None] = field(default_factory=dict)


def audit_result(audit: Audit, about: About = NOBODY) -> AuditResult:
    """``audit`` with who made it."""
    return AuditResult(audit.title, audit.source, audit.figures, audit.remarks, about, versions())


def audit_text(audit: Audit) -> str:
    """Everything about ``audit`` but the list of what is reproduced, which stands in the report."""
    return "\n\n".join(part for part in _parts(audit) if part)


def _parts(audit: Audit) -> Iterator[str]:
    yield f"{audit.title}\n{audit.source}".rstrip()
    yield f"{len(audit.figures)} figures: {counted(audit)}; {len(audit.remarks)} remarks"
    yield _listed("DIFFERS", [_differs(figure) for figure in audit.having("differs")])
    yield _listed("REMARKS", [f"{remark.where}: {remark.text}" for remark in audit.remarks])
    unchecked = [f"{f.where}: {f.quantity}".lstrip(": ") + f": {f.how}" for f in audit.having("cannot be checked")]
    yield _listed("CANNOT BE CHECKED", unchecked)
    yield _listed("ONLY IF ROUNDED", [_differs(figure) for figure in audit.having("only if rounded")])
    rows = reproduced_by_place(audit)
    if rows:
        yield "REPRODUCED EXACTLY\n" + text_table(("where", "check", "figures"), rows)


def _differs(figure: Figure) -> str:
    return f"{figure.where}: {figure.quantity}: {printed_and_recomputed(figure)}. {figure.how}"


def _listed(heading: str, lines: list[str]) -> str:
    return "\n".join((heading, *(f"- {line}" for line in lines))) if lines else ""


def write_audit(audit: Audit, folder: Path, about: About = NOBODY) -> None:
    """Write ``audit.json`` and the report into ``folder``; each appears complete or not at all."""
    found = audit_result(audit, about)
    write_report(audit_report(found), folder, {found.NAME: json_text(found.to_dict()) + "\n"})


def audit_html(audit: Audit) -> str:
    """The page."""
    return page(audit_report(audit_result(audit)))


def audit_report(audit: AuditResult) -> Report:
    """The report of an audit."""
    methods, references = audit_methods(audit, WHAT, audit.versions)
    figures = DataTable(
        "figures",
        ("where", "figure", "status", "printed", "recomputed", "slack", "how"),
        tuple(
            (f.where, f.quantity, f.status, f.printed, recomputed_text(f), f"{f.slack:.2g}", f.how)
            for f in audit.figures
        ),
    )
    return Report(
        f"Audit: {audit.title}",
        audit.source or "A published study, recomputed from its own tables",
        banner(audit),
        (*audit_sections(audit), methods),
        audit.about,
        (figures,),
        references,
    )


def banner(audit: Audit) -> Banner:
    """Whether the study's own tables give what it prints."""
    wrong, right = len(audit.having("differs")), len(audit.having(*REPRODUCED))
    why = f"Of {len(audit.figures)} printed figures, {counted(audit)}."
    if wrong:
        return Banner(
            Word.DIFFERS, f"in {wrong}", why, "Read what differs, first below, before any of these numbers is used."
        )
    if right:
        return Banner(
            Word.REPRODUCED,
            "",
            why,
            "The study’s numbers follow from its tables; whether these hold is another question.",
        )
    return Banner(Word.NO_ANSWER, "", why, "Type in the tables that the checks need; the last section says which.")


def audit_sections(audit: Audit) -> tuple[Section, ...]:
    """In short, what differs, remarks, what cannot be checked, what is reproduced only if rounded, and what exactly."""
    return tuple(section for section in _sections(audit) if section.blocks)


def _sections(audit: Audit) -> Iterator[Section]:
    facts = (("Figures", str(len(audit.figures))), ("Of them", counted(audit)), ("Remarks", str(len(audit.remarks))))
    caption = f"n = {len(audit.figures)} figures, each recomputed from the publication’s own tables and graded."
    shown = (content.Figure("grades", graded(audit), caption),) if audit.figures else ()
    yield Section("In short", (Facts(facts), Text(WHAT), *shown))
    yield Section("What differs", _table(audit.having("differs"), "How it was recomputed"))
    remarks = tuple(f"{remark.where}: {remark.text}" for remark in audit.remarks)
    yield Section("Remarks", (Bullets(remarks),) if remarks else ())
    yield Section("What cannot be checked", _unchecked(audit.having("cannot be checked")))
    rounded = audit.having("only if rounded")
    yield Section("What is reproduced only if its inputs were rounded", _table(rounded, "How, and with what slack"))
    yield Section("What is reproduced exactly", _reproduced(audit))


def graded(audit: Audit) -> content.Spec:
    """Figures by where they are printed, as bars of their grades, the first place on top."""
    places = list(dict.fromkeys(figure.where or NOWHERE for figure in audit.figures))
    counts = Counter((figure.where or NOWHERE, figure.status) for figure in audit.figures)
    traces = [
        {
            "type": "bar",
            "orientation": "h",
            "y": list(map(label, places)),
            "x": [counts[place, status] for place in places],
            "name": words,
            "marker": {"color": COLOURS[status]},
        }
        for status, words in HEADINGS.items()
        if any(counts[place, status] for place in places)
    ]
    rows = axis("", categoryorder="array", categoryarray=list(map(label, places[::-1])))
    layout = {"barmode": "stack", "xaxis": axis("printed figures"), "yaxis": rows}
    return chart(traces, layout, 110 + ROW * len(places))


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
    figures = audit.having("reproduced exactly")
    if not figures:
        return ()
    counts = Table(("Where", "Check", "Figures"), reproduced_by_place(audit))
    return counts, Folded("Every one of them", _table(figures, "How it was recomputed"))


def counted(audit: Audit) -> str:
    """The counts in one line."""
    counts = Counter(figure.status for figure in audit.figures)
    return ", ".join(f"{counts[status]} {words}" for status, words in HEADINGS.items())


def printed_and_recomputed(figure: Figure) -> str:
    """Both numbers of a figure that differs, in one phrase."""
    return f"printed {figure.printed}, recomputed {recomputed_text(figure)}"


def recomputed_text(figure: Figure) -> str:
    """What was recomputed, with a digit more than the print; a dash where nothing was."""
    if figure.recomputed is None:
        return "-"
    if isinstance(figure.recomputed, str):
        return figure.recomputed
    digits = figure.printed.lstrip("<>+-").partition(".")[2]
    if not digits.isdigit() and "." in figure.printed:
        return f"{figure.recomputed:.4g}"
    text = f"{figure.recomputed:.{len(digits) + 1}f}"
    if not float(text) and figure.recomputed:
        return f"{figure.recomputed:.2g}"
    return text.removesuffix("0") if digits else text.removesuffix(".0")


def reproduced_by_place(audit: Audit) -> tuple[tuple[str, str, str], ...]:
    """(place, check, how many) of what is reproduced exactly, in the order of the study."""
    counts = Counter((figure.where, figure.check) for figure in audit.having("reproduced exactly"))
    return tuple((where, check, str(count)) for (where, check), count in counts.items())
