"""``explorer lab``: derive parameters from the readings of a bench test, and simulate the test."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path

import typer

from explorer.commands.shared_options import AUTHOR, NOTES, report_option


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
    test: Test = typer.Argument(help="Bench test whose readings are evaluated."),
    file: str | None = typer.Argument(
        None,
        metavar="[FILE.csv]",
        help="Readings, one row per replicate or point of a curve: file or name of a shipped example.",
    ),
    compression: str | None = typer.Option(
        None, metavar="FILE.csv", help="With shear: compression readings of the same components, for Poisson's ratio."
    ),
    leave_out: list[str] = typer.Option(
        [], metavar="NAME", help="With composition: component to leave out because it is not poured; repeatable."
    ),
    out: Path | None = typer.Option(
        None,
        metavar="PART.toml",
        help="New file for the parameters and their origin; with --template, FILE.csv for the sheet.",
    ),
    template: bool = typer.Option(
        False,
        "--template",
        help="Print an empty sheet to fill in: columns, units, what to write, number of replicates.",
    ),
    plot: Path | None = typer.Option(
        None,
        metavar="FILE.html",
        help="With compression or shear: new page with the parameters and the curves with their straight part.",
    ),
    report: Path | None = report_option("bench.json", "--report"),
    author: str = AUTHOR,
    notes: str = NOTES,
    simulate: bool = typer.Option(False, "--simulate", help="Simulate the bench test with the derived parameters."),
    material: str | None = typer.Option(
        None, metavar="MATERIAL", help="Material for --simulate: file or shipped name."
    ),
    bias: bool = typer.Option(False, "--bias", help="Show the bias of the test's usual formula."),
    json: bool = typer.Option(False, "--json", help="Print the result as JSON in SI units and nothing else."),
) -> None:
    """Evaluate the readings of a bench test: mean, spread, interval, normality, outliers, material parameters.

    With --simulate the exit code is 1 if a simulated value differs by more than 1 % from the value put in.
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
