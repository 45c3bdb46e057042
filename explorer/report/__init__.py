"""The report of a study: what ``result.json`` holds, as a page with charts, as Markdown, and as figures and data."""

from __future__ import annotations

from pathlib import Path

from doe.studies.study_result import StudyResult
from explorer.report import folder
from explorer.report.content import Report
from explorer.report.data import study_data
from explorer.report.html import page
from explorer.report.markdown import document
from explorer.report.methods import study_methods
from explorer.report.sections import sections_of
from explorer.report.sections.answer import banner

__all__ = ["report_html", "report_markdown", "study_report", "write_report"]


def study_report(result: StudyResult) -> Report:
    """The report of a calibration."""
    study = result.study
    return Report(
        title=study.title or study.name,
        subtitle=f"Calibration report of the study {study.name}, profile {study.profile.name}",
        banner=banner(result),
        sections=sections_of(result),
        about=result.about,
        data=study_data(result),
        references=study_methods(result)[1],
    )


def write_report(result: StudyResult, place: Path, results: dict[str, str] | None = None) -> str:
    """Write the files of `explorer.report.folder` into ``place``; returns its line for the user."""
    return folder.write_report(study_report(result), place, results)


def report_html(result: StudyResult) -> str:
    """The page: self-contained, with charts."""
    return page(study_report(result))


def report_markdown(result: StudyResult) -> str:
    """The same facts without charts."""
    return document(study_report(result))
