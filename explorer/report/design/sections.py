"""Sections of the report of a design, in the order of the page: what was found, then how."""

from __future__ import annotations

import shlex
from collections.abc import Callable

from explorer.report.content import Block, Caution, Code, Facts, Section, Table, Text
from explorer.report.design.effects import effects
from explorer.report.design.model import diagnostics, model, units_of_factors
from explorer.report.design.target import shape, target
from explorer.report.findings import Plain, mean_and_sd
from explorer.report.sections.surface import equation
from explorer.report.units_for_people import (
    enumeration,
    fixed,
    number,
    observed,
    parameter_label,
    parameter_value,
)


def sections_of(result: Plain) -> tuple[Section, ...]:
    """Every section that ``result`` has something for."""
    found = (make(result) for make in SECTIONS)
    return tuple(section for section in found if section is not None)


def in_short(result: Plain) -> Section:
    """The answer in a few lines, and what the letters stand for."""
    runs, response = result["runs"], result["response"]["path"]
    facts = [("Runs", f"{runs['valid']} with a result at {runs['rows']} rows, {runs['missing']} without")]
    if result["effects"] is not None:
        facts.append(("Factors that act", acting(result)))
    if result["surface"] is not None:
        anova = result["surface"]["anova"][0]
        if result["effects"] is None:
            facts.append(("Terms that act", terms_that_act(anova)))
        coded, actual = equation(result["surface"], 0)
        r2 = (anova["r_squared"], anova["r_squared_adjusted"], anova["r_squared_predicted"])
        facts += [
            ("Equation, coded", coded),
            ("Equation, actual", actual + units_of_factors(result)),
            ("R², adjusted, predicted", ", ".join(fixed(value, 4) for value in r2)),
            ("Scatter of one run", observed(response, anova["sigma"])),
        ]
    if result["optimum"] is not None:
        facts.append(("Target", result["optimum"]["single"]["statement"]))
    cautions: list[Block] = [Caution(text) for text in result["notes"]]
    return Section("In short", (Facts(tuple(facts)), *cautions, factor_table(result)))


def acting(result: Plain) -> str:
    """Which effects are significant, and by which judgement."""
    analysis = result["effects"]["analysis"]
    key, words = (
        ("by_replicates", "the replicates")
        if analysis["pure_error"] is not None
        else ("by_dummies", "the columns without a factor")
    )
    tested = [e for e in analysis["effects"] if not e["is_dummy"] and e[key] is not None and e[key]["p"] is not None]
    if tested:
        alone = [effect["name"] for effect in tested if effect[key]["p"] < 0.05]
        all_at_once = [effect["name"] for effect in tested if effect[key]["p_holm"] < 0.05]
        return (
            f"against {words}: {enumeration(alone)} (p < 0.05 each alone); {enumeration(all_at_once)} after Holm's "
            "correction"
        )
    margin = analysis["lenth"]["margin"]
    beyond = [e["name"] for e in analysis["effects"] if e["effect"] is not None and abs(e["effect"]) > margin]
    return f"beyond Lenth's margin {number(margin)}: {enumeration(beyond)}"


def terms_that_act(anova: Plain) -> str:
    """Terms of the model with p < 0.05, each alone."""
    whole = ("model", "residual", "lack_of_fit", "pure_error", "total")
    terms = [row for row in anova["rows"] if row["source"] not in whole]
    acting = [
        row["source"].replace("*", " × ").replace("^2", "²")
        for row in terms
        if row["p"] is not None and row["p"] < 0.05
    ]
    if all(row["p"] is None for row in terms):
        return "cannot be told without scatter"
    return f"{enumeration(acting)} (p < 0.05 each alone, of {len(terms)} terms)"


def factor_table(result: Plain) -> Table:
    """Letters, names and ranges of the factors."""
    rows = tuple(
        (
            factor["name"],
            parameter_label(factor["path"]),
            parameter_value(factor["path"], factor["low"]),
            parameter_value(factor["path"], factor["high"]),
            parameter_value(factor["path"], factor["reference"]),
        )
        for factor in result["factors"]
    )
    return Table(("letter", "factor", "low (−1)", "high (+1)", "reference"), rows)


def all_runs(result: Plain) -> Section | None:
    """Every row of the design with its results."""
    if result["surface"] is None:
        return None
    surface, response = result["surface"], result["response"]["path"]
    values = surface["models"][0]
    rows = []
    for row, natural in enumerate(surface["natural"]):
        own = [k for k, at in enumerate(values["row_of_run"]) if at == row]
        mean, sd = mean_and_sd([values["observed"][k] for k in own])
        levels = (parameter_value(f["path"], value) for f, value in zip(surface["factors"], natural, strict=True))
        predicted = values["predicted"][own[0]] if own else None
        names = enumeration([result["labels"][k] for k in own]) if own else "–"
        rows.append((names, *levels, observed(response, mean), observed(response, sd), observed(response, predicted)))
    header = ("run", *(factor["name"] for factor in surface["factors"]), "result", "sd", "model")
    return Section("Runs", (Table(header, tuple(rows)),))


def repeat(result: Plain) -> Section:
    """The command that gives the same answer."""
    text = (
        "Sums of squares are partial (Type III). Bootstrap refits have a fixed seed, so the same sheet gives the same "
        "numbers; `result.json` holds all of them."
    )
    versions = tuple((name, version or "not installed") for name, version in result["versions"].items())
    command = Code(shlex.join(result["command"]))
    return Section("How to repeat", (Text(text), command, Table(("program", "version"), versions)))


SECTIONS: tuple[Callable[[Plain], Section | None], ...] = (
    in_short,
    target,
    effects,
    model,
    diagnostics,
    shape,
    all_runs,
    repeat,
)
