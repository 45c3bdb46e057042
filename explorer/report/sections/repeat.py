"""What was run, and how to run it again: outcomes, seeds, shapes, times, versions, command line."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path

from doe.studies.study import TRIES
from doe.studies.study_result import PouredBody, StudyDescription, StudyResult
from explorer.report.content import Block, Code, Section, Table, Text
from explorer.units import MISSING, duration, enumeration, fixed, number, percent
from solver.assets import shipped_assets
from solver.laws import CONTACT_LAWS, HertzMindlin


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
        # Results of before there were several have no name of one.
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
    """The study as the command line takes it: its name if it is shipped, else its file."""
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
