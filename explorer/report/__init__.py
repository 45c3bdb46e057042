"""The report of a study: what ``result.json`` holds, as a page with charts and as Markdown."""

from __future__ import annotations

from pathlib import Path

from doe.studies.study_result import StudyResult
from explorer.files.output_file import write_whole
from explorer.report.html import page
from explorer.report.markdown import document
from explorer.report.sections import sections_of

__all__ = ["headings_of", "report_html", "report_markdown", "write_report"]


def write_report(result: StudyResult, folder: Path) -> None:
    """Write ``report.html`` and ``report.md`` into ``folder``; each appears complete or not at all."""
    texts = {"report.html": report_html(result), "report.md": report_markdown(result)}
    for name, text in texts.items():
        write_whole(folder / name, text)


def report_html(result: StudyResult) -> str:
    """The page: self-contained, with charts."""
    return page(*headings_of(result), sections_of(result))


def report_markdown(result: StudyResult) -> str:
    """The same facts without charts."""
    return document(*headings_of(result), sections_of(result))


def headings_of(result: StudyResult) -> tuple[str, str]:
    """Title and subtitle of the report."""
    study = result.study
    return study.title or study.name, f"Calibration report of the study {study.name}, profile {study.profile.name}"
