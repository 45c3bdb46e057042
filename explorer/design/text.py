"""What `explorer design` and `explorer analyse` print.

For a design: its size, its aliases, and the effects that it can detect. For an analysis: the answer, then the tables
behind it.
"""

from __future__ import annotations

import math
from typing import Any

from doe.analysis.mixture import bearable_order, mixture_terms
from doe.designs import DESIGNS, factor_letters
from doe.record import plain
from explorer.design.factors_file import DesignFactor, FactorsFile
from explorer.design.plan_result import OF_NAMES, TERMS, beyond, blocks, planned_order, planned_power
from explorer.design.result import DesignResult
from explorer.design.run_plan import RunPlan
from explorer.errors import CommandError
from explorer.report.content import Facts, Table
from explorer.report.design.elementary import elementary_table
from explorer.report.design.groups import components_table, estimates_table, tests_table
from explorer.report.design.model import (
    curvature,
    diagnostics,
    effect_table,
    few_terms_table,
    fit_summary,
    mixture_table,
)
from explorer.report.design.names import groups_table, means_table
from explorer.report.design.sections import factor_table, in_short, settings_table, shape, target
from explorer.report.design.surrogate import errors_table, lengths_table, process_settings
from explorer.report.sections.surface import anova_table, variance_table
from explorer.terminal.text_table import text_table
from explorer.units import counted, number


def check_power(design: str, sigma: float | None, effect: float | None) -> None:
    """Refuse impossible values for the standard deviation of a run and the change to detect, and both for a mixture."""
    for option, value in (("--sigma", sigma), ("--effect", effect)):
        if value is not None and not 0 < value < math.inf:
            raise CommandError(f"{option} {value:g}: allowed: a positive number")
        if value is not None and design in DESIGNS and DESIGNS[design].mixture:
            raise CommandError(f"{option}: is not for {design}, whose parts have no effects of their own")


def plan_result(plan: RunPlan, file: FactorsFile, sigma: float | None, effect: float | None) -> dict[str, Any]:
    """A design as JSON types."""
    return {
        "design": plan.design.name,
        "traits": list(plan.points.traits),
        "generators": list(plan.points.generators),
        "rows": len(plan.coded),
        "replicates": plan.replicates,
        "runs": len(plan.sequence),
        "seed": plan.seed,
        "factors": [
            {"symbol": letter} | factor.to_dict()
            for letter, factor in zip(factor_letters(len(file.factors)), file.factors, strict=True)
        ],
        "coded": plan.coded.tolist(),
        **({"block": (plan.block + 1).tolist()} if len(plan.block) else {}),
        "aliases": list(plan.points.aliases),
        **({} if plan.points.efficiency is None else _optimal_result(plan)),
        "model": planned_order(plan, file),
        "power": plain(list(planned_power(plan, file, sigma, effect))),
    }


def _optimal_result(plan: RunPlan) -> dict[str, Any]:
    """The properties of an optimal design, as JSON types."""
    assert plan.points.efficiency is not None
    return {
        "efficiency": plan.points.efficiency.to_dict(),
        "kept": len(plan.finished),
        "gained": list(plan.points.gained),
    }


def plan_text(plan: RunPlan, file: FactorsFile, sigma: float | None, effect: float | None) -> str:
    """A design in words and tables."""
    letters = factor_letters(len(file.factors))
    parts = [
        f"{', '.join([plan.design.name, *plan.points.traits])}: {len(plan.coded)} rows × {plan.replicates} "
        f"= {len(plan.sequence)} runs",
        text_table(
            ["", "factor", "low", "high", "unit"],
            [
                [letter, f.name, *([f.levels[0], f.levels[-1], "name"] if f.levels else _range(f))]
                for letter, f in zip(letters, file.factors, strict=True)
            ],
        ),
        *beyond(plan, file),
        *blocks(plan),
    ]
    if plan.points.aliases:
        lines = "\n".join(plan.points.aliases)
        parts.append(f"aliases (what is on the left also holds what is on the right):\n{lines}")
    return "\n\n".join([*parts, *plan.points.notes, _power_text(plan, file, sigma, effect)])


def _range(factor: DesignFactor) -> list[str]:
    return [number(factor.low, 6), number(factor.high, 6), factor.unit or "1"]


def _power_text(plan: RunPlan, file: FactorsFile, sigma: float | None, effect: float | None) -> str:
    if plan.design.mixture:
        return _mixture_text(plan)
    found = planned_power(plan, file, sigma, effect)
    if not found:
        return (
            "As many effects as runs: nothing is left for the error. Effects can be held against Lenth's margin alone; "
            "--replicates 2 or centre runs give an error."
        )
    unit = "the response's unit" if sigma else "units of σ, the standard deviation of one run"
    header = ["change, low → high", "terms", "standard error", "seen with chance 0.8", "for all at once"]
    rows = [
        [
            TERMS[one.kind],
            str(one.terms),
            *(number(value) for value in (one.standard_error, one.smallest, one.smallest_of_all)),
            *([number(one.power)] if effect else []),
        ]
        for one in found
    ]
    if effect:
        header.append(f"chance to see {number(effect)}{'' if sigma else ' σ'}")
    table = text_table(header, rows)
    names = f"\n{OF_NAMES}" if any(one.df_term > 1 for one in found) else ""
    return (
        f"what the {planned_order(plan, file)} model will see at p < 0.05, in {unit} "
        f"({counted(found[0].df, 'degree of freedom')} for the error):\n{table}{names}"
    )


def _mixture_text(plan: RunPlan) -> str:
    """Which of Scheffé's polynomials the runs support."""
    letters = factor_letters(plan.coded.shape[1])
    order = bearable_order((plan.coded[plan.sequence[:, 0]] + 1) / 2, letters)
    if order is None:
        return "As many blends as terms, or fewer: nothing is left for the error. --replicates 2 or --centre give one."
    terms = len(mixture_terms(letters, order))
    df = counted(len(plan.sequence) - terms, "degree of freedom")
    return f"The runs bear Scheffé's {order} polynomial ({terms} terms), with {df} for the error."


def analysis_text(result: DesignResult) -> str:
    """All tables of the report that fit a terminal, without the charts."""
    parts = [_table(factor_table(result))]
    found, effects = result.analysis, result.effects
    if effects is not None:
        parts.append(_table(effect_table(effects)))
        if found.effects is not None and found.effects.few_terms:
            parts.append(_table(few_terms_table(found.effects.few_terms)))
        if effects.curvature is not None:
            parts.append(curvature(effects.curvature, effects.response))
    if found.model is not None:
        parts += [_table(fit_summary(found)), _table(anova_table(found.model.anova))]
    if found.mixture is not None:
        parts += [_table(mixture_table(result, found.mixture)), _table(variance_table(found.mixture.rows))]
    if found.named is not None:
        parts += [_table(variance_table(found.named.rows, "")), _table(means_table(result, found.named.means))]
        parts.append(_table(groups_table(result, found.named)))
    if found.random is not None:
        parts += [_table(components_table(result, found.random)), _table(tests_table(found.random))]
        parts.append(_table(estimates_table(found.random)))
        if found.random.means:
            parts.append(_table(means_table(result, found.random.means)))
    if found.surrogate is not None:
        parts += [_table(errors_table(result, found.surrogate)), _table(lengths_table(result, found.surrogate))]
    if found.surrogate_target is not None:
        parts.append(_table(process_settings(result, found.surrogate_target)))
    if found.elementary is not None:
        parts.append(_table(elementary_table(result, found.elementary)))
    told: set[str] = set()
    for section in (in_short(result), diagnostics(result), shape(result), target(result)):
        if section is not None:
            facts = [pair for block in section.blocks if isinstance(block, Facts) for pair in block.pairs]
            # A report has the answer at the top and again under its own heading; a terminal needs it once.
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
    # The columns of a terminal do not recognise numbers with typographic minus signs.
    return text_table(table.header, [[cell.replace("−", "-").replace("–", "-") for cell in row] for row in table.rows])
