"""A diagnosis from its order to its files: the data are read, the loop is run, and its answer written."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from doe.declared.pours import measured_profile
from doe.diagnose.budget import Budget, scaled_budget
from doe.diagnose.confirm import CONTRADICTED, Confirmed
from doe.diagnose.diagnosis import Diagnosis, run_diagnosis
from doe.diagnose.levels import STRONG
from doe.diagnose.posterior import FITS, NOTHING, OUTSIDE, PAIRS
from doe.diagnose.verdict import CREDIBLE, NOTHING_AT_ONCE, NOTHING_FROM
from doe.holdout import HoldoutError
from doe.measurement.load import load_measurement
from doe.measurement.measurement import Condition, Measurement
from doe.measurement.summaries import summaries
from doe.record import plain
from doe.store import Store, default_store
from explorer.diagnosis.corrected import corrected_toml, study_toml
from explorer.diagnosis.next_folder import read_next, write_next
from explorer.diagnosis.progress import PourProgress
from explorer.errors import CommandError
from explorer.files.run_result import versions
from explorer.files.whole_file import write_whole
from explorer.report.diagnosis import write_diagnosis_report
from solver import EFFECTS, Crew

SCHEMA = 3
RULE = {
    "prior_nothing": NOTHING,
    "prior_outside": OUTSIDE,
    "prior_pairs": PAIRS,
    "fits": FITS,
    "nothing_at_once": NOTHING_AT_ONCE,
    "nothing_from": NOTHING_FROM,
    "credible": CREDIBLE,
    "contradicted": CONTRADICTED,
    "strong": STRONG,
}
"""Constants of the rule that the report tells."""


@dataclass(frozen=True)
class DiagnoseOrder:
    """What a user asked for."""

    folder: Path
    out: Path
    effects: tuple[str, ...] = ()
    budget: int | None = None
    resume: bool = False
    store: Path | None = None
    threads: int | None = None
    apply: bool = False
    seed: int = 0
    follow_up: Path | None = None


def run_diagnose(order: DiagnoseOrder, say: Callable[[str], None]) -> Diagnosis:
    """Run the loop and write the files. Finished pours are kept in the store, so an interrupted one goes on."""
    unknown = [name for name in order.effects if name not in EFFECTS]
    if unknown:
        raise CommandError(f"--effects: {unknown[0]!r} is not one of {', '.join(EFFECTS)}")
    measurement = load_measurement(order.folder)
    if order.out.is_file() or (order.out.is_dir() and any(order.out.iterdir()) and not order.resume):
        raise CommandError(f"--out {order.out}: is not empty; name a new folder, or add --resume to go on there")
    names = order.effects or tuple(EFFECTS)
    asked = read_next(order.follow_up) if order.follow_up else None
    follow_up = asked.measurement if asked else None
    path = order.store or default_store()
    budget = Budget()
    if order.budget is not None:
        budget = scaled_budget(order.budget, measurement, names)
    order.out.mkdir(parents=True, exist_ok=True)
    say(
        f"{order.folder}: {len(measurement.fit)} fitted and {len(measurement.holdout)} held-out conditions; store "
        f"{path}"
    )
    progress = PourProgress(order.out / "progress.jsonl", say, terminal=sys.stdout.isatty())
    progress.compiling()
    with ExitStack() as stack:
        store = Store(path)
        stack.callback(store.close)
        crew = stack.enter_context(Crew(order.threads))
        found = run_diagnosis(
            measurement, store, crew.run_queue, names, budget, progress.stage, progress.pour, order.seed, follow_up
        )
    result = result_of(measurement, order, found, progress.elapsed)
    write_whole(order.out / "diagnosis.json", json.dumps(result, ensure_ascii=False, allow_nan=False, indent=1) + "\n")
    write_diagnosis_report(result, order.out)
    say(f"{order.out}/report.html, report.md, diagnosis.json")
    if found.suggestions:
        write_next(order.out / "next", order.folder, measurement, found.suggestions[0])
        say(f"{order.out}/next: what to measure next, to be filled in; then --follow-up {order.out}/next")
    if order.apply:
        write_whole(order.out / "corrected.toml", corrected_toml(measurement, found))
        say(f"{order.out}/corrected.toml: the corrected model, for every command that takes a material")
        text = study_toml(measurement, found, "corrected.toml")
        if text:
            path = order.out / "corrected_study.toml"
            write_whole(path, text)
            say(f"{path}: its calibration, the effect among the factors: explorer calibrate --headless --study {path}")
    for line in error_lines(result):
        say(line)
    return found


def result_of(measurement: Measurement, order: DiagnoseOrder, found: Diagnosis, total_s: float) -> dict[str, Any]:
    """The content of ``diagnosis.json``."""
    verdict = found.verdict
    units = {s.name: s.unit for condition in found.conditions for s in summaries(condition)}
    return plain(
        {
            "schema": SCHEMA,
            "verdict": verdict.kind,
            "statement": verdict.statement,
            "names": verdict.names,
            "probabilities": {"nothing": verdict.nothing, "outside": verdict.outside},
            "threshold": verdict.threshold,
            "rule": RULE,
            "temperature": verdict.temperature,
            "taken_back": verdict.taken_back,
            "final": verdict.final,
            "effects": verdict.effects,
            "levels": found.levels,
            "ranges": found.declared.effects,
            "parameters": verdict.parameters,
            "residuals": verdict.residuals,
            "where": verdict.where,
            "similar": verdict.similar,
            "scatter": verdict.scatter,
            "left_out": verdict.left_out,
            "offered": found.offered,
            "error": {
                role: [_error(row, units) for row in rows]
                for role, rows in (("fit", found.fit_error), ("holdout", found.holdout_error))
            },
            "held_out": found.held_out,
            "next_experiment": found.suggestions,
            "confirmation": {
                "before": _confirmed(found.conditions, found.before),
                "after": _confirmed(found.conditions, found.after),
            },
            "measured": [
                {
                    "condition": condition.name,
                    "role": condition.role,
                    "rig": condition.scene.rig.name,
                    "replicates": condition.replicates * condition.mean_of,
                    "summaries": [s.name for s in summaries(condition)],
                }
                for condition in found.conditions
            ],
            "piles": [picture for c in range(len(found.conditions)) for picture in _piles(found, c)],
            "maps": found.maps,
            "data": {
                "folder": str(order.folder),
                "title": measurement.title,
                "ignored": measurement.ignored,
                "notes": measurement.notes,
            },
            "order": {"out": str(order.out), "effects": order.effects, "budget": order.budget, "seed": order.seed}
            | {"follow_up": str(order.follow_up) if order.follow_up else None},
            "units": units,
            "pours": {"run": found.pours, "settings": found.settings},
            "timing": {"total_s": total_s},
            "versions": versions(),
        }
    )


def error_lines(result: dict[str, Any]) -> list[str]:
    """The table *before | after | noise floor* on held-out data, or on fitted data where there are none."""
    rows: Sequence[dict[str, Any]] = result["error"]["holdout"] or result["error"]["fit"]
    role = "held-out" if result["error"]["holdout"] else "fitted"
    lines = [f"error on {role} data", f"{'observable':26} {'before':>10} {'after':>10} {'noise floor':>12}"]
    for row in rows:
        numbers = (row["before"], row["after"], row["noise_floor"])
        before, after, floor = (f"{x:.3g}" if x is not None else "–" for x in numbers)
        lines.append(f"{row['observable']:26} {before:>10} {after:>10} {floor:>12}")
    return lines


def _error(row: HoldoutError, units: dict[str, str]) -> dict[str, Any]:
    return {**row.to_dict(), "unit": units.get(row.observable, "σ")}


def _piles(found: Diagnosis, number: int) -> Iterator[dict[str, Any]]:
    """Height profiles [m] of condition ``number``, measured and by both models; none where the data have none."""
    condition = found.conditions[number]
    profile = measured_profile(condition)
    blocks = [profile.values, *(one.profiles[number] for one in (found.before, found.after))] if profile else []
    if profile is not None and min(map(len, blocks)) > 1:
        yield {
            "condition": condition.name,
            "role": condition.role,
            "radius": profile.x,
            **{key: _mean_and_sd(block) for key, block in zip(("measured", "before", "after"), blocks, strict=True)},
        }


def _mean_and_sd(block: npt.NDArray[np.float64]) -> dict[str, Any]:
    return {"mean": block.mean(axis=0), "sd": block.std(axis=0, ddof=1)}


def _confirmed(conditions: Sequence[Condition], found: Confirmed) -> dict[str, Any]:
    return {
        "theta": found.model.theta,
        "effects": found.model.effects,
        "broken": found.broken,
        "conditions": [
            {"condition": condition.name, "pours": len(block), **_mean_and_sd(block)}
            for condition, block in zip(conditions, found.blocks, strict=True)
        ],
    }
