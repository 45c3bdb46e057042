"""An analysed design for the terminal: the answer, then the tables behind it."""

from __future__ import annotations

from explorer.design.result import DesignResult
from explorer.report.content import Facts, Table
from explorer.report.design.effects import curvature, effect_table
from explorer.report.design.model import diagnostics, fit_summary
from explorer.report.design.sections import factor_table, in_short
from explorer.report.design.target import settings_table, shape, target
from explorer.report.sections.surface import anova_table
from explorer.tables.text_table import text_table


def analysis_text(result: DesignResult) -> str:
    """All tables of the report that fit a terminal, without the charts."""
    parts = [_table(factor_table(result))]
    found, effects = result.analysis, result.effects
    if effects is not None:
        parts.append(_table(effect_table(effects)))
        if effects.curvature is not None:
            parts.append(curvature(effects.curvature, effects.response))
    if found.model is not None:
        parts += [_table(fit_summary(found)), _table(anova_table(found.model.anova))]
    told: set[str] = set()
    for section in (in_short(result), diagnostics(result), shape(result), target(result)):
        if section is not None:
            facts = [pair for block in section.blocks if isinstance(block, Facts) for pair in block.pairs]
            # The answer stands first and again under its own heading in a report; a terminal needs it once.
            parts.append("\n".join(f"{what}: {words}" for what, words in facts if words not in told))
            told |= {words for _, words in facts}
    if result.optimum is not None:
        settings = settings_table(result, result.optimum)
        parts.append(f"{_table(settings)}\n{settings.caption}")
    parts += [f"note: {note}" for note in found.notes]
    if found.model is not None:
        parts += [f"note: {note}" for note in found.model.anova.notes]
    return "\n\n".join(part for part in parts if part)


def _table(table: Table) -> str:
    # Typographic minus signs are no numbers to a terminal's columns.
    return text_table(table.header, [[cell.replace("−", "-").replace("–", "-") for cell in row] for row in table.rows])
