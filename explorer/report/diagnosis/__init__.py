"""The report of a diagnosis: what ``diagnosis.json`` holds, as a page with charts and as Markdown."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from explorer.diagnosis.result import DiagnosisResult
from explorer.report.content import Report, Section
from explorer.report.data import diagnosis_data
from explorer.report.diagnosis.answer import banner, in_short
from explorer.report.diagnosis.evidence import (
    effects,
    error,
    over_the_plate,
    parameters,
    pile,
    residuals,
    single_bodies,
)
from explorer.report.diagnosis.method import data, for_a_paper, how_reached, repeat
from explorer.report.diagnosis.rivals import could_have_seen, rivals
from explorer.report.html import page
from explorer.report.markdown import document
from explorer.report.methods import diagnosis_references

__all__ = ["diagnosis_html", "diagnosis_markdown", "diagnosis_report", "sections_of"]

SECTIONS: tuple[Callable[[DiagnosisResult], Section | None], ...] = (
    in_short,
    rivals,
    could_have_seen,
    error,
    pile,
    over_the_plate,
    residuals,
    single_bodies,
    effects,
    parameters,
    data,
    for_a_paper,
    how_reached,
    repeat,
)
"""In the order of the page: first the answer and its evidence, then how it was found."""


def diagnosis_report(result: DiagnosisResult) -> Report:
    """The report of a diagnosis."""
    found = result.data
    return Report(
        title=found.title or Path(found.folder).name,
        subtitle=f"Diagnosis of the measured data in {found.folder}",
        banner=banner(result),
        sections=sections_of(result),
        about=result.about,
        data=diagnosis_data(result),
        references=diagnosis_references(result),
    )


def diagnosis_html(result: DiagnosisResult) -> str:
    """The page: self-contained, with charts."""
    return page(diagnosis_report(result))


def diagnosis_markdown(result: DiagnosisResult) -> str:
    """The same facts without charts."""
    return document(diagnosis_report(result))


def sections_of(result: DiagnosisResult) -> tuple[Section, ...]:
    """Every section for which ``result`` has content."""
    found = (make(result) for make in SECTIONS)
    return tuple(section for section in found if section is not None)
