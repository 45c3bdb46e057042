"""Sections of a report, one file per topic: pure functions from a result to a heading and its blocks."""

from __future__ import annotations

from collections.abc import Callable

from doe.studies.study_result import StudyResult
from explorer.report.content import Section
from explorer.report.methods import study_methods
from explorer.report.sections.answer import effects, overview, parameters, piles, verification
from explorer.report.sections.designs import assumptions, noise, reach, scan, screening
from explorer.report.sections.optimum import optimum
from explorer.report.sections.reproduction import further, paper, repeat, runs
from explorer.report.sections.surface import ascent, surface
from explorer.report.set_up import set_up


def materials(result: StudyResult) -> Section | None:
    """What was poured into what."""
    return set_up(result.set_up, result.study.assumed, result.experiments)


def methods(result: StudyResult) -> Section:
    """The paragraph for a paper."""
    return study_methods(result)[0]


STAGES_FOUND: tuple[Callable[[StudyResult], Section | None], ...] = (
    parameters,
    overview,
    materials,
    piles,
    verification,
    effects,
    noise,
    reach,
    screening,
    assumptions,
    scan,
    ascent,
    surface,
    optimum,
)
"""In the order of the page: what was found, then how."""
AT_THE_END: tuple[Callable[[StudyResult], Section | None], ...] = (paper, methods, runs, repeat)


def sections_of(result: StudyResult) -> tuple[Section, ...]:
    """Every section for which ``result`` has content."""
    own, last = ((make(result) for make in makers) for makers in (STAGES_FOUND, AT_THE_END))
    return tuple(section for section in (*own, *further(result), *last) if section is not None)
