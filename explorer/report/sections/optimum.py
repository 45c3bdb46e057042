"""The optimum of a study: the chosen setting, what the targets allow for each factor, and how well that is known."""

from __future__ import annotations

import math

import numpy as np

from doe.analysis.joint_posterior import JointPosterior
from doe.analysis.optimum import Compromise
from doe.stages.surface import CONTRADICTION, OptimumResult
from doe.studies.study_result import StudyResult
from explorer.report.content import Block, Figure, Section, Struck, Table, Text
from explorer.report.figures.model import cloud, fitted_targets, ranges
from explorer.report.figures.posterior import corner, overlaid
from explorer.report.identified import (
    GIVES_TARGET,
    cloud_caution,
    rule,
    settings,
)
from explorer.report.sections.answer import ANSWER, holds
from explorer.units import (
    MISSING,
    enumeration,
    fixed,
    observable_label,
    observed,
    p_value,
    parameter_label,
    parameter_range,
    parameter_value,
    percent,
    signed,
)


def optimum(result: StudyResult) -> Section:
    """Chosen setting, the 95 % sets of identified parameters and the ranges that give the target."""
    found, single, first = result.optimum, result.optimum.single, fitted_targets(result)[0]
    blocks: list[Block] = [Text(_statement(result)), _settings(result, first.reference_name)]
    if found.compromise is not None:
        blocks += _compromise(result, found.compromise)
    if found.posterior is not None:
        blocks += _posterior(result, found.posterior)
    blocks += [
        Figure(
            "ranges", ranges(first), ranges_caption(found, f"n = {_readings(result)} readings of the design's runs")
        ),
        Figure(
            "cloud",
            cloud(first),
            f"n = {len(single.bootstrap_points)} refits to resampled {single.resampling} (bootstrap); each dot is the "
            "solution "
            f"nearest the measured parameters. {percent(single.share_reached)} of the refits reach the target. "
            f"{cloud_caution(found)}".rstrip(),
        ),
    ]
    return Section("Optimum", tuple(blocks))


def ranges_caption(found: OptimumResult, n: str) -> str:
    """What the bars of the ranges mean; ``n``: what the model was fitted to, and how many."""
    single, several = found.single, found.compromise is not None
    bars = ["wide, the region of the surface"]
    if several and found.posterior is not None:
        bars.append("narrow, the 95 % interval of the posterior by all targets")
    else:
        if single.reached:
            bars.append(f"middle, where the fitted model gives the {'first target' if several else 'target'}")
        if any(one.identified for one in found.estimates.values()):
            bars.append(f"narrow, the 95 % set over n = {len(single.bootstrap_points)} bootstrap refits")
    return f"{n}. The narrower a bar, the better a factor is known: {'; '.join(bars)}."


def _statement(result: StudyResult) -> str:
    single = result.optimum.single
    name = result.study.targets[0].observable
    between = f"{observed(name, single.predicted_low)} … {observed(name, single.predicted_high)}"
    several = result.optimum.compromise is not None
    if single.reached:
        this = f"the one nearest the measured parameters is {fixed(single.distance)} half-widths from them"
        if not several:
            this = f"this one is nearest the measured parameters (distance {fixed(single.distance)} half-widths)"
        text = (
            f"Of all settings at which the model gives {observed(name, single.target)}, {this}; the model's 95 % "
            f"interval there is {between}."
        )
    else:
        text = (
            f"The model does not give {observed(name, single.target)} in its region; it comes nearest with "
            f"{observed(name, single.predicted)} ({between})."
        )
    if several:
        text = f"By the {observable_label(name)} alone: {text[0].lower()}{text[1:]}"
    elif single.unidentified:
        text += (
            f" The target does not identify {enumeration(single.unidentified)}: the answer is the range that gives "
            "the target, and the value in it is chosen by rule."
        )
    text += (
        f" In {percent(single.compatible_share)} of the region the predicted mean is compatible with the target "
        "at 95 %."
    )
    error = single.target_standard_error
    any_identified = any(single.identifies(k) for k in range(len(single.names)))
    including = "The 95 % set and this share include" if any_identified else "This share includes"
    text += (
        f" {including} the target's own standard error, {observed(name, error)}."
        if error
        else " The target is taken as exact: the study states no standard deviation and number of measurements."
    )
    if not single.better_than_noise:
        text += " The surface is not better than noise, so this point is not a calibration."
    return text


def _settings(result: StudyResult, reference_name: str) -> Table:
    found, good = result.optimum, holds(result)
    rows = tuple(
        (
            *(cell if good or k < ANSWER or cell == MISSING else Struck(cell) for k, cell in enumerate(setting.cells)),
            parameter_value(factor.path, factor.reference),
            parameter_range(factor.path, factor.low, factor.high),
        )
        for setting, factor in zip(settings(found), found.factors, strict=True)
    )
    header = (
        *("factor", "parameter", "identified", GIVES_TARGET, "of the region", "optimum", "95 % set"),
        *("measured", "screened"),
    )
    joint = "" if found.compromise is None else JOINT if found.posterior is not None else FIRST_ALONE
    return Table(header, rows, f"{rule(found, reference_name)} {joint}".strip())


JOINT = "Ranges are 95 % intervals of what all targets say together."
FIRST_ALONE = "Intervals and ranges of the first target alone."


def _compromise(result: StudyResult, compromise: Compromise) -> list[Block]:
    targets = result.study.targets
    desirability = compromise.desirability if len(compromise.desirability) else np.full(len(targets), math.nan)
    rows = tuple(
        (
            observable_label(target.observable),
            observed(target.observable, target.mean),
            observed(target.observable, predicted),
            signed(missed),
            fixed(desirable),
            fixed(target.weight),
        )
        for target, predicted, missed, desirable in zip(
            targets, compromise.predicted, compromise.standardised, desirability, strict=True
        )
    )
    header = ("target", "measured", "model at the optimum", "missed by [standard errors]", "desirability", "weight")
    weights = np.array([target.weight for target in targets])
    whole = float(np.prod(desirability**weights) ** (1.0 / weights.sum()))
    text = f"Several targets: the setting of least weighted misfit J = {fixed(compromise.misfit)}."
    caption = f"Desirability: 1 at the target, 0 at target ± margin; of all targets {fixed(whole)} (geometric mean)."
    blocks: list[Block] = [Text(f"{text} {compromise.statement}"), Table(header, rows, caption)]
    fitted = fitted_targets(result)
    blocks.append(
        Figure(
            "overlaid",
            overlaid(fitted),
            f"Contours of all targets over each other (n = {_readings(result)} readings of the design's runs), the "
            "other factors at the optimum: full, the model gives the target; dotted, target ± margin; filled, where "
            "every target is within its margin.",
        )
    )
    return blocks


def _readings(result: StudyResult) -> int:
    """Number of readings, over all targets, to which the surfaces are fitted."""
    return sum(model.observed.size for model in result.surface.models)


def _posterior(result: StudyResult, posterior: JointPosterior) -> list[Block]:
    factors, targets = result.optimum.factors, result.study.targets
    rows = tuple(
        (
            factor.name,
            parameter_label(factor.path),
            parameter_value(factor.path, float(posterior.mean[k])),
            parameter_range(factor.path, float(posterior.low[k]), float(posterior.high[k])),
            percent(float(posterior.share[k])),
        )
        for k, factor in enumerate(factors)
    )
    predicted = ", ".join(
        f"{observable_label(target.observable)} {observed(target.observable, mean)} ± "
        f"{observed(target.observable, sd)} for {observed(target.observable, target.mean)}"
        for target, mean, sd in zip(targets, posterior.predicted, posterior.predicted_sd, strict=True)
    )
    text = (
        "Every setting of the region beforehand equally likely, normal errors of target and model: what the "
        "measurements leave of the factors. Predicted from it (mean ± standard deviation of the mean response): "
        f"{predicted}."
    )
    if posterior.p < CONTRADICTION:
        text += (
            f" No setting of the region gives {'all targets' if len(targets) > 1 else 'the target'}: the least misfit "
            f"is {fixed(posterior.misfit)} (χ², p = {p_value(posterior.p)}), so that the intervals are no answer; a "
            "measurement or the model is wrong, or the true setting lies outside the region."
        )
    header = ("factor", "parameter", "mean", "95 % interval", "of the region")
    caption = (
        "Posterior of the factors on the fitted surfaces: diagonal, each factor with its 95 % interval; below, each "
        f"pair (darker: likelier). n = {_readings(result)} readings of the design's runs."
    )
    return [Text(text), Table(header, rows), Figure("posterior", corner(posterior, factors), caption)]
