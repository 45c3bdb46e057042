"""Evidence for the answer: errors and piles by fresh pours, residuals, what every effect could do, and parameters."""

from __future__ import annotations

import math

import numpy as np

from doe.declared.model import effect_of
from doe.diagnose.result import BASE, EffectRow
from doe.holdout import OVERALL
from doe.measurement.bodies import QUANTITIES
from doe.measurement.measurement import Role
from doe.measurement.residual_map import ResidualMap
from explorer.diagnosis.result import DiagnosisResult, ErrorRow, PileProfiles
from explorer.report.content import Block, Caution, Figure, Folded, Section, Table, Text
from explorer.report.diagnosis.charts import bands, drawn_residuals, error_chart, map_chart, pile_chart, residual_chart
from explorer.report.diagnosis.wording import (
    amplitudes_of,
    chance,
    feature_label,
    feature_value,
    final_model,
    literature_bound,
    model_words,
    reference_text,
    simulated_range,
    spelled,
)
from explorer.units import (
    MISSING,
    code,
    counted,
    fixed,
    p_value,
    parameter_label,
    parameter_range,
    parameter_value,
    percent,
    quantity,
    signed,
)
from solver.effects import EFFECTS

FAR_OFF = 2.0
"""Deviation, in standard deviations of its measurement, from which a calibrated parameter is reported as off."""
ERROR_HEADER = (
    "observable",
    "before",
    "after",
    "noise floor",
    "after / floor",
    "skill",
    "95 % interval",
    "inside 90 %, before",
    "after",
)
ERROR_CAPTION = (
    "Before and after: root mean square over the conditions of (mean of fresh pours − measured mean), of the "
    "calibrated declared model and of the final one. Noise floor: what a perfect model would show, from the "
    "standard errors of both means. Skill: 1 − (after² − floor²)/(before² − floor²); 1 is perfect (noise may take it "
    "above), 0 no gain, – where the declared model is within the noise already. Inside 90 %: share of measured pours "
    "in the model's 90 % predictive interval."
)
ALONE = (
    " A condition with a single value, of one pour or the mean of several, does not tell its scatter: its error is the "
    "stated uncertainty and the scatter of fresh pours, and its standard deviation of a pour is of both."
)


def pours_of(result: DiagnosisResult, condition: str) -> str:
    """How many pours a condition has: "n = 5 measured pours and 20 fresh ones of each model"."""
    measured = next(row.replicates for row in result.measured if row.condition == condition)
    fresh = [row.pours for row in result.confirmation.after.conditions if row.condition == condition]
    return f"n = {counted(measured, 'measured pour')}" + (f" and {fresh[0]} fresh ones of each model" if fresh else "")


def error(result: DiagnosisResult) -> Section:
    """Tables for held-out and fitted conditions; the held-out ones come first and unfolded."""
    blocks: list[Block] = []
    if result.added:
        blocks.append(Text(f"After: {final_model(result)}."))
    else:
        blocks.append(
            Text("No effect was added, so before and after are the same model, and there is no skill to state.")
        )
    if result.error.holdout:
        held_out = sum(row.replicates for row in result.measured if row.role == "holdout")
        blocks += [
            Text("On held-out conditions, which no model was fitted to:"),
            _error_table(result, "holdout", ERROR_CAPTION),
            Figure(
                "error",
                error_chart(result, "holdout"),
                "Root-mean-square errors of fresh pours over the noise floor, n = "
                f"{counted(held_out, 'measured pour')} that no model was fitted to; a perfect model lies about 1.",
            ),
            Folded("On fitted conditions", (_error_table(result, "fit", ""),)),
        ]
    else:
        blocks.append(Caution("No condition is held out. The table below is on the data that were fitted."))
        blocks.append(_error_table(result, "fit", ERROR_CAPTION))
    return Section("Error before and after", tuple(blocks))


def _error_table(result: DiagnosisResult, role: Role, caption: str) -> Table:
    if any(row.alone for row in result.measured if row.role == role):
        caption += ALONE
    return Table(ERROR_HEADER, tuple(_error_row(result, row) for row in result.error.of(role)), caption)


def _error_row(result: DiagnosisResult, row: ErrorRow) -> tuple[str, ...]:
    name = row.observable
    known = result.added and math.isfinite(row.skill_low)
    interval = f"{fixed(row.skill_low)} … {fixed(row.skill_high)}" if known else MISSING
    return (
        feature_label(name) + (" (in SD of a pour)" if name == OVERALL else ""),
        *(feature_value(result, name, one) for one in (row.before, row.after, row.noise_floor)),
        fixed(row.ratio),
        fixed(row.skill) if result.added else MISSING,
        interval,
        percent(row.coverage_before),
        percent(row.coverage_after),
    )


def pile(result: DiagnosisResult) -> Section | None:
    """A picture per condition with profiles, held-out ones first; None if none has."""
    pictures = sorted(result.piles, key=lambda row: row.role != "holdout")
    if not pictures:
        return None
    text = (
        "Mean height over the distance from the pile's own middle, mirrored; a band is one standard deviation between "
        "pours. Heights are drawn larger than distances."
    )
    if not result.added:
        text += " Before and after are the same model here."
    blocks: list[Block] = [Text(text)]
    for k, picture in enumerate(pictures, start=1):
        blocks.append(
            Figure(
                f"pile-{k}",
                pile_chart(picture),
                f"Condition {picture.condition}, {_role(picture)}, {pours_of(result, picture.condition)}; bands: ± 1 "
                "SD between pours.",
            )
        )
    return Section("The pile", tuple(blocks))


def over_the_plate(result: DiagnosisResult) -> Section | None:
    """Where in the scanned piles the residual is; None without scans."""
    if not result.maps:
        return None
    text = (
        "Mean measured height minus that of fresh pours, in pixels as wide as a body is thick; lines are the measured "
        "height. σ is the standard error of the difference by the scatter of measured and poured piles. A right model "
        "leaves about 1 σ everywhere."
    )
    if not result.added:
        text += " Before and after are the same model here."
    header = ("condition", "root mean square before", "after", "farthest off before, at x, y", "there before", "after")
    rows = tuple(_map_row(picture) for picture in result.maps)
    figures = [
        Figure(
            f"map-{k}",
            map_chart(picture),
            f"Condition {picture.condition}, {_role(picture)}, {pours_of(result, picture.condition)}: difference of "
            "the mean heights; lines: measured height.",
        )
        for k, picture in enumerate(result.maps, start=1)
    ]
    caption = "Root mean squares where the measured pile is half a body high at least."
    return Section("Where in the pile it sits", (Text(text), *figures, Table(header, rows, caption)))


def _map_row(picture: ResidualMap) -> tuple[str, ...]:
    """Root mean squares where the pile is at least half a body high: the plate around it says nothing."""
    before, after = picture.before.z, picture.after.z
    covered = picture.measured >= 0.5 * picture.pixel
    place = np.unravel_index(np.abs(before).argmax(), before.shape)
    x, y = (1e3 * picture.pixel * (k + 0.5 - len(before) / 2) for k in place)
    means = (f"{fixed(float(np.sqrt((z[covered] ** 2).mean())) if covered.any() else 0.0)} σ" for z in (before, after))
    there = (f"{signed(float(z[place]))} σ" for z in (before, after))
    return (picture.condition, *means, f"{x:.0f}, {y:.0f} mm", *there)


def _role(picture: PileProfiles | ResidualMap) -> str:
    return "held out" if picture.role == "holdout" else "fitted"


def residuals(result: DiagnosisResult) -> Section:
    """Where the residual is, the bar chart with its bands, and the numbers behind it."""
    features, drawn = len(result.residuals), len(drawn_residuals(result))
    one, every = bands(features)
    text = (
        "Measured mean minus model in units of σ, which holds the noise of the measured mean, the errors of the model "
        f"and of instruments, and what calibration leaves open. A right model leaves one feature within ± {fixed(one)} "
        f"in 95 % of cases, and all {features} within ± {fixed(every)}. Features are correlated: the probabilities "
        "count that, single bars do not."
    )
    few = f" The {drawn} of {features} features that are farthest off." if drawn < features else ""
    figure = Figure(
        "residuals",
        residual_chart(result),
        f"n = {len(result.residuals)} features; residuals in σ of the measured mean. Dashed: 95 % for one feature; "
        "solid: for all "
        f"of them (Bonferroni).{few}",
    )
    return Section(
        "Which numbers it rests on",
        (
            Text(f"{text} After: {final_model(result)}."),
            _places(result),
            figure,
            Folded("The numbers", (_residual_table(result),)),
        ),
    )


def _places(result: DiagnosisResult) -> Table:
    rows = tuple(
        (row.condition, percent(row.share), feature_label(row.feature), f"{signed(row.z)} σ") for row in result.where
    )
    header = ("condition", "share of the squared residual", "feature farthest off", "measured − model")
    return Table(header, rows, "Of the calibrated declared model.")


def _residual_table(result: DiagnosisResult) -> Table:
    rows = []
    for row in result.residuals:
        name = row.feature
        values = (feature_value(result, name, one, 4) for one in (row.measured, row.before, row.after))
        rows.append((row.condition, feature_label(name), *values, signed(row.z_before), signed(row.z_after)))
    header = ("condition", "feature", "measured", "before", "after", "residual before [σ]", "after [σ]")
    return Table(header, tuple(rows), "Models by the regression at their best fits.")


def effects(result: DiagnosisResult) -> Section:
    """What the data say about every effect, and beside it the range, literature and lever of each."""
    text = (
        "Log evidence: natural logarithm of the evidence for the effect, over all its amplitudes, signs and "
        "directions, less that of the declared model. p: chance of data as far off as these if the best fit were true. "
        "Strength: shift in the features that are compared, in standard errors of these data, less what recalibration "
        "can undo; of the reference amplitude, at which the effect was poured, and of the best fit. Cosine: likeness "
        "of the best fit's shift to the residual of the declared model; 1 is the same pattern."
    )
    header = (
        "effect",
        "probability",
        "log evidence",
        "amplitude",
        "p",
        "strength of the fit",
        "cosine",
        "reference amplitude",
        "its strength",
        "pours",
    )
    rows = tuple(_effect(row) for row in result.effects)
    table = Table(header, rows, "The most probable first; amplitudes are posterior means.")
    return Section("Effects", (Text(text), table, _bounds(result)))


def _effect(row: EffectRow) -> tuple[str, ...]:
    alone = bool(row.reference)
    return (
        spelled(row.name),
        chance(row.probability),
        signed(row.log_evidence, 1),
        amplitudes_of(row.amplitudes),
        p_value(row.p),
        f"{fixed(row.fitted_strength, 1)} σ",
        signed(row.cosine),
        reference_text(row),
        f"{fixed(row.strength, 1)} σ" if alone else MISSING,
        str(row.pours) if alone else MISSING,
    )


def _bounds(result: DiagnosisResult) -> Table:
    rows = tuple(
        (
            code(name),
            simulated_range(result, name),
            literature_bound(name),
            EFFECTS[name].literature,
            EFFECTS[name].lever,
        )
        for name in (row.name for row in result.ranges)
    )
    header = ("effect", "range", "strongest supported", "by", "what reveals it")
    return Table(header, rows, "The range is that in which every condition can be set up.")


def single_bodies(result: DiagnosisResult) -> Section | None:
    """What was measured on single bodies, beside both models; None if nothing was."""
    if not result.bodies:
        return None
    rows = tuple(
        (
            row.body,
            QUANTITIES[row.quantity].words,
            f"{quantity(row.mean, row.unit)} ± {quantity(row.standard_error, row.unit)}",
            quantity(row.declared, row.unit),
            signed((row.mean - row.declared) / row.standard_error, 1),
            quantity(row.final, row.unit),
            signed((row.mean - row.final) / row.standard_error, 1),
        )
        for row in result.bodies
    )
    header = ("component", "number", "measured", "declared", "off, SE", "final model", "off, SE")
    text = (
        "Measured one by one, without a pour; this enters the probabilities. What a plate tells (apparent friction, "
        f"restitution) is simulated for the models. Final model: {final_model(result)}."
    )
    return Section("Single bodies", (Text(text), Table(header, rows, "± and SE: standard error of the mean.")))


def parameters(result: DiagnosisResult) -> Section:
    """Calibrated parameters before and after, beside their measurement; a sentence for each that is far off."""
    rows = []
    for row in result.parameters:
        name = row.name
        measured = MISSING
        if row.mean is not None and row.sd is not None:
            measured = f"{parameter_value(name, row.mean)} ± {parameter_value(name, row.sd)}"
        fits = (
            f"{parameter_value(name, value)} ± {parameter_value(name, sd)}"
            for value, sd in ((row.before, row.before_sd), (row.after, row.after_sd))
        )
        rows.append((parameter_label(name), measured, parameter_range(name, row.low, row.high), *fits))
    header = ("parameter", "measured", "range", "before", "after")
    text = (
        "Every model is compared with the data at all values that the measurement of a parameter allows, weighted by "
        f"it; these are the values that fit best. After: {final_model(result)}."
    )
    table = Table(
        header, tuple(rows), "± is one standard deviation. Without a measured mean, all of the range is alike."
    )
    blocks: list[Block] = [Text(text), table]
    blocks += [Caution(line) for line in strained(result)]
    return Section("Parameters", tuple(blocks))


def strained(result: DiagnosisResult) -> list[str]:
    """A sentence for every parameter that the fit drives to an end of its range or far from its measured mean."""
    found = []
    for row in result.parameters:
        given = effect_of(row.name) in result.given
        models = ((BASE, row.before), (result.final, row.after))
        for model, value in models if result.added else models[:1]:
            where = ""
            if value in (row.low, row.high):
                where = f"at the {'lower' if value == row.low else 'upper'} end of its range"
            elif row.mean is not None and row.sd is not None and abs(value - row.mean) > FAR_OFF * row.sd:
                where = f"{fixed(abs(value - row.mean) / row.sd, 1)} standard deviations from its measurement"
            if where:
                # A given effect was not measured: its range is about an earlier answer.
                so = (
                    "Its range is about an earlier answer; there may be less of it, or more, than that."
                    if given
                    else "If the measurement is right, that is evidence against this model."
                )
                found.append(
                    f"To fit, {model_words(model)} needs {parameter_label(row.name)} ({code(row.name)}) {where}, "
                    f"{parameter_value(row.name, value)}. {so}"
                )
    return found
