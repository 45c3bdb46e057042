"""The Gaussian process beside the polynomial: which of them predicts unseen runs better, and its settings."""

from __future__ import annotations

import math

import numpy as np

from doe.analysis.gaussian_process import LENGTHS, GaussianProcess, ProcessTarget
from explorer.design.result import DesignResult
from explorer.report.content import Block, Facts, Figure, Section, Spec, Table, Text
from explorer.report.figures.style import FACTOR, TARGET, axis, chart, error_bars, finite, line, points
from explorer.units import (
    MISSING,
    enumeration,
    fixed,
    number,
    observable_title,
    observed,
    parameter_label,
    parameter_range,
    parameter_value,
    percent,
)


def surrogate(result: DesignResult) -> Section | None:
    """The Gaussian process; None if none was requested."""
    found, answer = result.analysis.surrogate, result.analysis.surrogate_target
    if found is None:
        return None
    blocks: list[Block] = [
        Text(
            "A Gaussian process goes through the runs as smoothly as they ask for, without terms. Both are judged by "
            "what they miss a run by that they have not seen; of replicates only whole rows left out tell that. The "
            "terms of the polynomial, and the lengths and noise of the process, are those of all runs."
        ),
        Facts((("Predicts better", better_words(result)),)),
        errors_table(result, found),
        lengths_table(result, found),
        Figure(
            "left-out",
            left_out_chart(result, found),
            f"n = {len(found.observed)} runs, each predicted by the process without it; bars: 95 % of one run.",
        ),
    ]
    if answer is not None:
        blocks += [Facts(tuple(target_facts(result, answer))), process_settings(result, answer)]
    return Section("Gaussian process", tuple(blocks))


def better_words(result: DesignResult) -> str:
    """Which of the two has the smaller errors for rows left out."""
    found, model = result.analysis.surrogate, result.analysis.model
    assert found is not None
    process = found.r_squared_predicted_by_row
    polynomial = math.nan if model is None else model.anova.r_squared_predicted_by_row
    told = f"R² of rows left out {fixed(process, 4)} by the process, {fixed(polynomial, 4)} by the polynomial"
    if math.isnan(polynomial):
        return f"the process; {told}"
    if max(process, polynomial) <= 0:
        return f"neither, the mean of the runs does as well; {told}"
    return f"{'the Gaussian process' if process > polynomial else 'the polynomial'}; {told}"


def errors_table(result: DesignResult, found: GaussianProcess) -> Table:
    """PRESS of both models, by run and by row."""
    model, n = result.analysis.model, len(found.observed)
    response = result.response.path
    rows = []
    if model is not None:
        anova = model.anova
        spread = observed(response, math.sqrt(anova.press / n)) if math.isfinite(anova.press) else MISSING
        press = number(anova.press, 4) if math.isfinite(anova.press) else MISSING
        predicted = (anova.r_squared_predicted, anova.r_squared_predicted_by_row)
        rows.append(("polynomial", press, spread, *(fixed(value, 4) for value in predicted)))
    predicted = (found.r_squared_predicted, found.r_squared_predicted_by_row)
    spread = observed(response, math.sqrt(found.press / n))
    rows.append(("Gaussian process", number(found.press, 4), spread, *(fixed(value, 4) for value in predicted)))
    header = ("model", "PRESS", "typical error of a run left out", "R² predicted", "by whole rows")
    return Table(header, tuple(rows), "Left out one after the other.")


def lengths_table(result: DesignResult, found: GaussianProcess) -> Table:
    """The distance over which each factor changes the response."""
    ends = (LENGTHS[1] * 0.99, LENGTHS[0] * 1.01)
    rows = []
    for factor, length, half in zip(
        result.factors, found.lengths.tolist(), found.region.half_width.tolist(), strict=True
    ):
        words = "does nothing" if length > ends[0] else number(length)
        rows.append((factor.name, parameter_label(factor.path), words, parameter_value(factor.path, length * half)))
    signal, noise = (observed(result.response.path, value) for value in (found.signal, found.noise))
    caption = (
        "Lengths in half-widths and in the unit of the factor: short ones bend the response most. "
        f"Signal {signal}, noise of one run {noise}."
    )
    return Table(("letter", "factor", "length", "in its unit"), tuple(rows), caption)


def target_facts(result: DesignResult, answer: ProcessTarget) -> list[tuple[str, str]]:
    """The setting in words."""
    response = result.response.path
    at = [
        f"{factor.name} = {parameter_value(factor.path, value)}"
        for factor, value in zip(result.factors, answer.point.tolist(), strict=True)
    ]
    there = f"{observed(response, answer.predicted)}, 95 % {observed(response, answer.predicted_low)} … "
    reach = f"{observed(response, answer.reachable_low)} … {observed(response, answer.reachable_high)}"
    said = "gives" if answer.reached else "does not reach"
    nearest = "" if answer.reached else "; nearest in value"
    return [
        ("Answer by the process", f"it {said} {observed(response, answer.target)}{nearest}: {enumeration(at)}"),
        ("The process there", there + observed(response, answer.predicted_high)),
        ("Reachable by the process", reach),
        ("Compatible by the process", f"{percent(answer.compatible_share)} of the region, at 95 %"),
    ]


def process_settings(result: DesignResult, answer: ProcessTarget) -> Table:
    """Every factor at the setting, and its range over the settings compatible with the target."""
    rows = tuple(
        (
            factor.name,
            parameter_label(factor.path),
            parameter_value(factor.path, at),
            parameter_range(factor.path, low, high),
            parameter_value(factor.path, factor.reference),
        )
        for factor, at, low, high in zip(
            result.factors,
            answer.point.tolist(),
            answer.compatible_low.tolist(),
            answer.compatible_high.tolist(),
            strict=True,
        )
    )
    return Table(("letter", "factor", "setting", "compatible with the target", "reference"), rows)


def left_out_chart(result: DesignResult, found: GaussianProcess) -> Spec:
    """Every run against its prediction by a fit without it."""
    predicted = found.observed - found.left_out
    ends = [float(min(found.observed.min(), predicted.min())), float(max(found.observed.max(), predicted.max()))]
    marks = points(
        predicted.tolist(),
        finite(found.observed),
        "run",
        FACTOR,
        error_x=error_bars(np.asarray(1.96 * found.left_out_sd).tolist(), FACTOR),
    )
    same = {"type": "scatter", "mode": "lines", "x": ends, "y": ends, "line": line(TARGET, "dash"), "name": "equal"}
    title = observable_title(result.response.path)
    layout = {"showlegend": False, "xaxis": axis(f"predicted: {title}"), "yaxis": axis(f"observed: {title}")}
    return chart([same, marks], layout, 380)
