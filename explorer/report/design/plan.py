"""The report of a planned experiment: the runs of its sheet, what is confounded with what, and what it can detect."""

from __future__ import annotations

import math

import numpy as np

from doe.analysis.power import TermPrecision
from doe.designs import DESIGNS, factor_letters
from explorer.design.factors_file import DesignFactor, region_of
from explorer.design.plan_result import OF_NAMES, TERMS, PlanResult
from explorer.design.run_plan import BLOCK, COLUMNS, level_text
from explorer.report.content import (
    Banner,
    Block,
    Bullets,
    Caution,
    DataTable,
    Facts,
    Figure,
    Report,
    Section,
    Spec,
    Strong,
    Table,
    Word,
)
from explorer.report.figures.style import (
    ASSUMPTION,
    BELOW_TO_ABOVE,
    CHOSEN,
    DUMMY,
    FACTOR,
    axis,
    chart,
    horizontal_line,
    label,
    line,
)
from explorer.report.methods import plan_methods
from explorer.units import counted, enumeration, number

MOST_ROWS = 60
"""Runs that the page lists at most; the data files have all."""
ROW = 30
"""Height of a factor's row [px]."""
WANTED = 0.8
"""Chance of detection by which the smallest detectable change is defined."""
FURTHEST = 2.0
"""Multiple of the largest of these changes up to which chances are drawn."""


def plan_report(result: PlanResult) -> Report:
    """The report of a plan: what to run, in which order, and what the runs will be able to show."""
    methods, references = plan_methods(result)
    sections = (_in_short(result), _runs(result), _power(result), _aliases(result), methods)
    return Report(
        title=result.title or f"{DESIGNS[result.design].title} design",
        subtitle=f"{', '.join([DESIGNS[result.design].title, *result.traits])}: planned runs of {_count(result)}",
        banner=banner(result),
        sections=tuple(section for section in sections if section.blocks),
        about=result.about,
        data=(_sheet(result),),
        references=references,
    )


def _count(result: PlanResult) -> str:
    n = len(result.factors)
    return "one factor" if n == 1 else f"{n} factors"


CHANGES = {"factor": "by a factor (low to high)", "name": "between two names of a factor"}
"""Kinds of terms that the banner mentions."""


def banner(result: PlanResult) -> Banner:
    """The number of runs, and the smallest change by a factor that they will detect."""
    seen = [one for one in result.power if one.kind in CHANGES and math.isfinite(one.smallest)]
    if seen:
        in_sigma = "" if math.isfinite(result.sigma) else " σ"
        told = ", σ the standard deviation of one run" if in_sigma else ""
        changes = " and ".join(f"{number(one.smallest)}{in_sigma} {CHANGES[one.kind]}" for one in seen)
        why = f"A change of {changes} is seen with a chance of 0.8 at p < 0.05{told}."
    elif DESIGNS[result.design].mixture:
        why = "Blends of parts of a whole, for Scheffé’s polynomials."
    else:
        why = "No chance to see a change is told: nothing is left for an error."
    return Banner(
        Word.PLANNED,
        f"{len(result.sequence)} runs of {_count(result)}",
        why,
        f"Fill in {enumeration(result.responses)} in the order of the sheet, then `explorer analyse`.",
    )


def _in_short(result: PlanResult) -> Section:
    letters = factor_letters(len(result.factors))
    size = f"{len(result.coded)} rows × {result.replicates} = {len(result.sequence)} runs"
    facts = [
        ("Design", ", ".join([DESIGNS[result.design].title, *result.traits])),
        ("Size", size),
        ("To fill in", enumeration(result.responses)),
        ("Model that the runs bear", result.model or "none with an error"),
        ("Seed of the order", str(result.seed)),
    ]
    rows = tuple(
        (letter, one.name.replace("_", " "), *_levels(one), one.unit or "1")
        for letter, one in zip(letters, result.factors, strict=True)
    )
    table = Table(
        ("letter", "factor", "low (−1)", "high (+1)", "reference", "unit"),
        rows,
        "Levels are set, and count as exact: what a setting is off by is scatter of the response.",
    )
    return Section("In short", (Facts(tuple(facts)), *map(Caution, result.notes), table))


def _levels(factor: DesignFactor) -> tuple[str, str, str]:
    if factor.levels:
        return factor.levels[0], factor.levels[-1], "–"
    return number(factor.low, 6), number(factor.high, 6), number(factor.reference, 6)


def _runs(result: PlanResult) -> Section:
    caption = (
        f"n = {len(result.sequence)} runs of {len(result.coded)} rows, in the order to make them. Colour: coded level, "
        "low is −1, high is +1."
    )
    sheet = _sheet(result)
    rows = tuple(tuple(str(cell) for cell in row) for row in sheet.rows[:MOST_ROWS])
    more = (
        f"The first {MOST_ROWS} of {len(sheet.rows)} runs; all are in the data." if len(sheet.rows) > MOST_ROWS else ""
    )
    return Section("Runs", (Figure("levels", levels(result), caption), Table(sheet.header, rows, more)))


def levels(result: PlanResult) -> Spec:
    """Coded level of every factor over the runs, in their order."""
    of_run = result.coded[[row - 1 for row, _ in result.sequence]]
    k = len(result.factors)
    most = max(1.0, float(np.abs(of_run).max()))
    trace = {
        "type": "heatmap",
        "x": list(range(1, len(of_run) + 1)),
        "y": list(range(k)),
        "z": of_run.T.tolist(),
        "name": "level",
        "coloraxis": "coloraxis",
        "xgap": 1,
        "ygap": 1,
        "hovertemplate": "run %{x}: %{z:.3g}<extra></extra>",
    }
    names = [label(one.name.replace("_", " ")) for one in result.factors]
    layout = {
        "coloraxis": {
            "colorscale": BELOW_TO_ABOVE,
            "cmin": -most,
            "cmax": most,
            "colorbar": {"title": {"text": "level, coded"}},
        },
        "xaxis": axis("run, in the order to make them"),
        "yaxis": axis("", tickvals=list(range(k)), ticktext=names, range=[k - 0.5, -0.5]),
    }
    return chart([trace], layout, 150 + ROW * k)


def _power(result: PlanResult) -> Section:
    found = [one for one in result.power if math.isfinite(one.smallest)]
    if not found:
        return Section("What it will see", ())
    in_sigma = not math.isfinite(result.sigma)
    unit = "σ, the standard deviation of one run" if in_sigma else "unit of the response"
    effects = [one for one in found if math.isfinite(one.power)]
    asked = f"chance to see {number(effects[0].effect)}{' σ' if in_sigma else ''}" if effects else ""
    rows = tuple(
        (
            TERMS[one.kind],
            str(one.terms),
            number(one.standard_error),
            Strong(number(one.smallest)),
            number(one.smallest_of_all),
            *([number(one.power)] if effects else []),
        )
        for one in found
    )
    header = ("change, low to high", "terms", "standard error", "seen with chance 0.8", "for all at once")
    caption = (
        f"The {result.model} model at p < 0.05, in {unit}; {counted(found[0].df, 'degree of freedom')} for the error."
    )
    names = any(one.df_term > 1 for one in found)
    caption += f" {OF_NAMES}" if names else ""
    blocks: tuple[Block, ...] = (
        Figure(
            "power",
            power(found, unit),
            f"{counted(found[0].df, 'degree of freedom')}; noncentral {'t and F' if names else 't'}, "
            "p < 0.05, one term alone.",
        ),
        Table((*header, *([asked] if asked else [])), rows, caption),
    )
    return Section("What it will see", blocks)


def power(found: list[TermPrecision], unit: str) -> Spec:
    """Chance of detecting a change of each kind of term, over its size."""
    changes = np.linspace(0.0, FURTHEST * max(one.smallest for one in found), 81)[1:]
    traces = [
        {
            "type": "scatter",
            "mode": "lines",
            "x": changes.tolist(),
            "y": [one.chance(float(change)) for change in changes],
            "name": TERMS[one.kind],
            "line": line(colour, width=2),
        }
        for one, colour in zip(found, (FACTOR, ASSUMPTION, CHOSEN, DUMMY), strict=False)
    ]
    layout = {
        "xaxis": axis(f"change of the response [{unit}]", rangemode="tozero"),
        "yaxis": axis("chance to see it", range=[0.0, 1.02]),
        "shapes": [horizontal_line(WANTED, ASSUMPTION, dash="dot")],
    }
    return chart(traces, layout)


def _aliases(result: PlanResult) -> Section:
    if not result.aliases:
        return Section("Aliases", ())
    facts = Caution("What is on the left also holds what is on the right.")
    return Section("Aliases", (facts, Bullets(result.aliases)))


def _sheet(result: PlanResult) -> DataTable:
    """The runs in order, with levels in the units of the factors, as on the sheet."""
    natural = region_of(result.factors).natural(result.coded)
    own = (*COLUMNS, BLOCK) if result.block else COLUMNS
    rows: list[tuple[str | int, ...]] = []
    for position, (row, replicate) in enumerate(result.sequence):
        block = result.block[position : position + 1]
        settings = [level_text(one, value) for one, value in zip(result.factors, natural[row - 1], strict=True)]
        rows.append((row, replicate, position + 1, result.seeds[position], *block, *settings))
    return DataTable("runs", (*own, *(factor.title for factor in result.factors)), tuple(rows))
