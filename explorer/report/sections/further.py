"""What stages of other packages found: one section each, from what every such result holds."""

from __future__ import annotations

from doe.stages import STAGES
from doe.studies.study_result import StudyResult
from explorer.report.content import Block, Bullets, Facts, Section, Text
from explorer.units import number


def further(result: StudyResult) -> tuple[Section, ...]:
    """Line, named findings, notes and the number of runs of every stage that this program does not have itself."""
    return tuple(_section(result, name) for name in result.further)


def _section(result: StudyResult, name: str) -> Section:
    found = result.further[name]
    facts = [(fact, value if isinstance(value, str) else number(value)) for fact, value in found.facts.items()]
    runs = sum(len(rows) for rows in found.runs)
    blocks: list[Block] = [Text(found.line)]
    if facts or runs:
        blocks.append(Facts((*facts, ("Runs", str(runs)))))
    if found.notes:
        blocks.append(Bullets(found.notes))
    # A result may be read where the package that made it is not installed.
    stage = STAGES.get(name)
    return Section(name.replace("_", " ").capitalize() if stage is None else stage.title, tuple(blocks))
