"""`explorer measure`: read the pictures, find their scale, put a simulation beside them, write what was asked for."""

from __future__ import annotations

import io
from math import dist

from explorer.files.output_file import write_whole, write_whole_bytes
from explorer.photograph.annotated import sheet
from explorer.photograph.order import Measured, MeasureOrder
from explorer.photograph.simulated import simulated_piles
from solver.photograph import (
    NotAPile,
    PhotographedPile,
    Picture,
    Refusal,
    open_picture,
    read_photograph,
    reference_pixels,
)


def run_measure(order: MeasureOrder) -> Measured:
    """Every picture is opened before the first is measured, so that a bad file ends the command at once.

    Raises PhotographError for a file that is no picture, and whatever the simulated source raises.
    """
    pictures = [open_picture(path) for path in order.pictures]
    measured = Measured(
        tuple(_reading(picture, order) for picture in pictures),
        None if order.simulation is None else simulated_piles(order.simulation),
    )
    if order.plot is not None:
        file = io.BytesIO()
        sheet(pictures, measured.readings, measured.simulated).save(file, "PNG")
        write_whole_bytes(order.plot, file.getvalue())
    if order.outline is not None and measured.piles:
        write_whole(order.outline, outline_text(measured.piles[0]))
    return measured


def outline_text(pile: PhotographedPile) -> str:
    """A measured outline as the page lays it over a simulated pile (`explorer/files/measured_curves.py`)."""
    rows = (f"{u:.6g},{z:.6g}\n" for u, z in zip(pile.outline.u, pile.outline.top, strict=True))
    return f"# {' '.join(pile.name.split())}\nu_m,z_m\n" + "".join(rows)


def _reading(picture: Picture, order: MeasureOrder) -> PhotographedPile | Refusal:
    try:
        scale = _metres_per_pixel(picture, order)
    except NotAPile as reason:
        return Refusal(picture.name, reason.reason, reason.detail)
    return read_photograph(picture, scale, order.base_line)


def _metres_per_pixel(picture: Picture, order: MeasureOrder) -> float | None:
    if order.reference_length is None:
        return order.metres_per_pixel
    ends = order.reference_ends
    return order.reference_length / (dist(ends[:2], ends[2:]) if ends else reference_pixels(picture))
