"""What ``explorer bench`` prints, the table that it writes for ``docs/``, and the JSON that says what a ratio was."""

from __future__ import annotations

import datetime
import math
import os
import platform
import statistics
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from explorer.benchmark import FEW, LONG, TO_REST, Result, growth, results
from explorer.files.run_result import package_version
from explorer.terminal.text_table import text_table
from solver.benchmark import BenchmarkResult

HEADER = (
    "case",
    "engine",
    "bodies",
    "spheres",
    "contacts",
    "rounds",
    "µs/step",
    "steps/s",
    "sphere-steps/s",
    "ns/contact",
    "ratio",
)
RATIO_NOTE = (
    "ratio: steps per second over LIGGGHTS's in the same round (over one worker's for the batch), median of the rounds"
)
ASKED = {
    (TO_REST, "ours"): 22.0,
    ("pour, 4 s", "ours, nothing sleeps"): 7.0,
    ("bed of 10000 spheres", "ours, nothing sleeps"): 1.6,
    ("bed of 100000 spheres", "ours, nothing sleeps"): 1.6,
}
"""Ratios to LIGGGHTS that the solver is to reach."""
FALL = 0.10
"""Share of a committed ratio whose loss is worth a warning."""


def table_text(measurements: Sequence[BenchmarkResult], complete: bool = True) -> str:
    """All measurements, and how the cost of a bed grows; says so where some are missing."""
    found = results(measurements)
    lines = [text_table(HEADER, [_row(one, _ratios(one, found)) for one in found]), RATIO_NOTE]
    rest = [one.median for one in found if one.median.case == TO_REST]
    peers = [one.median for one in found if _liggghts(one) and one.median.case.startswith("pour")]
    for one in rest:
        lines.append(f"whole pour to rest: {one.simulated_s:.2f} s simulated in {one.wall_s:.2f} s")
        lines += [
            f"  {peer.engine} for {peer.simulated_s:.2f} s simulated: {peer.wall_s:.2f} s, "
            f"{peer.wall_s / one.wall_s:.1f} times as long"
            for peer in peers
            if not peer.timed_out
        ]
    lines += _growth_lines(measurements)
    if not complete:
        lines.append(f"incomplete: the run was stopped; measured so far: {len(measurements)}")
    return "\n".join(lines)


def markdown(
    measurements: Sequence[BenchmarkResult], found_at: Mapping[str, Any], complete: bool, words: Sequence[str]
) -> str:
    """The same as a page for ``docs/``.

    Parameters
    ----------
    measurements
        What was measured, round by round.
    found_at
        :func:`machine`'s answer.
    complete
        Whether all cases ran to their ends.
    words
        Options of ``explorer bench`` that choose these cases.

    Returns
    -------
    Markdown: date, machine, versions and load; one row per case and engine, with the range of its rounds.
    """
    found = results(measurements)
    head = ("case", "engine", "rounds", "µs/step (range)", "ratio to LIGGGHTS (range)", "asked")
    rows = [head, tuple("---" for _ in head), *(_markdown_row(one, _ratios(one, found)) for one in found)]
    versions = [f"{name} {version}" for name, version in found_at["versions"].items()]
    command, stopped = " ".join(("explorer bench", *words)), "" if complete else ", stopped before its end"
    load = f"{found_at['load_before']:.1f}, after it {found_at['load_after']:.1f}"
    return "\n".join(
        [
            "# Speed beside other engines",
            "",
            f"`{command}`, {found_at['date']}{stopped}.",
            "One core each; the engines take turns in one run, and a ratio is taken within a round. A case whose",
            f"first round takes longer than {LONG:g} s has {FEW} rounds at most. Beds are numbered at random for",
            "all engines; LIGGGHTS sorts its atoms itself.",
            "",
            f"- Machine: {found_at['cpu']}, {found_at['cores']} cores, {found_at['system']}.",
            f"- Load average before the run {load}; above 1.1, other programs ran beside it.",
            f"- Versions: {', '.join([*versions, *_peer_names(found)])}.",
            "",
            *(f"| {' | '.join(row)} |" for row in rows),
            "",
            *(f"- {line}" for line in _growth_lines(measurements)),
            "",
        ]
    )


def result_of(
    measurements: Sequence[BenchmarkResult], complete: bool = True, found_at: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """The same as plain data, medians of the rounds with the wall time of each, with the machine and the versions."""
    found = results(measurements)
    return {
        "format": 1,
        "complete": complete,
        "version": package_version("repose-explorer"),
        "machine": dict(found_at) if found_at else machine(),
        "measurements": [_record(one, _ratios(one, found)) for one in found],
        "growth_exponent": _finite(growth(measurements)),
    }


def fallen(measurements: Sequence[BenchmarkResult], committed: Mapping[str, Any], name: str) -> list[str]:
    """Lines about ratios to LIGGGHTS that are lower than those of an earlier run by more than a tenth.

    Parameters
    ----------
    measurements
        Of this run.
    committed
        What :func:`result_of` gave for the earlier run.
    name
        What the earlier run is called, its file.

    Returns
    -------
    One warning per case of ours; or one line that says how many were compared and none has fallen.
    """
    before = {(row["case"], row["engine"]): row["ratio"] for row in committed["measurements"]}
    found, lines, compared = results(measurements), [], 0
    for one in found:
        ratios, key = _ratios(one, found), (one.median.case, one.median.engine)
        if not one.median.engine.startswith("ours") or not ratios or before.get(key) is None:
            continue
        compared += 1
        ratio = statistics.median(ratios)
        if ratio < (1.0 - FALL) * before[key]:
            loss = 100.0 * (1.0 - ratio / before[key])
            lines.append(
                f"warning: {key[0]}, {key[1]}: {ratio:.2f} times as fast as LIGGGHTS, {loss:.0f} % less than the "
                f"{before[key]:.2f} of {name}"
            )
    if not compared:
        return [f"warning: no ratio to LIGGGHTS could be compared with {name}: LIGGGHTS or the case is missing"]
    return lines or [f"{compared} ratios to LIGGGHTS compared with {name}: none is more than {100 * FALL:.0f} % lower"]


def machine() -> dict[str, Any]:
    """Date, processor, cores, system, versions, and the load average at this moment (before and after alike)."""
    load = os.getloadavg()[0]
    return {
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "cpu": _cpu(),
        "cores": os.cpu_count(),
        "processor": platform.machine(),
        "system": platform.system(),
        "python": platform.python_version(),
        "versions": {
            "repose-explorer": package_version("repose-explorer"),
            "Taichi": package_version("taichi"),
            "NumPy": package_version("numpy"),
            "Python": platform.python_version(),
        },
        "load_before": load,
        "load_after": load,
    }


def _cpu() -> str:
    """Model of the processor as Linux names it, or its architecture."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()


def _liggghts(one: Result) -> bool:
    return one.median.engine.startswith("liggghts")


def _peer_names(found: Sequence[Result]) -> list[str]:
    """Engines with their versions, each once."""
    names = [one.median.engine for one in found if not one.median.engine.startswith(("ours", "32"))]
    return list(dict.fromkeys(name.partition(" ")[2] or name for name in names))


def _ratios(one: Result, found: Sequence[Result]) -> list[float]:
    """Rounds' ratios to LIGGGHTS on the same case (the pour to rest: on the pour), or to one worker on the batch."""
    case = one.median.case
    for other in found:
        same = other.median.case == case or (case == TO_REST and other.median.case.startswith("pour, "))
        if same and (_liggghts(other) or other.median.engine.endswith("1 worker")):
            return one.ratios(other)
    return []


def _growth_lines(measurements: Sequence[BenchmarkResult]) -> list[str]:
    exponents = {engine: growth(measurements, engine) for engine in ("ours", "liggghts", "yade")}
    known = {engine: value for engine, value in exponents.items() if not math.isnan(value)}
    return [
        f"beds: wall time per step grows as (number of spheres)^{value:.3f}"
        + ("" if engine == "ours" else f" ({engine})")
        for engine, value in known.items()
    ]


def _row(result: Result, ratios: Sequence[float]) -> tuple[str, ...]:
    one = result.median
    speed = (
        (f"timed out after {one.wall_s:g} s", "-", "-")
        if one.timed_out
        else (f"{1e6 / one.steps_per_s:.2f}", f"{one.steps_per_s:.0f}", f"{one.sphere_steps_per_s:.3g}")
    )
    return (
        one.case,
        one.engine,
        str(one.bodies),
        str(one.spheres),
        _number(one.contacts, ".0f"),
        str(len(result.rounds)),
        *speed,
        _number(one.ns_per_contact, ".0f"),
        f"{statistics.median(ratios):.2f}" if ratios else "-",
    )


def _markdown_row(result: Result, ratios: Sequence[float]) -> tuple[str, ...]:
    one = result.median
    times = [1e6 / each.steps_per_s for each in result.rounds]
    asked = ASKED.get((one.case, one.engine))
    return (
        one.case,
        one.engine,
        str(len(result.rounds)),
        f"timed out after {one.wall_s:g} s"
        if one.timed_out
        else _range(times, ".4g" if max(times) < 1000.0 else ".0f"),
        "1" if _liggghts(result) else _range(ratios, ".2f") if ratios else "–",
        f"{asked:g}" if asked else "",
    )


def _range(values: Sequence[float], form: str) -> str:
    """Median, and where there are several the least and the largest."""
    middle = format(statistics.median(values), form)
    return f"{middle} ({min(values):{form}}–{max(values):{form}})" if len(values) > 1 else middle


def _record(result: Result, ratios: Sequence[float]) -> dict[str, Any]:
    one = result.median
    return {
        "case": one.case,
        "engine": one.engine,
        "bodies": one.bodies,
        "spheres": one.spheres,
        "steps": one.steps,
        "timed_out": one.timed_out,
        "wall_s": one.wall_s,
        "rounds_wall_s": [each.wall_s for each in result.rounds],
        "simulated_s": one.simulated_s,
        "contacts": _finite(one.contacts),
        "mean_contacts": _finite(one.mean_contacts),
        "steps_per_s": _finite(one.steps_per_s),
        "sphere_steps_per_s": _finite(one.sphere_steps_per_s),
        "ns_per_contact": _finite(one.ns_per_contact),
        "ratio": statistics.median(ratios) if ratios else None,
        "rounds_ratio": list(ratios),
    }


def _number(value: float, form: str) -> str:
    return "-" if math.isnan(value) else format(value, form)


def _finite(value: float) -> float | None:
    return None if math.isnan(value) else value
