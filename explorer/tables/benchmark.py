"""The table that ``explorer bench`` prints and the JSON that it writes."""

from __future__ import annotations

import math
import platform
from collections.abc import Sequence
from typing import Any

from explorer.benchmark import growth
from explorer.files.run_result import package_version
from explorer.tables.text_table import text_table
from solver.benchmark import Measurement

HEADER = (
    "case",
    "engine",
    "bodies",
    "spheres",
    "contacts",
    "µs/step",
    "steps/s",
    "sphere-steps/s",
    "ns/contact",
    "ratio",
)
RATIO_NOTE = "ratio: steps per second over LIGGGHTS's in the same run (over one worker's for the batch)"


def table_text(measurements: Sequence[Measurement], complete: bool = True) -> str:
    """All measurements, and how the cost of a bed grows; says so where some are missing."""
    lines = [text_table(HEADER, [_row(one, _ratio(one, measurements)) for one in measurements]), RATIO_NOTE]
    rest = [one for one in measurements if one.case == "pour to rest"]
    peers = [one for one in measurements if one.engine.startswith("liggghts") and one.case.startswith("pour")]
    for one in rest:
        lines.append(f"whole pour to rest: {one.simulated_s:.2f} s simulated in {one.wall_s:.2f} s")
        lines += [
            f"  {peer.engine} for {peer.simulated_s:.2f} s simulated: {peer.wall_s:.2f} s, "
            f"{peer.wall_s / one.wall_s:.1f} times as long"
            for peer in peers
        ]
    exponent = growth(list(measurements))
    if not math.isnan(exponent):
        lines.append(f"beds: wall time per step grows as (number of spheres)^{exponent:.3f}")
    if not complete:
        lines.append(f"incomplete: the run was stopped; measured so far: {len(measurements)}")
    return "\n".join(lines)


def result_of(measurements: Sequence[Measurement], complete: bool = True) -> dict[str, Any]:
    """The same as plain data, with the machine and the versions."""
    return {
        "format": 1,
        "complete": complete,
        "version": package_version("repose-explorer"),
        "machine": {
            "processor": platform.machine(),
            "system": platform.platform(),
            "python": platform.python_version(),
        },
        "measurements": [
            {
                "case": one.case,
                "engine": one.engine,
                "bodies": one.bodies,
                "spheres": one.spheres,
                "steps": one.steps,
                "wall_s": one.wall_s,
                "simulated_s": one.simulated_s,
                "contacts": _finite(one.contacts),
                "mean_contacts": _finite(one.mean_contacts),
                "steps_per_s": one.steps_per_s,
                "sphere_steps_per_s": one.sphere_steps_per_s,
                "ns_per_contact": _finite(one.ns_per_contact),
                "ratio": _finite(_ratio(one, measurements)),
            }
            for one in measurements
        ],
        "growth_exponent": _finite(growth(list(measurements))),
    }


def _ratio(one: Measurement, measurements: Sequence[Measurement]) -> float:
    """Steps per second over those of LIGGGHTS on the same case, or of one worker on the same batch."""
    for other in measurements:
        if other.case == one.case and (other.engine.startswith("liggghts") or other.engine.endswith("1 worker")):
            return one.steps_per_s / other.steps_per_s
    return math.nan


def _row(one: Measurement, ratio: float) -> tuple[str, ...]:
    return (
        one.case,
        one.engine,
        str(one.bodies),
        str(one.spheres),
        _number(one.contacts, ".0f"),
        f"{1e6 / one.steps_per_s:.2f}",
        f"{one.steps_per_s:.0f}",
        f"{one.sphere_steps_per_s:.3g}",
        _number(one.ns_per_contact, ".0f"),
        _number(ratio, ".2f"),
    )


def _number(value: float, form: str) -> str:
    return "-" if math.isnan(value) else format(value, form)


def _finite(value: float) -> float | None:
    return None if math.isnan(value) else value
