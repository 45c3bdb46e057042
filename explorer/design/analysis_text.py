"""An analysed design for the terminal: the answer, then the tables behind it."""

from __future__ import annotations

from explorer.report.content import Facts, Table
from explorer.report.design.effects import curvature, effect_table
from explorer.report.design.model import diagnostics, fit_summary
from explorer.report.design.sections import factor_table, in_short
from explorer.report.design.target import settings_table, shape, target
from explorer.report.findings import Plain
from explorer.report.sections.surface import anova_table
from explorer.tables.text_table import text_table


def analysis_text(result: Plain) -> str:
    """All tables of the report that fit a terminal, without the charts."""
    parts = [_table(factor_table(result))]
    if result["effects"] is not None:
        parts.append(_table(effect_table(result["effects"])))
        if result["effects"]["curvature"] is not None:
            parts.append(curvature(result["effects"]))
    if result["surface"] is not None:
        parts += [_table(fit_summary(result)), _table(anova_table(result["surface"]["anova"][0]))]
    told: set[str] = set()
    for section in (in_short(result), diagnostics(result), shape(result), target(result)):
        if section is not None:
            facts = [pair for block in section.blocks if isinstance(block, Facts) for pair in block.pairs]
            # The answer stands first and again under its own heading in a report; a terminal needs it once.
            parts.append("\n".join(f"{what}: {words}" for what, words in facts if words not in told))
            told |= {words for _, words in facts}
    if result["optimum"] is not None:
        found = settings_table(result)
        parts.append(f"{_table(found)}\n{found.caption}")
    parts += [f"note: {note}" for note in result["notes"]]
    if result["surface"] is not None:
        parts += [f"note: {note}" for note in result["surface"]["anova"][0]["notes"]]
    return "\n\n".join(part for part in parts if part)


def _table(table: Table) -> str:
    # Typographic minus signs are no numbers to a terminal's columns.
    return text_table(table.header, [[cell.replace("−", "-").replace("–", "-") for cell in row] for row in table.rows])
