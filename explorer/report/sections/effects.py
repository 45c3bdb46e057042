"""Factors and assumptions side by side: what moves the response, declared or not."""

from __future__ import annotations

from doe.studies.factors import MIN_BODIES
from doe.studies.study_result import StudyResult
from explorer.report.content import Block, Figure, Section, Text
from explorer.report.figures.effects import all_effects
from explorer.report.sections.overview import assumption_statement
from explorer.units import observable_label


def effects(result: StudyResult) -> Section:
    """All effects in one chart, and what the calibration hangs on."""
    response = observable_label(result.screening.response)
    text = f"Effects on {response}, each over its own range, with 95 % intervals."
    blocks: list[Block] = [Text(text)]
    title = "What moves the angle" if "angle" in response else "What moves the response"
    if result.assumptions is not None:
        statement = assumption_statement(result)
        blocks.append(Text(f"What the calibration hangs on: {statement}."))
    caption = "Effect = mean at the high level − mean at the low level; valid pours only."
    if any(part is not None and part.not_testable for part in (result.screening, result.assumptions)):
        caption += f" Not testable: acts on fewer than {MIN_BODIES} bodies."
    return Section(title, (*blocks, Figure("effects", all_effects(result.screening, result.assumptions), caption)))
