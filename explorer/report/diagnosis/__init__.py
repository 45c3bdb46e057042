"""The report of a diagnosis: what ``diagnosis.json`` holds, as a page with charts and as Markdown."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from explorer.files.whole_file import write_whole
from explorer.report.diagnosis.sections import sections_of
from explorer.report.html import page
from explorer.report.markdown import document

__all__ = ["diagnosis_html", "diagnosis_markdown", "write_diagnosis_report"]


def write_diagnosis_report(result: dict[str, Any], folder: Path) -> None:
    """Write ``report.html`` and ``report.md`` into ``folder``; each appears complete or not at all.

    ``result`` is the content of ``diagnosis.json`` (see `explorer.diagnosis.run.result_of`).
    """
    texts = {"report.html": diagnosis_html(result), "report.md": diagnosis_markdown(result)}
    for name, text in texts.items():
        write_whole(folder / name, text)


def diagnosis_html(result: dict[str, Any]) -> str:
    """The page: self-contained, with charts."""
    return page(*_headings(result), sections_of(result))


def diagnosis_markdown(result: dict[str, Any]) -> str:
    """The same facts without charts."""
    return document(*_headings(result), sections_of(result))


def _headings(result: dict[str, Any]) -> tuple[str, str]:
    data = result["data"]
    return data["title"] or Path(data["folder"]).name, f"Diagnosis of the measured data in {data['folder']}"
