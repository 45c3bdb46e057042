"""The report of a diagnosis: what ``diagnosis.json`` holds, as a page with charts and as Markdown."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from explorer.diagnosis.result import DiagnosisResult
from explorer.files.output_file import write_whole
from explorer.report.content import Section
from explorer.report.diagnosis.answer import could_have_seen, in_short, rivals
from explorer.report.diagnosis.evidence import effects, error, over_the_plate, parameters, pile, residuals
from explorer.report.diagnosis.method import data, for_a_paper, how_reached, repeat
from explorer.report.html import page
from explorer.report.markdown import document

__all__ = ["diagnosis_html", "diagnosis_markdown", "headings_of", "sections_of", "write_diagnosis_report"]

SECTIONS: tuple[Callable[[DiagnosisResult], Section | None], ...] = (
    in_short,
    rivals,
    could_have_seen,
    error,
    pile,
    over_the_plate,
    residuals,
    effects,
    parameters,
    data,
    for_a_paper,
    how_reached,
    repeat,
)
"""In the order of the page: the answer and what it rests on first, then how it was found."""


def write_diagnosis_report(result: DiagnosisResult, folder: Path) -> None:
    """Write ``report.html`` and ``report.md`` into ``folder``; each appears complete or not at all."""
    texts = {"report.html": diagnosis_html(result), "report.md": diagnosis_markdown(result)}
    for name, text in texts.items():
        write_whole(folder / name, text)


def diagnosis_html(result: DiagnosisResult) -> str:
    """The page: self-contained, with charts."""
    return page(*headings_of(result), sections_of(result))


def diagnosis_markdown(result: DiagnosisResult) -> str:
    """The same facts without charts."""
    return document(*headings_of(result), sections_of(result))


def sections_of(result: DiagnosisResult) -> tuple[Section, ...]:
    """Every section that ``result`` has something for."""
    found = (make(result) for make in SECTIONS)
    return tuple(section for section in found if section is not None)


def headings_of(result: DiagnosisResult) -> tuple[str, str]:
    """Title and subtitle of the report."""
    found = result.data
    return found.title or Path(found.folder).name, f"Diagnosis of the measured data in {found.folder}"
