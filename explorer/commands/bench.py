"""``explorer bench``: time the solver and the other engines that are installed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from solver.benchmark import BenchmarkResult

USUAL_DURATION = 4.0
"""Simulated time of the case pour [s]."""


def bench(
    only: list[str] = typer.Option(
        [], metavar="CASE", help="Run only this case: short, pour, bed or batch; repeatable."
    ),
    duration: float = typer.Option(
        USUAL_DURATION, metavar="S", help="Simulated time of the case pour [s].", min=0.2, max=30.0
    ),
    spheres: list[int] = typer.Option(
        [],
        metavar="N",
        help="Spheres in a bed: 1000, 10000, 100000 or 1000000; by default all but the last; repeatable.",
    ),
    rounds: int = typer.Option(
        5,
        metavar="N",
        help="Rounds in which the engines take turns; at most 3 if the first exceeds 60 s.",
        min=1,
        max=99,
    ),
    peers: bool = typer.Option(True, help="Also run LIGGGHTS and YADE where they are installed."),
    peer_limit: float = typer.Option(
        900.0,
        metavar="S",
        help="Wall time after which a run of LIGGGHTS or YADE is stopped and reported as timed out [s].",
        min=1.0,
    ),
    json: Path | None = typer.Option(
        None, "--json", metavar="FILE", help="File for all measurements, rewritten after each."
    ),
    table: Path | None = typer.Option(
        None, metavar="FILE.md", help="File for the table with date and machine, rewritten after each measurement."
    ),
    against: Path | None = typer.Option(
        None,
        metavar="FILE.json",
        help="Warn if a ratio to LIGGGHTS is more than 10 % below that in this earlier --json file.",
    ),
) -> None:
    """Time the solver, LIGGGHTS and YADE on the same cases.

    The engines take turns on one core with the same bodies, time step and simulated time. Leave the machine idle
    otherwise; each peer takes about ten minutes. If the run is interrupted or a case fails, earlier measurements are
    kept and marked as incomplete. A ratio that has fallen causes a warning and does not change the exit code.
    """
    import shutil

    from explorer.benchmark import BEDS, CASES, PEERS, USUAL_BEDS, Options
    from explorer.errors import CommandError
    from explorer.files.output_file import check_folder_of, write_whole
    from explorer.files.run_folder import json_text
    from explorer.terminal.benchmark import fallen, machine, markdown, result_of, table_text

    for name in only:
        if name not in CASES:
            raise CommandError(f"--only: {name!r} is not one of {', '.join(CASES)}")
    for n in spheres:
        if n not in BEDS:
            raise CommandError(f"--spheres: {n} is not one of {', '.join(map(str, BEDS))}")
    if spheres and only and "bed" not in only:
        raise CommandError("--spheres: applies to the case bed, which --only leaves out")
    if duration != USUAL_DURATION and only and "pour" not in only:
        raise CommandError("--duration: applies to the case pour, which --only leaves out")
    for option, path in (("--json", json), ("--table", table)):
        if path:
            check_folder_of(path, option)
    committed = _earlier(against) if against else None
    installed = tuple(name for name in PEERS if peers and shutil.which(name))
    if peers and len(installed) < len(PEERS):
        missing = ", ".join(name for name in PEERS if name not in installed)
        typer.echo(f"not installed, left out: {missing}", err=True)
    beds = tuple(sorted(spheres)) or USUAL_BEDS
    options = Options(duration, beds, installed, rounds=rounds, peer_limit=peer_limit)
    measurements: list[BenchmarkResult] = []
    before = machine()
    words = [*(f"--only {name}" for name in only), *(f"--spheres {n}" for n in spheres)]
    words += [f"--duration {duration:g}"] if duration != USUAL_DURATION else []
    words += [f"--rounds {rounds}"] if rounds != 5 else []

    def keep(complete: bool) -> None:
        found_at = before | {"load_after": machine()["load_after"]}
        if json:
            write_whole(json, json_text(result_of(measurements, complete, found_at)) + "\n")
        if table:
            write_whole(table, markdown(measurements, found_at, complete, words))

    complete = False
    try:
        for name in CASES:
            if name in only or not only:
                for one in CASES[name](options):
                    speed = f"timed out after {one.wall_s:g} s" if one.timed_out else None
                    speed = speed or f"{1e6 / one.steps_per_s:.2f} µs per step"
                    typer.echo(f"{one.case}, {one.engine}: {speed}", err=True)
                    measurements.append(one)
                    keep(complete=False)
        complete = True
        keep(complete)
    finally:
        if measurements:
            typer.echo(table_text(measurements, complete))
    if committed is not None:
        typer.echo("\n".join(fallen(measurements, committed, str(against))))


def _earlier(path: Path) -> dict[str, Any]:
    """Return what --json of an earlier run wrote; raises CommandError for any other file, or one without ratios."""
    import json

    from explorer.errors import CommandError

    try:
        found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        rows = [(row["case"], row["engine"], row["ratio"]) for row in found["measurements"]]
    except (OSError, ValueError, KeyError, TypeError) as problem:
        raise CommandError(f"--against: {path}: not what --json of this command writes ({problem})") from None
    if not any(ratio for _, _, ratio in rows):
        raise CommandError(f"--against: {path}: holds no ratio to LIGGGHTS")
    return found
