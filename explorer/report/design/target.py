"""Where the model leads: its stationary point, the path of its extremes, and the settings that give the target."""

from __future__ import annotations

import math

from doe.analysis.canonical import Canonical, RidgePath
from doe.stages.surface import OptimumResult
from explorer.design.result import DesignResult
from explorer.report.content import Block, Facts, Figure, Section, Table, Text
from explorer.report.design.charts import ridge
from explorer.report.figures.optimum import cloud, ranges
from explorer.report.figures.surface import solutions
from explorer.report.identified import GIVES_TARGET, cloud_caution, rule, settings
from explorer.units import enumeration, number, observed, parameter_value, percent

MOST_PANELS = 3
"""Factors up to which every pair of them has a panel."""


def target(result: DesignResult) -> Section | None:
    """The settings that give the target; None where none was asked for, or found."""
    fitted, optimum, response = result.fitted, result.optimum, result.response.path
    if fitted is None or optimum is None:
        return None
    found = optimum.single

    def between(low: float, high: float) -> str:
        return f"{observed(response, low)} … {observed(response, high)}"

    mean = between(found.predicted_low, found.predicted_high)
    facts = [
        ("Answer", found.statement),
        ("Model there", f"{observed(response, found.predicted)}, 95 % of the mean {mean}"),
        ("Reachable in the region", between(found.reachable_low, found.reachable_high)),
        ("Compatible with the target", f"{percent(found.compatible_share)} of the region, at 95 %"),
    ]  # fmt: skip
    if not found.target_standard_error:
        facts.append(("The target itself", "taken as exact; `--target-error` states its standard error"))
    blocks: list[Block] = [Facts(tuple(facts)), settings_table(result, optimum)]
    surface = solutions(fitted)
    if surface is not None:
        blocks.append(Figure("solutions", surface, "Every setting on the green surface gives the target."))
    blocks.append(Figure("ranges", ranges(fitted), "Thin inside thick: the narrower the bar, the better known."))
    if 1 < len(result.factors) <= MOST_PANELS:
        caption = (
            f"{len(found.bootstrap_points)} refits to resampled {found.resampling}; each dot is the solution "
            f"nearest the reference. {percent(found.share_reached)} of the refits reach the target. "
            + cloud_caution(optimum)
        )
        blocks.append(Figure("cloud", cloud(fitted), caption.rstrip()))
    return Section("Target", tuple(blocks))


def settings_table(result: DesignResult, optimum: OptimumResult) -> Table:
    """Every factor at the target: its value where it is identified, the range that gives the target, its reference."""
    rows = tuple(
        (*setting.cells, parameter_value(factor.path, factor.reference))
        for setting, factor in zip(settings(optimum), result.factors, strict=True)
    )
    header = ("letter", "factor", "identified", GIVES_TARGET, "of low … high", "setting", "95 % set", "reference")
    nearest = "Of all settings that give the target, the one nearest the reference."
    return Table(header, rows, rule(optimum, "reference") or nearest)


def shape(result: DesignResult) -> Section | None:
    """Canonical analysis of a full second-order model, and the path of steepest ascent of any model."""
    model, response = result.analysis.model, result.response.path
    if model is None:
        return None
    canonical = model.canonical
    blocks: list[Block] = []
    if canonical is None:
        blocks.append(Text("The model has not all squares, and so no stationary point of its own."))
    else:
        blocks += [Facts(tuple(_stationary(result, canonical))), axes_table(result, canonical)]
    for path, words in ((model.highest, "highest"), (model.lowest, "lowest")):
        blocks.append(path_table(result, path, words, response))
    caption = "Band: 95 % of the mean. The path ends at the distance of the furthest run and may leave low … high."
    return Section("Shape and ridge", (*blocks, Figure("ridge", ridge(result, model), caption)))


def axes_table(result: DesignResult, canonical: Canonical) -> Table:
    """Eigenvalues with the directions along which the surface curves so."""
    rows = tuple(
        (number(value, 4), *(number(direction[k], 3) for direction in canonical.eigenvectors))
        for k, value in enumerate(canonical.eigenvalues)
    )
    header = ("eigenvalue", *(factor.name for factor in result.factors))
    return Table(header, rows, "Canonical axes, coded: y = y_s + Σ eigenvalue · w².")


def path_table(result: DesignResult, path: RidgePath, words: str, response: str) -> Table:
    """The extreme on spheres of growing radius."""
    rows = tuple(
        (
            number(radius),
            *(parameter_value(f.path, value) for f, value in zip(result.factors, natural, strict=True)),
            observed(response, mean),
            "–" if math.isnan(error) else f"± {number(error)}",
        )
        for radius, natural, mean, error in zip(
            path.radius, path.natural.tolist(), path.predicted, path.standard_error, strict=True
        )
    )
    header = ("distance", *(factor.name for factor in result.factors), "model", "standard error")
    return Table(header, rows, f"Ridge: the {words} response at a distance from the centre [half-widths].")


def _stationary(result: DesignResult, canonical: Canonical) -> list[tuple[str, str]]:
    kind = canonical.kind
    if kind == "ridge":
        return [("Stationary point", "none: a ridge, at least one eigenvalue is zero")]
    place = "inside" if canonical.inside else "outside"
    at = [
        f"{f.name} = {parameter_value(f.path, value)}"
        for f, value in zip(result.factors, canonical.stationary_natural.tolist(), strict=True)
    ]
    coded = ", ".join(number(value, 4) for value in canonical.stationary_coded)
    return [
        ("Stationary point", f"a {kind} {place} the region: {enumeration(at)} (coded {coded})"),
        ("Model there", observed(result.response.path, canonical.stationary_response)),
    ]
