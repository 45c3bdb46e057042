"""``explorer shape``: fit member spheres to a mesh."""

from __future__ import annotations

import re
from pathlib import Path

import typer


def shape(
    file: Path = typer.Argument(metavar="FILE", help="STL, OBJ, PLY or GLB file of one or more closed surfaces."),
    spheres: int | None = typer.Option(None, metavar="N", help="Use this number of spheres."),
    error: str | None = typer.Option(
        None,
        metavar="LENGTH",
        help="Use the fewest spheres with at most this RMS distance from the mesh, such as 0.2mm.",
    ),
    density: str | None = typer.Option(
        None,
        metavar="DENSITY",
        help="Density for the printed and saved mass; by default 1000 kg/m3. A scene uses the density of its material.",
    ),
    name: str | None = typer.Option(None, metavar="NAME", help="Name of the body; by default that of the file."),
    unit: str | None = typer.Option(
        None, metavar="UNIT", help="Unit of the coordinates: m, cm, mm or um; by default mm, for GLB m."
    ),
    out: Path | None = typer.Option(
        None, metavar="BODY.toml", help="New file for the body, which a material file can use."
    ),
    most: int = typer.Option(64, metavar="N", help="Largest number of spheres in the table."),
    smallest: float = typer.Option(
        0.5,
        help="Radius of the smallest sphere over that of the largest that fits into the mesh (0.1 … 1); it limits the "
        "time step.",
    ),
) -> None:
    """Fit the member spheres of a body to a mesh.

    Prints their distance from the mesh for each number of spheres and, with --out, saves the body. Without --spheres
    and --error the number is chosen as for spheres = "standard" in a material file.
    """
    from explorer.shape import ShapeOrder, run_shape
    from solver import parse_quantity

    order = ShapeOrder(
        file=file,
        unit=unit,
        density=None if density is None else parse_quantity(density, "kg/m3", "--density"),
        name=name or re.sub(r"[\s.\"\\]+", "_", file.stem),
        out=out,
        number=spheres,
        limit=None if error is None else parse_quantity(error, "m", "--error"),
        most=most,
        smallest=smallest,
    )
    run_shape(order, typer.echo)
