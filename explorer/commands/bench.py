"""``explorer bench``: how fast the solver is, beside the engines that are installed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from solver.benchmark import Measurement


def bench(
    only: list[str] = typer.Option([], metavar="CASE", help="Only this case: pour, bed or batch; may be repeated."),
    duration: float = typer.Option(4.0, metavar="S", help="Simulated time of the pour [s].", min=0.2, max=30.0),
    spheres: list[int] = typer.Option([], metavar="N", help="Beds to run: 1000, 10000, 100000; may be repeated."),
    peers: bool = typer.Option(True, help="Run LIGGGHTS and YADE too, where they are installed."),
    json: Path | None = typer.Option(
        None, "--json", metavar="FILE", help="Write every measurement to this file, each as soon as it is made."
    ),
) -> None:
    """Time the solver, and LIGGGHTS and YADE on the same cases.

    One core, the same bodies, time step and simulated time. Leave the machine alone meanwhile; with both peers it
    takes about ten minutes. Where it is interrupted or a case fails, what was measured before is kept and marked
    as incomplete.
    """
    import shutil

    from explorer.benchmark import BEDS, CASES, PEERS, Options
    from explorer.errors import CommandError
    from explorer.files.run_folder import json_text
    from explorer.files.whole_file import write_whole
    from explorer.tables.benchmark import result_of, table_text

    for name in only:
        if name not in CASES:
            raise CommandError(f"--only: {name!r} is not one of {', '.join(CASES)}")
    for n in spheres:
        if n not in BEDS:
            raise CommandError(f"--spheres: {n} is not one of {', '.join(map(str, BEDS))}")
    if json and not json.absolute().parent.is_dir():
        raise CommandError(f"--json: {json}: no folder {json.absolute().parent}")
    installed = tuple(name for name in PEERS if peers and shutil.which(name))
    if peers and len(installed) < len(PEERS):
        missing = ", ".join(name for name in PEERS if name not in installed)
        typer.echo(f"not installed, left out: {missing}", err=True)
    options = Options(duration, tuple(sorted(spheres)) or tuple(BEDS), installed)
    measurements: list[Measurement] = []

    def keep(complete: bool) -> None:
        if json:
            write_whole(json, json_text(result_of(measurements, complete)) + "\n")

    complete = False
    try:
        for name in CASES:
            if name in only or not only:
                for one in CASES[name](options):
                    typer.echo(f"{one.case}, {one.engine}: {1e6 / one.steps_per_s:.2f} µs per step", err=True)
                    measurements.append(one)
                    keep(complete=False)
        complete = True
        keep(complete)
    finally:
        if measurements:
            typer.echo(table_text(measurements, complete))
