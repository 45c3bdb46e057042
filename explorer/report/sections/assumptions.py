"""What the source does not state: the screened assumptions, the list of assumed values, and the scan of one."""

from __future__ import annotations

from doe.studies.study_result import StudyResult
from explorer.report.content import Block, Bullets, Figure, Folded, Section, Table, Text
from explorer.report.figures.walks import scan as scan_chart
from explorer.report.sections.screening import effect_table, not_testable, row_table
from explorer.units import (
    MISSING,
    code,
    observable_label,
    observed,
    parameter_label,
    parameter_range,
    parameter_value,
    percent,
)


def assumptions(result: StudyResult) -> Section | None:
    """Effects of the assumptions and what is assumed; None where nothing is."""
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
    """The response over one assumption in steps; None where the study declares no scan."""
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
    table = Table((parameter_label(path), "mean", "95 %", "sd of one pour", "not valid"), tuple(rows))
    return Section(
        f"Over the {parameter_label(path)}",
        (Text(text), Figure("scan", scan_chart(scanned, result.study.targets[0]), ""), table),
    )
