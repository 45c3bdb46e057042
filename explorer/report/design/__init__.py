"""The report of a design that was run anywhere: its ``result.json`` as a page with charts, Markdown, figures and "
"data."""

from __future__ import annotations

from pathlib import Path

from explorer.design.result import DesignResult
from explorer.report.content import Report
from explorer.report.data import design_data
from explorer.report.design.sections import banner, sections_of
from explorer.report.html import page
from explorer.report.markdown import document
from explorer.report.methods import design_methods
from explorer.units import counted

__all__ = ["design_html", "design_markdown", "design_report"]


def design_report(result: DesignResult) -> Report:
    """The report of an analysed design."""
    kind = f"{result.design} design" if result.design else "Design"
    return Report(
        title=result.response.name.replace("_", " "),
        subtitle=f"{kind} of {counted(len(result.factors), 'factor')}, analysed from {Path(result.sheet).name}",
        banner=banner(result),
        sections=sections_of(result),
        about=result.about,
        data=design_data(result),
        references=design_methods(result)[1],
    )


def design_html(result: DesignResult) -> str:
    """The page: self-contained, with charts."""
    return page(design_report(result))


def design_markdown(result: DesignResult) -> str:
    """The same facts without charts."""
    return document(design_report(result))
