"""``explorer shape``: member spheres for a mesh."""

from __future__ import annotations

from pathlib import Path

import typer


def shape(
    file: Path = typer.Argument(metavar="FILE", help="STL, OBJ, PLY or GLB of a closed surface, or several of them."),
    spheres: int | None = typer.Option(None, help="Take this number of spheres."),
    error: str | None = typer.Option(
        None, metavar="LENGTH", help="Take the fewest spheres with at most this RMS distance, such as 0.2mm."
    ),
    density: str | None = typer.Option(
        None, help="Density of the printed and saved mass; by default 1000 kg/m3. In a scene it is the material's."
    ),
    name: str | None = typer.Option(None, help="Name of the body; by default that of the file."),
    unit: str | None = typer.Option(None, help="Unit of the coordinates: m, cm, mm or um; by default mm, in GLB m."),
    out: Path | None = typer.Option(None, metavar="BODY.toml", help="New file that a material file can take in."),
    most: int = typer.Option(64, help="Largest number of spheres in the table."),
    smallest: float = typer.Option(
        0.5, help="Smallest sphere relative to the largest that fits into the mesh; it rules the time step."
    ),
) -> None:
    """Make the member spheres of a mesh.

    Prints how far they are from it by their number, and saves the body.
    """
    from explorer.shape import ShapeOrder, run_shape
    from solver import parse_quantity

    order = ShapeOrder(
        file=file,
        unit=unit,
        density=None if density is None else parse_quantity(density, "kg/m3", "--density"),
        name=name or file.stem,
        out=out,
        number=spheres,
        limit=None if error is None else parse_quantity(error, "m", "--error"),
        most=most,
        smallest=smallest,
    )
    run_shape(order, typer.echo)
