"""The findings of an audit as text for a terminal: what differs first, what is reproduced counted by its table."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from doe.audit import Audit, Figure, Status
from explorer.tables.text_table import text_table

HEADINGS: dict[Status, str] = {
    "differs": "differ",
    "cannot be checked": "cannot be checked",
    "reproduced": "reproduced",
}


def audit_text(audit: Audit) -> str:
    """Everything about ``audit`` but the list of what is reproduced, which stands in the report."""
    return "\n\n".join(part for part in _parts(audit) if part)


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
    """(place, check, how many) of what is reproduced, in the order of the study."""
    counts = Counter((figure.where, figure.check) for figure in audit.having("reproduced"))
    return tuple((where, check, str(count)) for (where, check), count in counts.items())


def _parts(audit: Audit) -> Iterator[str]:
    yield f"{audit.title}\n{audit.source}".rstrip()
    yield f"{len(audit.figures)} figures: {counted(audit)}; {len(audit.remarks)} remarks"
    yield _listed("DIFFERS", [_differs(figure) for figure in audit.having("differs")])
    yield _listed("REMARKS", [f"{remark.where}: {remark.text}" for remark in audit.remarks])
    unchecked = [f"{f.where}: {f.quantity}".lstrip(": ") + f": {f.how}" for f in audit.having("cannot be checked")]
    yield _listed("CANNOT BE CHECKED", unchecked)
    rows = reproduced_by_place(audit)
    if rows:
        yield "REPRODUCED\n" + text_table(("where", "check", "figures"), rows)


def _differs(figure: Figure) -> str:
    return f"{figure.where}: {figure.quantity}: {printed_and_recomputed(figure)}. {figure.how}"


def _listed(heading: str, lines: list[str]) -> str:
    return "\n".join((heading, *(f"- {line}" for line in lines))) if lines else ""
