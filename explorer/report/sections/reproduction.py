"""The end of the report: stages of other packages, the paper's numbers beside ours, and how to run it all again.

Source of the paper's numbers: Processes 2022, 10, 185. Its tables are assets; numbers found only in its text
(section 3) are here.
"""

from __future__ import annotations

import csv
import shlex
from collections.abc import Sequence
from pathlib import Path

from doe.analysis.t_tests import Sample
from doe.stages import STAGES
from doe.studies.study import TRIES
from doe.studies.study_result import PouredBody, StudyDescription, StudyResult
from explorer.report.content import Block, Bullets, Code, Facts, Section, Table, Text
from explorer.report.identified import GIVES_TARGET, settings
from explorer.units import (
    MISSING,
    duration,
    enumeration,
    fixed,
    number,
    observed,
    p_value,
    parameter_label,
    parameter_value,
    percent,
)
from solver import asset_path
from solver.assets import shipped_assets
from solver.laws import CONTACT_LAWS, HertzMindlin


def further(result: StudyResult) -> tuple[Section, ...]:
    """Line, named findings, notes and number of runs of every stage from another package."""
    return tuple(_section(result, name) for name in result.further)


def _section(result: StudyResult, name: str) -> Section:
    found = result.further[name]
    facts = [(fact, value if isinstance(value, str) else number(value)) for fact, value in found.facts.items()]
    runs = sum(len(rows) for rows in found.runs)
    blocks: list[Block] = [Text(found.line)]
    if facts or runs:
        blocks.append(Facts((*facts, ("Runs", str(runs)))))
    if found.notes:
        blocks.append(Bullets(found.notes))
    # A result may be read on a machine without the package that made it.
    stage = STAGES.get(name)
    return Section(name.replace("_", " ").capitalize() if stage is None else stage.title, tuple(blocks))


STUDY = "sunflower_extract"
PRINTED_SIGNIFICANT = ("X4", "X7", "X16")
PRINTED_OPTIMUM = {"X4": 58.34e6, "X7": 0.62, "X16": 0.608}
"""[Pa], 1, 1."""
PRINTED_MEAN_DEG = 24.91
PRINTED_RELATIVE_ERROR_PERCENT = 0.923
PRINTED_P = 0.827


def paper(result: StudyResult) -> Section | None:
    """Factors, optimum and verification side by side; None for any other study."""
    if result.study.name != STUDY:
        return None
    analysis = result.screening.analysis
    their_way = analysis.significant(adjust="none", error="dummies")
    text = (
        f"The paper (Processes 2022, 10, 185) found {enumeration(list(PRINTED_SIGNIFICANT))} significant, judged "
        f"against three dummy columns without correction. Here: {enumeration(their_way)} in that way, "
        f"{enumeration(analysis.significant())} after Holm against the {analysis.error_source}."
    )
    return Section("Compared with the paper", (Text(text), _optimum(result), _verification(result), _factors(result)))


def _optimum(result: StudyResult) -> Table:
    found = {setting.name: setting for setting in settings(result.optimum)}
    rows = []
    for factor in result.study.factors:
        name, path = factor.name, factor.path
        if name not in PRINTED_OPTIMUM and name not in found:
            continue
        here = found.get(name)
        ours = (MISSING,) * 3 if here is None else (here.value, here.confidence_set, here.feasible)
        rows.append((name, parameter_label(path), parameter_value(path, PRINTED_OPTIMUM.get(name)), *ours))
    header = ("factor", "parameter", "paper's optimum", "optimum here", "95 % set here", f"{GIVES_TARGET} here")
    return Table(header, tuple(rows))


def _verification(result: StudyResult) -> Table:
    name = result.study.targets[0].observable
    test = result.verification.tests[0]
    pours = [float(row["simulated_angle_of_repose_deg"]) for row in _table("table10_verification")]
    p = None if test.pooled is None else test.pooled.p
    ours = test.simulated
    rows = (
        ("simulated pours", f"{len(pours)}: {', '.join(f'{value:.2f}°' for value in pours)}", str(ours.n)),
        ("simulated mean", f"{PRINTED_MEAN_DEG:.2f}°", observed(name, ours.mean)),
        ("sd of one pour", f"{fixed(Sample.of(pours).sd)}° (from the three pours)", observed(name, ours.sd)),
        ("measured mean", "24.68°", observed(name, test.target.mean)),
        (
            "relative error",
            f"{PRINTED_RELATIVE_ERROR_PERCENT} % as printed",
            f"{fixed(test.relative_error_percent)} %",
        ),
        ("p, two-sample t test", f"{PRINTED_P}", p_value(p)),
    )
    caption = (
        "The paper's 0.923 % is 0.23° divided by its simulated mean, 24.91°; ours is divided by the measured mean. "
        "p: Student's test with equal variances on both sides."
    )
    return Table(("", "paper", "here"), rows, caption)


def _factors(result: StudyResult) -> Table:
    printed = {row["factor"]: row for row in _table("table6_plackett_burman_anova")}
    paths = {factor.name: factor.path for factor in result.study.factors}
    rows = []
    for effect in result.screening.analysis.effects:
        if effect.is_dummy or effect.name not in printed:
            continue
        row, by_dummies, by_replicates = printed[effect.name], effect.by_dummies, effect.by_replicates
        deciding = by_replicates or by_dummies
        rows.append(
            (
                effect.name,
                parameter_label(paths[effect.name]),
                row["sum_of_squares"],
                fixed(effect.sum_of_squares),
                row["p_value"],
                MISSING if by_dummies is None else p_value(by_dummies.p),
                MISSING if by_replicates is None else p_value(by_replicates.p),
                MISSING if deciding is None else p_value(deciding.p_holm),
            )
        )
    header = (
        *("factor", "parameter", "paper: sum of squares", "here: sum of squares", "paper: p"),
        *("here: p dummies", "here: p replicates", "here: p Holm"),
    )
    return Table(header, tuple(rows), "The paper's columns as printed in its Table 6.")


def _table(name: str) -> list[dict[str, str]]:
    with asset_path("source_tables", name).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def runs(result: StudyResult) -> Section:
    """Outcomes by stage, seeds, and the shapes that were poured."""
    counted, totals = result.runs.outcomes(), result.runs
    names = sorted({name for outcomes in counted.values() for name in outcomes})
    rows = [
        (stage, *(str(outcomes[name]) for name in names), str(outcomes.total())) for stage, outcomes in counted.items()
    ]
    rows.append(("all", *(str(totals.by_outcome.get(name, 0)) for name in names), str(totals.total)))
    seeds = {run.seed for run in totals.list}
    root = MISSING if result.study.seed is None else result.study.seed
    text = (
        f"{totals.total} pours with {len(seeds)} different seeds, all drawn from the study's seed "
        f"{root} by stage, row, replicate and attempt; `result.json` lists the seed, "
        "outcome and store key of every pour."
    )
    blocks: list[Block] = [
        Text(text),
        Table(("stage", *(name.replace("_", " ") for name in names), "pours"), tuple(rows)),
    ]
    if contact := result.study.contact:
        # Results from before there were several laws name none.
        law = contact.get("law", HertzMindlin.name)
        title = CONTACT_LAWS[law].title if law in CONTACT_LAWS else law
        named = ", ".join(f"{name.replace('_', ' ')} {choice}" for name, choice in contact.items() if name != "law")
        blocks.append(Text(f"Contact law: {title}; {named} (`explorer parameters`, contact.*)."))
    if result.shapes:
        blocks.append(_shapes(result.shapes))
    return Section("Runs", tuple(blocks))


def repeat(result: StudyResult) -> Section:
    """Command line, time per stage and versions."""
    study, timing = result.study, result.timing
    command = f"explorer calibrate --headless --study {_study(study)} --profile {shlex.quote(study.profile.name)}"
    if study.tries != TRIES:
        command += f" --tries {study.tries}"
    times = [(stage, duration(seconds)) for stage, seconds in timing.stage_s.items()]
    times.append(("all", duration(timing.total_s)))
    rate = f"{number(timing.runs_per_minute)} pours per minute."
    if timing.reused_runs:
        rate += f" {timing.reused_runs} pours were found in the store and not run again."
    versions = tuple((name, version or "not installed") for name, version in result.versions.items())
    return Section(
        "How to repeat",
        (
            Code(f"{command} --out results"),
            Table(("stage", "time"), tuple(times), rate),
            Table(("program", "version"), versions),
        ),
    )


def _study(study: StudyDescription) -> str:
    """The study as an argument of the command line: its name if it is shipped, else its file."""
    shipped = study.name in shipped_assets("studies") and Path(study.file).parent.name == "studies"
    return study.name if shipped else shlex.quote(study.file)


def _shapes(shapes: Sequence[PouredBody]) -> Table:
    rows = []
    for shape in shapes:
        fit = shape.fit
        extents = enumeration([percent(error, 1) for error in fit.extent_errors])
        rows.append(
            (
                shape.body,
                str(fit.n_spheres),
                percent(fit.volume_ratio, 1),
                percent(fit.covered_ratio, 1),
                f"{fixed(1e3 * fit.surface_rms)} mm",
                f"{fixed(1e3 * fit.surface_max)} mm",
                extents,
            )
        )
    header = (
        *(
            "body",
            "spheres",
            "volume of the union",
            "solid covered",
            "surface RMS",
            "surface max",
            "extent errors x, y, z",
        ),
    )
    return Table(header, tuple(rows), "How well the member spheres stand for the solid of each body.")
