"""The screening: which of the declared factors matter, by every way of judging."""

from __future__ import annotations

from doe.analysis.screening import Adjustment, ErrorSource
from doe.run_records import sample_of
from doe.stages.screening import ScreeningResult
from doe.studies.factors import MIN_BODIES
from doe.studies.study_result import StudyResult
from explorer.report.content import Block, Bullets, Facts, Figure, Folded, Section, Table, Text
from explorer.report.figures.effects import half_normal, pareto
from explorer.units import (
    MISSING,
    enumeration,
    fixed,
    observable_label,
    observable_title,
    observed,
    p_value,
    parameter_label,
    parameter_range,
    percent,
    signed,
)

ADJUSTMENTS: tuple[Adjustment, ...] = ("none", "holm")


def screening(result: StudyResult) -> Section:
    """Pareto, half-normal plot, the verdicts, effects and rows of the design."""
    part = result.screening
    analysis = part.analysis
    blocks: list[Block] = [
        Text(
            f"{analysis.rows}-run {result.study.designs['screening']} design over {len(part.factors)} factors, "
            f"{analysis.runs} valid pours, response: {observable_label(part.response)}."
        ),
        Facts(tuple(_verdicts(part))),
    ]
    chart = pareto(part)
    if chart is None:
        blocks.append(Text("No error could be estimated, so no |t| is shown."))
    else:
        blocks.append(
            Figure("pareto", chart, "Lines: the |t| at which p = 0.05 for one factor (dashed) and for all (solid).")
        )
    caption = "Noise alone would follow a straight line through the origin; what stands above it acts."
    blocks += [Figure("half-normal", half_normal(part), caption), effect_table(part)]
    notes = (*analysis.notes, _no_pile_note(part))
    blocks.append(Bullets(notes))
    blocks += not_testable(part)
    blocks.append(Folded("All rows of the screening", (row_table(part),)))
    return Section("Screening", tuple(blocks))


def not_testable(part: ScreeningResult) -> list[Block]:
    """Which factors act on so few bodies that their effect says nothing; empty if none does."""
    if not part.not_testable:
        return []
    names = tuple(
        f"{entry.factor.replace('_', ' ')} ({parameter_label(entry.path)}): acts on {entry.bodies:.0f} bodies"
        for entry in part.not_testable
    )
    return [Text(f"Not testable, because they touch fewer than {MIN_BODIES} bodies of the mixture:"), Bullets(names)]


def effect_table(part: ScreeningResult) -> Table:
    """Effects by falling size with their tests; the last column reads the same pours in the target's observable."""
    analysis = part.analysis
    factors = {factor.name: factor for factor in part.factors}
    in_target = {effect.name: effect for effect in part.target_analysis.effects}
    untestable = {entry.factor for entry in part.not_testable}
    rows = []
    for effect in analysis.factor_effects():
        factor, deciding = factors[effect.name], analysis.deciding_test(effect)
        by_replicates, by_dummies = effect.by_replicates, effect.by_dummies
        rows.append(
            (
                effect.name.replace("_", " ") + (" †" if effect.name in untestable else ""),
                parameter_label(factor.path),
                parameter_range(factor.path, factor.low, factor.high),
                signed(effect.effect),
                f"± {fixed(analysis.half_width(effect))}",
                MISSING if by_replicates is None else p_value(by_replicates.p),
                MISSING if by_dummies is None else p_value(by_dummies.p),
                MISSING if deciding is None else p_value(deciding.p_holm),
                fixed(effect.sum_of_squares),
                fixed(effect.contribution_percent, 1),
                signed(in_target[effect.name].effect),
            )
        )
    header = (
        *("factor", "parameter", "low … high", "effect", "95 %", "p replicates", "p dummies", "p Holm"),
        *("sum of squares", "share [%]", "effect in the target"),
    )
    caption = "† not testable. " if untestable else ""
    caption += (
        f"Effects on {observable_title(part.response)}; sums of squares of row means. p Holm is corrected for all "
        "factors, against the error that decides (replicates where there are any); the last column reads the same "
        "pours in the target's own observable."
    )
    return Table(header, tuple(rows), caption)


def row_table(part: ScreeningResult) -> Table:
    """One line per row of the design: levels, pours, mean, spread and failures."""
    rows = []
    for k, (levels, runs, lost) in enumerate(zip(part.design, part.runs, part.no_pile_share, strict=True)):
        sample = sample_of(runs, part.response)
        signs = "".join("+" if level > 0 else "−" for level in levels)
        rows.append(
            (
                str(k + 1),
                f"`{signs}`",
                str(sample.n),
                observed(part.response, sample.mean),
                observed(part.response, sample.sd),
                percent(lost),
            )
        )
    columns = ", ".join(part.columns)
    return Table(("row", "levels", "valid pours", "mean", "sd", "not valid"), tuple(rows), f"Levels of {columns}.")


def _verdicts(part: ScreeningResult) -> list[tuple[str, str]]:
    analysis, response = part.analysis, part.response
    found = []
    ways: dict[ErrorSource, str] = {
        "replicates": "By replicates",
        "dummies": "By dummies, the way of most published studies",
    }
    for name, way in ways.items():
        error = analysis.error(name)
        if error is None:
            found.append((way, "not available"))
            continue
        raw, corrected = (enumeration(analysis.significant(adjust=one, error=name)) for one in ADJUSTMENTS)
        found.append((way, f"p < 0.05: {raw}; after Holm: {corrected} ({error.df} degrees of freedom)"))
        found.append(
            (
                f"Limits against the {name}",
                f"{observed(response, error.margin)} for one factor, "
                f"{observed(response, error.margin_bonferroni)} for all (Bonferroni); smallest effect seen with "
                f"chance 0.8: {observed(response, error.smallest_detectable_effect)}, for all "
                f"{observed(response, error.smallest_detectable_effect_bonferroni)}",
            )
        )
    chosen = [f"{entry.name} ({entry.reason})" for entry in part.selected]
    return [*found, ("Going on", enumeration(chosen))] if chosen else found


def _no_pile_note(part: ScreeningResult) -> str:
    lost = part.no_pile_analysis
    if lost is None:
        return "Every pour is valid, so no factor changes the share of valid pours."
    return (
        f"Share of pours that are not valid: mean {percent(lost.mean, 1)} per row; factors that change it (against "
        f"the dummies, after Holm): {enumeration(lost.significant(error='dummies'))}."
    )
