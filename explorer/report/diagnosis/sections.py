"""Sections of the report, in the order of the page: the answer and its proof first, then how it was found."""

from __future__ import annotations

from collections.abc import Callable

from explorer.report.content import Section
from explorer.report.diagnosis.data import data
from explorer.report.diagnosis.effects import effects
from explorer.report.diagnosis.error import error
from explorer.report.diagnosis.gates import gates
from explorer.report.diagnosis.in_short import in_short
from explorer.report.diagnosis.next_step import next_step
from explorer.report.diagnosis.parameters import parameters
from explorer.report.diagnosis.pile import pile
from explorer.report.diagnosis.repeat import repeat
from explorer.report.diagnosis.residuals import residuals
from explorer.report.diagnosis.seen import could_have_seen
from explorer.report.diagnosis.signatures import signatures
from explorer.report.findings import Plain

SECTIONS: tuple[Callable[[Plain], Section | None], ...] = (
    in_short,
    error,
    pile,
    residuals,
    effects,
    signatures,
    gates,
    could_have_seen,
    parameters,
    next_step,
    data,
    repeat,
)


def sections_of(result: Plain) -> tuple[Section, ...]:
    """Every section that ``result`` has something for."""
    found = (make(result) for make in SECTIONS)
    return tuple(section for section in found if section is not None)
