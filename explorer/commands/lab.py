"""``explorer lab``: a laboratory's readings become parameters, and its bench is repeated on the solver."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path

import typer


class Test(StrEnum):
    """Bench tests whose readings can be evaluated."""

    COMPRESSION = "compression"
    SHEAR = "shear"
    INCLINED_PLANE = "inclined_plane"
    DROP = "drop"
    REBOUND = "rebound"
    ROLLING = "rolling"
    MOISTURE = "moisture"
    DENSITY = "density"
    COMPOSITION = "composition"
    DIMENSIONS = "dimensions"
    SIEVE = "sieve"
    BULK_DENSITY = "bulk_density"
    DRUM = "drum"
    DRAW_DOWN = "draw_down"


def lab(
    test: Test = typer.Argument(help="What was measured."),
    file: str | None = typer.Argument(
        None,
        metavar="[FILE.csv]",
        help="The readings, one row per replicate or point of a curve; or a shipped example.",
    ),
    compression: str | None = typer.Option(
        None, metavar="FILE.csv", help="With shear: compression tests of the same components, for Poisson's ratio."
    ),
    leave_out: list[str] = typer.Option([], metavar="NAME", help="With composition: a component that is not poured."),
    out: Path | None = typer.Option(
        None, metavar="PART.toml", help="New file with the parameters and their origin; with --template FILE.csv."
    ),
    template: bool = typer.Option(
        False, "--template", help="Print a sheet to fill in: columns, units, what to write, how many replicates."
    ),
    plot: Path | None = typer.Option(
        None, metavar="FILE.html", help="New page: parameters, and the curves with their straight part."
    ),
    report: Path | None = typer.Option(
        None, metavar="DIR", help="New folder for the report of any test, its figures and data."
    ),
    author: str = typer.Option("", metavar="NAME", help="Who made it, for the report."),
    notes: str = typer.Option("", metavar="TEXT", help="Notes for the report."),
    simulate: bool = typer.Option(False, "--simulate", help="Run the bench test on the solver with what was derived."),
    material: str | None = typer.Option(None, help="Material of --simulate: file or shipped name."),
    bias: bool = typer.Option(False, "--bias", help="Show where the test's usual formula misses what was put in."),
    json: bool = typer.Option(False, "--json", help="Print the result as JSON, SI, and nothing else."),
) -> None:
    """Evaluate the readings of a bench test: mean, spread, interval, normality, outliers, parameters of a material.

    With --simulate the exit code is 1 where what comes out is not within 1 % of what was put in.
    """
    from explorer.laboratory.run import LabOrder, run_lab

    order = LabOrder(
        test=test.value,
        file=file,
        compression=compression,
        left_out=tuple(leave_out),
        out=out,
        figure=plot,
        material=material,
        simulate=simulate,
        bias=bias,
        template=template,
        json=json,
        report=report,
        author=author,
        notes=notes,
    )
    if not run_lab(order, typer.echo):
        raise typer.Exit(1)
