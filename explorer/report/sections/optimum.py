"""The optimum: the solution nearest the measured parameters, how sure it is, and what one target leaves open."""

from __future__ import annotations

from doe.analysis.optimum import Compromise
from doe.stages.surface import OptimumResult
from doe.studies.study_result import StudyResult
from explorer.report.content import Block, Figure, Section, Table, Text
from explorer.report.figures.model import fitted_targets
from explorer.report.figures.optimum import cloud, ranges
from explorer.report.identified import GIVES_TARGET, cloud_caution, is_identified, rule, settings
from explorer.units import (
    enumeration,
    fixed,
    observable_label,
    observed,
    parameter_range,
    parameter_value,
    percent,
    signed,
)


def optimum(result: StudyResult) -> Section:
    """Chosen setting, the 95 % sets of identified parameters and the ranges that give the target."""
    found, single, first = result.optimum, result.optimum.single, fitted_targets(result)[0]
    blocks: list[Block] = [Text(_statement(result)), _settings(found, first.reference_name)]
    if found.compromise is not None:
        blocks += _compromise(result, found.compromise)
    blocks += [
        Figure("ranges", ranges(first), "Thin inside thick: the narrower the bar, the better a factor is known."),
        Figure(
            "cloud",
            cloud(first),
            f"{len(single.bootstrap_points)} refits to resampled {single.resampling}; each dot is the solution "
            f"nearest the measured parameters. {percent(single.share_reached)} of the refits reach the target. "
            f"{cloud_caution(found)}".rstrip(),
        ),
    ]
    return Section("Optimum", tuple(blocks))


def _statement(result: StudyResult) -> str:
    single = result.optimum.single
    name = result.study.targets[0].observable
    between = f"{observed(name, single.predicted_low)} … {observed(name, single.predicted_high)}"
    if single.reached:
        text = (
            f"Of all settings at which the model gives {observed(name, single.target)}, this one is nearest the "
            f"measured parameters (distance {fixed(single.distance)} half-widths); the model's 95 % interval there "
            f"is {between}."
        )
    else:
        text = (
            f"The model does not give {observed(name, single.target)} in its region; it comes nearest with "
            f"{observed(name, single.predicted)} ({between})."
        )
    if single.unidentified:
        text += (
            f" The target does not identify {enumeration(single.unidentified)}: the answer is the range that gives "
            "the target, and the value in it is chosen by rule."
        )
    text += (
        f" In {percent(single.compatible_share)} of the region the predicted mean is compatible with the target "
        "at 95 %."
    )
    error = single.target_standard_error
    any_identified = any(is_identified(single, k) for k in range(len(single.names)))
    including = "The 95 % set and this share include" if any_identified else "This share includes"
    text += (
        f" {including} the target's own standard error, {observed(name, error)}."
        if error
        else " The target is taken as exact: the study states no standard deviation and number of measurements."
    )
    if not single.better_than_noise:
        text += " The surface is not better than noise, so this point is not a calibration."
    return text


def _settings(found: OptimumResult, reference_name: str) -> Table:
    rows = tuple(
        (
            *setting.cells,
            parameter_value(factor.path, factor.reference),
            parameter_range(factor.path, factor.low, factor.high),
        )
        for setting, factor in zip(settings(found), found.factors, strict=True)
    )
    header = (
        *("factor", "parameter", "identified", GIVES_TARGET, "of the region", "optimum", "95 % set"),
        *("measured", "screened"),
    )
    first_alone = "Intervals and ranges of the first target alone." if found.compromise is not None else ""
    return Table(header, rows, f"{rule(found, reference_name)} {first_alone}".strip())


def _compromise(result: StudyResult, compromise: Compromise) -> list[Block]:
    rows = tuple(
        (
            observable_label(target.observable),
            observed(target.observable, target.mean),
            observed(target.observable, predicted),
            signed(missed),
            fixed(target.weight),
        )
        for target, predicted, missed in zip(
            result.study.targets, compromise.predicted, compromise.standardised, strict=True
        )
    )
    header = ("target", "measured", "model at the optimum", "missed by [standard errors]", "weight")
    text = f"Several targets: the setting of least weighted misfit J = {fixed(compromise.misfit)}."
    return [Text(f"{text} {compromise.statement}"), Table(header, rows)]
