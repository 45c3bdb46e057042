"""The effects of a two-level design: charts, tests, aliases, and the centre runs against the corners."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from doe.analysis.contrasts import Curvature
from doe.analysis.screening import FactorEffect
from explorer.design.result import DesignResult, DrawnEffects
from explorer.report.content import Block, Bullets, Facts, Figure, Section, Table, Text
from explorer.report.figures.effects import half_normal, main_effects, pareto
from explorer.units import MISSING, fixed, number, observed, p_value, signed

MOST_DRAWN = 40
"""Contrasts in a chart; the table has all."""


def effects(result: DesignResult) -> Section | None:
    """Effects and their tests; None for a design that is not of two levels."""
    part = result.effects
    if part is None:
        return None
    drawn = _only(part, largest(part.analysis.effects))
    blocks: list[Block] = [
        Text(
            "An effect is the mean at the high level less the mean at the low one. Of an interaction it is half the "
            "difference of the effects of one factor at both levels of the other."
        ),
        Facts(tuple(_errors(part))),
    ]
    bars = pareto(drawn)
    if bars is not None:
        lines = "Lines: the |t| at which p = 0.05 for one effect (dashed) and for all (solid)."
        blocks.append(Figure("pareto", bars, lines))
    caption = "Noise alone would follow a straight line through the origin; what stands above it acts."
    blocks.append(Figure("half-normal", half_normal(drawn), caption))
    chart = main_effects(_only(part, _of_factors(part)))
    if chart is not None:
        blocks.append(Figure("main-effects", chart, "The largest ones; whiskers: 95 %; dotted: mean."))
    blocks.append(effect_table(part))
    if part.curvature is not None:
        blocks.append(Text(curvature(part.curvature, part.response)))
    if part.analysis.notes:
        blocks.append(Bullets(part.analysis.notes))
    return Section("Effects", tuple(blocks))


def largest(effects: Sequence[FactorEffect]) -> tuple[FactorEffect, ...]:
    """The effects that a chart has room for, in their order."""
    kept = {effect.name for effect in sorted(effects, key=_rank)[:MOST_DRAWN]}
    return tuple(effect for effect in effects if effect.name in kept)


def effect_table(part: DrawnEffects) -> Table:
    """All contrasts by falling size."""
    rows = []
    for effect in sorted(part.analysis.effects, key=_rank):
        name, deciding = effect.name, part.analysis.deciding_test(effect)
        by_replicates, by_columns = effect.by_replicates, effect.by_dummies
        rows.append(
            (
                name.replace("*", " × ") + (" (error)" if effect.is_dummy else ""),
                ", ".join(part.aliases.get(name, ())).replace("*", " × ").replace("-", "−") or MISSING,
                signed(effect.effect, 4),
                number(effect.sum_of_squares, 5),
                fixed(effect.contribution_percent, 2),
                MISSING if by_replicates is None else p_value(by_replicates.p),
                MISSING if by_columns is None else p_value(by_columns.p),
                MISSING if deciding is None else p_value(deciding.p_holm),
            )
        )
    header = (
        *("effect", "also holds", "size", "sum of squares", "share [%]"),
        *("p replicates", "p columns", "p Holm"),
    )
    caption = "Sums of squares of row means; p columns: against the columns marked as error."
    return Table(header, tuple(rows), caption)


def curvature(found: Curvature, response: str) -> str:
    """The test of the centre runs, in a sentence."""
    return (
        f"Curvature: the corners lie {observed(response, found.difference)} from the centre runs "
        f"(F = {number(found.f, 4)} on 1 and {found.df_error} degrees of freedom, p = {p_value(found.p)})."
    )


def _rank(effect: FactorEffect) -> float:
    return -abs(effect.effect) if math.isfinite(effect.effect) else 0.0


def _of_factors(part: DrawnEffects) -> tuple[FactorEffect, ...]:
    names = {factor.name for factor in part.factors}
    return tuple(effect for effect in part.analysis.effects if effect.name in names)


def _only(part: DrawnEffects, effects: tuple[FactorEffect, ...]) -> DrawnEffects:
    return replace(part, analysis=replace(part.analysis, effects=effects))


def _errors(part: DrawnEffects) -> list[tuple[str, str]]:
    analysis, response = part.analysis, part.response
    lenth = analysis.lenth
    found = [
        (
            "Lenth",
            f"pseudo standard error {number(lenth.pseudo_standard_error, 4)}, margin {number(lenth.margin, 4)}, "
            f"for all effects at once {number(lenth.simultaneous_margin, 4)}",
        )
    ]
    for error, title in (
        (analysis.pure_error, "Error by replicates"),
        (analysis.dummy_error, "Error by columns without a factor"),
    ):
        if error is not None:
            found.append(
                (
                    title,
                    f"σ = {observed(response, error.sigma)}, {error.df} degrees of freedom; margin of one effect "
                    f"{observed(response, error.margin)}, of all {observed(response, error.margin_bonferroni)}; "
                    f"seen with chance 0.8: {observed(response, error.smallest_detectable_effect)}",
                )
            )
    return found
