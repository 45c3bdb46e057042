"""Factors with names beside numerical ones: tests with all degrees of freedom, means and settings per name."""

from __future__ import annotations

import math
from collections.abc import Sequence

from doe.analysis.named_factors import NamedFit, NameGroup, NameMean
from explorer.design.result import DesignResult, SheetFactor
from explorer.report.content import Block, Facts, Figure, Folded, Section, Spec, Table, Text
from explorer.report.figures.style import FACTOR, axis, chart, error_bars, label, points
from explorer.report.sections.surface import equation, variance_table
from explorer.units import (
    MISSING,
    enumeration,
    fixed,
    number,
    observable_title,
    observed,
    observed_number,
    p_value,
    parameter_label,
    parameter_value,
    percent,
    with_sign,
)


def names(result: DesignResult) -> Section | None:
    """The model of a design with factors that are names; None for other designs."""
    found = result.analysis.named
    if found is None:
        return None
    n = f"n = {result.runs.valid} runs in {result.runs.rows} rows"
    blocks: list[Block] = [
        Text(
            "A factor of c names has c − 1 degrees of freedom, and all of them are tested together. The mean of a name "
            "is that of the model with the other names weighted equally and every number in its middle."
        ),
        Facts(tuple(fit_facts(result, found))),
        variance_table(found.rows, "Partial sums of squares (Type III)."),
    ]
    if found.means:
        caption = f"{n}. Means of the names with 95 % intervals (t)."
        blocks += [Figure("names", name_chart(result, found), caption), means_table(result, found.means)]
    blocks.append(groups_table(result, found))
    equations = [
        (enumeration(group.names), equation(group, numbers_of(result, found), result.response.path)[1])
        for group in found.groups
    ]
    if numbers_of(result, found):
        blocks.append(Folded("Equations of the numbers, per combination of names", (Facts(tuple(equations)),)))
    return Section("Names", (*blocks, Folded("All runs against the model", (run_table(result, found),))))


def fit_facts(result: DesignResult, found: NamedFit) -> list[tuple[str, str]]:
    """How well the model fits, and which runs disagree with it."""
    r2 = (found.r_squared, found.r_squared_adjusted, found.r_squared_predicted)
    press = "" if math.isinf(found.press) else f" (PRESS {number(found.press, 4)})"
    runs = enumeration([f"run {result.labels[k]}" for k in found.outliers])
    facts = [
        ("R², adjusted, predicted", ", ".join(fixed(value, 4) for value in r2) + press),
        ("Scatter of one run", f"{observed(result.response.path, found.sigma)}, {found.df_residual} df"),
        ("Outliers", f"{runs} (|studentised residual| > {number(found.outlier_limit)})"),
    ]
    if found.block_names:
        told = ", ".join(
            f"{name} {with_sign(observed_number(result.response.path, effect))}"
            for name, effect in zip(found.block_names, found.block_effects, strict=True)
        )
        facts.append(("Blocks", f"{told}; they add up to zero, and the model is their mean"))
    return facts


def numbers_of(result: DesignResult, found: NamedFit) -> list[SheetFactor]:
    """The factors that are numbers."""
    return [factor for factor, levels in zip(result.factors, found.levels, strict=True) if not levels]


def names_of(result: DesignResult, found: NamedFit) -> list[SheetFactor]:
    """The factors that are names."""
    return [factor for factor, levels in zip(result.factors, found.levels, strict=True) if levels]


def means_table(result: DesignResult, means: Sequence[NameMean]) -> Table:
    """Per name: its mean with the interval, and its effect."""
    response, title = result.response.path, {factor.name: factor.factor for factor in result.factors}
    rows = tuple(
        (
            one.factor,
            f"{title[one.factor]}: {one.name}",
            observed(response, one.mean),
            f"{observed(response, one.low)} … {observed(response, one.high)}",
            with_sign(number(one.effect, 4)),
            number(one.standard_error),
            p_value(one.p),
        )
        for one in means
    )
    header = ("letter", "name", "mean", "95 %", "effect", "standard error", "p")
    return Table(header, rows, "Effect: the mean of a name less that of all names of the factor.")


def groups_table(result: DesignResult, found: NamedFit) -> Table:
    """Every combination of names: its mean, and the numbers that give the target."""
    numbers, response = numbers_of(result, found), result.response.path
    header = [factor.factor for factor in names_of(result, found)]
    header += ["runs", "mean", "95 %"]
    solved = any(group.setting for group in found.groups)
    if solved:
        header += ["gives the target", *(factor.factor for factor in numbers), "model there", "compatible"]
    rows = []
    for group in found.groups:
        cells = [*group.names, str(group.runs), observed(response, group.mean)]
        cells.append(f"{observed(response, group.low)} … {observed(response, group.high)}")
        setting = group.setting
        if setting is not None:
            cells.append("yes" if setting.reached else "no")
            for factor, at, low, high in zip(
                numbers,
                setting.point.tolist(),
                setting.solution_low.tolist(),
                setting.solution_high.tolist(),
                strict=True,
            ):
                ends = "" if math.isnan(low) or low == high else f" ({number(low, 4)} … {number(high, 4)})"
                cells.append(parameter_value(factor.path, at) + ends)
            half = (setting.predicted_high - setting.predicted_low) / 2
            cells += [f"{observed(response, setting.predicted)} ± {number(half)}", percent(setting.compatible_share)]
        rows.append(tuple(cells))
    caption = "Means: every number in its middle."
    if solved and numbers:
        caption += (
            " Of all settings that give the target, the one nearest the reference; in brackets how far each number "
            "ranges while the model gives it. Compatible: share of low … high whose mean is the target, at 95 %."
        )
    return Table(tuple(header), tuple(rows), caption)


def target_words(result: DesignResult, found: NamedFit) -> str:
    """Which combinations of names give the target."""
    if not any(group.setting for group in found.groups):
        return MISSING
    giving = [group for group in found.groups if group.setting and group.setting.reached]
    if not giving:
        return f"none of {len(found.groups)} combinations of names"
    listed = enumeration([setting_words(result, found, group) for group in giving[:4]])
    more = f", and {len(giving) - 4} more" if len(giving) > 4 else ""
    return f"{len(giving)} of {len(found.groups)} combinations of names: {listed}{more}"


def setting_words(result: DesignResult, found: NamedFit, group: NameGroup) -> str:
    """Names, and the numbers that go with them."""
    assert group.setting is not None
    numbers = numbers_of(result, found)
    at = [
        f"{factor.factor} = {parameter_value(factor.path, value)}"
        for factor, value in zip(numbers, group.setting.point.tolist(), strict=True)
    ]
    return " / ".join(group.names) + (f" with {enumeration(at)}" if at else "")


def name_chart(result: DesignResult, found: NamedFit) -> Spec:
    """The mean of every name with its interval, the factors side by side."""
    title = {factor.name: parameter_label(factor.path) for factor in result.factors}
    places = [label(f"{title[one.factor]}: {one.name}") for one in found.means]
    widths = error_bars([(one.high - one.low) / 2 for one in found.means], FACTOR)
    traces = [points(places, [one.mean for one in found.means], "mean", FACTOR, error_y=widths)]
    layout = {"showlegend": False, "xaxis": axis(""), "yaxis": axis(observable_title(result.response.path))}
    return chart(traces, layout, 340)


def run_table(result: DesignResult, found: NamedFit) -> Table:
    """Every run with the model and its residual."""
    response = result.response.path
    rows = tuple(
        (
            name,
            *(
                parameter_value(factor.path, level)
                for factor, level in zip(result.factors, result.levels_of(found.row_of_run[k]), strict=True)
            ),
            observed(response, found.observed[k]),
            observed(response, found.predicted[k]),
            number(found.studentized[k]),
        )
        for k, name in enumerate(result.labels)
    )
    header = ("run", *(f.factor for f in result.factors), "observed", "model", "externally studentised")
    return Table(header, rows)
