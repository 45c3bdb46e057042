"""Sections of a report, one file per topic: pure functions from a result to a heading and its blocks."""

from __future__ import annotations

from collections.abc import Callable

from doe.studies.study_result import StudyResult
from explorer.report.content import Section
from explorer.report.sections.ascent import ascent
from explorer.report.sections.assumptions import assumptions, scan
from explorer.report.sections.effects import effects
from explorer.report.sections.further import further
from explorer.report.sections.noise import noise
from explorer.report.sections.optimum import optimum
from explorer.report.sections.overview import overview
from explorer.report.sections.paper import paper
from explorer.report.sections.repeat import repeat, runs
from explorer.report.sections.screening import screening
from explorer.report.sections.surface import surface
from explorer.report.sections.verification import verification

STAGES_FOUND: tuple[Callable[[StudyResult], Section | None], ...] = (
    overview,
    verification,
    effects,
    noise,
    screening,
    assumptions,
    scan,
    ascent,
    surface,
    optimum,
)
"""In the order of the page: what was found, then how."""
AT_THE_END: tuple[Callable[[StudyResult], Section | None], ...] = (paper, runs, repeat)


def sections_of(result: StudyResult) -> tuple[Section, ...]:
    """Every section that ``result`` has something for."""
    own, last = ((make(result) for make in makers) for makers in (STAGES_FOUND, AT_THE_END))
    return tuple(section for section in (*own, *further(result), *last) if section is not None)
