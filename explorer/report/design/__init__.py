"""The report of a design that was run anywhere: its ``result.json`` as a page with charts and as Markdown."""

from __future__ import annotations

from pathlib import Path

from explorer.design.result import DesignResult
from explorer.files.output_file import write_whole
from explorer.report.design.sections import sections_of
from explorer.report.html import page
from explorer.report.markdown import document

__all__ = ["design_html", "design_markdown", "write_design_report"]


def write_design_report(result: DesignResult, folder: Path) -> None:
    """Write ``report.html`` and ``report.md`` into ``folder``; each appears complete or not at all."""
    texts = {"report.html": design_html(result), "report.md": design_markdown(result)}
    for name, text in texts.items():
        write_whole(folder / name, text)


def design_html(result: DesignResult) -> str:
    """The page: self-contained, with charts."""
    return page(*_headings(result), sections_of(result))


def design_markdown(result: DesignResult) -> str:
    """The same facts without charts."""
    return document(*_headings(result), sections_of(result))


def _headings(result: DesignResult) -> tuple[str, str]:
    kind = f"{result.design} design" if result.design else "Design"
    return result.response.name, f"{kind} of {len(result.factors)} factors, analysed from {Path(result.sheet).name}"
