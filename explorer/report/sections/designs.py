"""The runs before the optimum: the pilot's noise, the screening, and what the source does not state."""

from __future__ import annotations

import math
from collections.abc import Sequence

from doe.analysis.pilot import BIAS_LIMIT_DEG, EstimatorChoice, Separation
from doe.analysis.screening import Adjustment, ErrorSource
from doe.run_records import sample_of, valid_values
from doe.stages.pilot import PilotResult, StageSize
from doe.stages.screening import ScreeningResult
from doe.studies.factors import MIN_BODIES
from doe.studies.study_result import StudyResult
from explorer.report.content import Block, Bullets, Facts, Figure, Folded, Section, Table, Text
from explorer.report.figures.effects import half_normal, pareto
from explorer.report.figures.pours import noise_of_estimators
from explorer.report.figures.pours import scan as scan_chart
from explorer.units import (
    MISSING,
    code,
    counted,
    enumeration,
    fixed,
    number,
    observable_label,
    observable_title,
    observed,
    observed_number,
    p_value,
    parameter_label,
    parameter_range,
    parameter_value,
    percent,
    signed,
    unit_of_observable,
    with_sign,
)


def noise(result: StudyResult) -> Section:
    """σ, d′ and bias of every estimator, the choice, and what replicates resolve."""
    pilot = result.pilot
    target = result.study.targets[0].observable
    text = f"The screening reads {observable_label(pilot.estimator)}."
    if pilot.choice is not None:
        text = f"{text} {_choice(pilot.choice)}"
    compared = enumeration([observable_label(one.observable) for one in result.study.targets])
    text += f" Ascent, surface and verification are always compared with what was measured: {compared}."
    blocks: list[Block] = [
        Text(text),
        Figure(
            "noise",
            noise_of_estimators(pilot),
            f"n = {pilot.noise[target].runs} seeds at the reference setting; whiskers: 95 % intervals (χ² of σ, "
            "bootstrap "
            "of d′); bias: the range over the ways to fill a synthetic cone with bodies. Red: read by the screening.",
        ),
        _estimators(pilot),
        Table(
            ("runs per mean", "difference of two means", "main effect", "main effect, all factors at once"),
            tuple(
                (
                    str(row.replicates),
                    observed(target, row.difference),
                    observed(target, row.main_effect),
                    observed(target, row.main_effect_bonferroni),
                )
                for row in pilot.resolutions
            ),
            f"What replicates resolve in {observable_label(target)}, chance 0.8 at level 0.05; main effects in the "
            f"{result.screening.analysis.rows}-run design.",
        ),
    ]
    spread = pilot.equal_variance
    if spread is not None and math.isfinite(spread.p):
        sigmas = ", ".join(f"{name}: {observed(target, sigma)}" for name, sigma in spread.sigmas)
        blocks.append(
            Text(
                f"Spread of {observable_label(target)} by setting – {sigmas}. Equal spread, Brown–Forsythe: "
                f"p = {p_value(spread.p)}."
            )
        )
    if pilot.sizes:
        blocks.append(_sizes(pilot.sizes))
    if pilot.notes:
        blocks.append(Bullets(pilot.notes))
    return Section("Noise of one pour", tuple(blocks))


def reach(result: StudyResult) -> Section | None:
    """The two corners of the factors of known direction; None if they were not poured."""
    found = result.reach
    if found is None:
        return None
    rows = tuple(
        (setting.label, str(one.n), observed(found.observable, one.mean), observed(found.observable, error))
        for setting, one, error in zip(found.settings, found.corners, found.standard_errors, strict=True)
    )
    caption = (
        f"Friction and rolling friction up, restitution down, of {enumeration(found.factors)}; the others at their "
        "reference. Out of reach is a target ± 2 standard errors that lies beyond the nearer mean by more than the "
        "whole range between the two, and by more than 3 standard errors."
    )
    table = Table(("corner", "valid pours", observable_label(found.observable), "standard error"), rows, caption)
    return Section("Reach", (Text(f"{found.line[0].upper()}{found.line[1:]}."), table))


def _estimators(pilot: PilotResult) -> Table:
    choice, bias = pilot.choice, pilot.estimator_bias
    changes = [] if choice is None else list(dict.fromkeys(s.change for s in choice.separations))
    seen = {} if choice is None else {(s.estimator, s.change): s for s in choice.separations}
    rows = []
    for name, spread in pilot.noise.items():
        separations = [seen.get((name, change)) for change in changes]
        rows.append(
            (
                observable_label(name),
                observed(name, spread.mean),
                f"{observed(name, spread.sigma)} ({observed(name, spread.low)} … {observed(name, spread.high)})",
                *(_separation(found) for found in separations),
                _bias_range(name, bias[name]) if name in bias else MISSING,
            )
        )
    header = ("estimator", "mean", "σ (95 %)", *(f"d′ {change} (95 %)" for change in changes), "bias on made-up piles")
    caption = (
        f"{next(iter(pilot.noise.values())).runs} seeds at the reference setting. Bias: its range over what it "
        "may mean that bodies fill a cone (centre, half or all of a body inside); an estimator is left out only if it "
        f"misses by more than {BIAS_LIMIT_DEG:g}° under every reading."
    )
    return Table(header, tuple(rows), caption)


def _separation(found: Separation | None) -> str:
    """Signed d′ with its interval; an observable of a kind other than the target's was not compared."""
    if found is None:
        return MISSING
    return f"{signed(found.d_prime)} ({signed(found.low)} … {signed(found.high)})"


def _bias_range(name: str, readings: Sequence[tuple[float, float]]) -> str:
    """ "−0.2° … +20.9°" from the (mean, standard error) of each reading."""
    unit = unit_of_observable(name)
    means = [unit.of(mean) for mean, _ in readings if math.isfinite(mean)]
    return unit.attach(f"{signed(min(means), 1)} … {signed(max(means), 1)}") if means else MISSING


def _choice(choice: EstimatorChoice) -> str:
    """Why the screening uses its estimator."""
    own, best = observable_label(choice.default), observable_label(choice.best)
    if choice.default in choice.excluded:
        text = f"The target's own, {own}, is left out for its bias; of the others this one has the largest mean d′."
    elif choice.best == choice.default:
        text = "It is the target's own, and its mean d′ (shift under a declared change ÷ σ) is the largest."
    else:
        share = percent(choice.share_better)
        kept = choice.chosen == choice.default
        text = (
            f"The mean d′ (shift under a declared change ÷ σ) of {best} exceeds that of {own}, the target's own, in "
            f"{share} of the resampled pilots; 95 % are asked for"
        ) + (", so the target's own is kept." if kept else ".")
    if choice.excluded:
        text += f" Left out for their bias on made-up piles: {', '.join(map(observable_label, choice.excluded))}."
    return text


def _sizes(sizes: Sequence[StageSize]) -> Table:
    rows = tuple((s.stage, str(s.needed), str(s.taken), f"{fixed(s.wanted)}°", f"{fixed(s.resolved)}°") for s in sizes)
    header = ("stage", "pours per row needed", "taken", "wanted", "resolved")
    caption = "Sizes from the pilot's noise, chance 0.8 at level 0.05; two-level designs for all factors at once."
    return Table(header, rows, caption)


ADJUSTMENTS: tuple[Adjustment, ...] = ("none", "holm")


def screening(result: StudyResult) -> Section:
    """Pareto, half-normal plot, the verdicts, effects and rows of the design."""
    part = result.screening
    analysis = part.analysis
    blocks: list[Block] = [
        Text(
            f"{analysis.rows}-run {result.study.designs['screening']} design over "
            f"{counted(len(part.factors), 'factor')}, {analysis.runs} valid pours, response: "
            f"{observable_label(part.response)}."
        ),
        Facts(tuple(_verdicts(part))),
    ]
    n = f"n = {analysis.runs} valid pours in {analysis.rows} rows"
    chart = pareto(part)
    if chart is None:
        blocks.append(Text("No error could be estimated, so no |t| is shown."))
    else:
        blocks.append(
            Figure(
                "pareto",
                chart,
                f"{n}. Lines: the |t| at which p = 0.05 for one factor (dashed) and for all (solid, Bonferroni).",
            )
        )
    caption = (
        f"{n}. Noise alone would follow a straight line through the origin; what stands above it acts. Lines: Lenth’s "
        "margins, 95 %."
    )
    blocks += [Figure("half-normal", half_normal(part), caption), effect_table(part)]
    blocks += [further_effects(part)] if part.further_analyses else []
    notes = (*analysis.notes, _no_pile_note(part))
    blocks.append(Bullets(notes))
    blocks += not_testable(part)
    blocks.append(Folded("All rows of the screening", (row_table(part),)))
    return Section("Screening", tuple(blocks))


def not_testable(part: ScreeningResult) -> list[Block]:
    """Factors that act on so few bodies that their effect says nothing; empty if there are none."""
    if not part.not_testable:
        return []
    names = tuple(
        f"{entry.factor.replace('_', ' ')} ({parameter_label(entry.path)}): acts on {entry.bodies:.0f} "
        f"{'body' if round(entry.bodies) == 1 else 'bodies'}"
        for entry in part.not_testable
    )
    return [Text(f"Not testable, because they touch fewer than {MIN_BODIES} bodies of the mixture:"), Bullets(names)]


def effect_table(part: ScreeningResult) -> Table:
    """Effects by decreasing size with their tests; the last column is for the target's observable of the same pours."""
    analysis = part.analysis
    size = unit_of_observable(part.response).size
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
                with_sign(observed_number(part.response, effect.effect)),
                f"± {observed_number(part.response, analysis.half_width(effect))}",
                MISSING if by_replicates is None else p_value(by_replicates.p),
                MISSING if by_dummies is None else p_value(by_dummies.p),
                MISSING if deciding is None else p_value(deciding.p_holm),
                number(effect.sum_of_squares / size**2, 4),
                fixed(effect.contribution_percent, 1),
                with_sign(observed_number(part.response, in_target[effect.name].effect)),
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


def further_effects(part: ScreeningResult) -> Table:
    """Effects on the targets beside the first, with their corrected p."""
    rows = []
    for name, analysis in part.further_analyses.items():
        for effect in analysis.factor_effects():
            test = analysis.deciding_test(effect)
            half = f"± {observed_number(name, analysis.half_width(effect))}"
            p = MISSING if test is None else p_value(test.p_holm)
            size = with_sign(observed_number(name, effect.effect))
            rows.append((observable_title(name), effect.name.replace("_", " "), size, half, p))
    caption = "Effects on the other targets; of a factor the largest |t| over all targets counts for going on."
    return Table(("target", "factor", "effect", "95 %", "p Holm"), tuple(rows), caption)


def row_table(part: ScreeningResult) -> Table:
    """One line per row of the design: levels, pours, mean, spread and failures."""
    rows = []
    for k, (levels, runs, lost) in enumerate(zip(part.design, part.runs, part.no_pile_share, strict=True)):
        sample = sample_of(runs, part.response)
        signs = "".join("+" if level > 0 else "−" if level < 0 else "0" for level in levels)
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
        found.append((way, f"p < 0.05: {raw}; after Holm: {corrected} ({counted(error.df, 'degree of freedom')})"))
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


def assumptions(result: StudyResult) -> Section | None:
    """Effects of the assumptions and what is assumed; None if nothing is."""
    part, assumed = result.assumptions, result.study.assumed
    blocks: list[Block] = []
    if part is not None:
        declared = tuple(
            f"{parameter_label(factor.path)}: {parameter_value(factor.path, factor.reference)} assumed, "
            f"screened over {parameter_range(factor.path, factor.low, factor.high)}"
            for factor in part.factors
        )
        blocks += [
            Text(
                f"{part.analysis.rows}-run design beside the screening, {part.analysis.runs} valid pours, "
                f"response: {observable_label(part.response)}."
            ),
            Bullets(declared),
            effect_table(part),
        ]
        if part.analysis.notes:
            blocks.append(Bullets(part.analysis.notes))
        blocks += not_testable(part)
        blocks.append(Folded("All rows of the design", (row_table(part),)))
    if assumed:
        blocks += [
            Text("Values of the material that nobody measured:"),
            Bullets(tuple(map(code, assumed))),
        ]
    return Section("What the source does not state", tuple(blocks)) if blocks else None


def scan(result: StudyResult) -> Section | None:
    """The response over one assumption in steps; None if the study declares no scan."""
    scanned = result.scan
    if scanned is None:
        return None
    observable, path = scanned.observable, scanned.path
    rows = []
    for value, mean, noise, lost in zip(
        scanned.values, scanned.means, scanned.noise, scanned.no_pile_share, strict=True
    ):
        rows.append(
            (
                parameter_value(path, value),
                observed(observable, mean),
                MISSING if noise is None else f"± {observed(observable, noise.half_width)}",
                MISSING if noise is None else observed(observable, noise.sigma),
                percent(lost),
            )
        )
    text = (
        f"Everything else at the reference setting; {observable_label(observable)}, valid pours only. Two values "
        f"have to differ by {observed(observable, scanned.smallest_difference)} to be told apart with chance 0.8."
    )
    if all(noise is None for noise in scanned.noise):
        text += " One pour per value: no interval can be drawn."
    n = sum(len(valid_values(runs, observable)) for runs in scanned.runs)
    caption = (
        f"n = {n} valid pours, one faint point each; means with 95 % intervals (t); band: the target and its margin of "
        "equivalence."
    )
    table = Table((parameter_label(path), "mean", "95 %", "sd of one pour", "not valid"), tuple(rows))
    return Section(
        f"Over the {parameter_label(path)}",
        (Text(text), Figure("scan", scan_chart(scanned, result.study.targets[0]), caption), table),
    )
