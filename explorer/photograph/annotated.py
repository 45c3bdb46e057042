"""Each picture with what was read off it drawn over it, and the simulated pile below, as one image.

White: the outline. Orange: the flank lines. Blue: the base line. Green, where asked for: the lines of the lower, middle
and upper third of each flank. All have a dark rim, to be seen on any grey.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont

from explorer.photograph.result import MeasuredPhotographs
from explorer.photograph.simulated import SimulatedPiles
from explorer.terminal.photograph import angle_text
from solver.observables.repose import flank_feet
from solver.photograph import PhotographedPile, Picture, Refusal
from solver.photograph.reading_error import THIRDS

Array = npt.NDArray[np.float64]
Colour = tuple[int, int, int]

WIDTH = 960
MOST_PANELS = 24
"""Largest number of pictures on a sheet."""
MARGIN = 12
TEXT = 18
OUTLINE: Colour = (255, 255, 255)
FLANK: Colour = (230, 159, 0)
BASE: Colour = (86, 180, 233)
THIRD: Colour = (0, 200, 140)
RIM: Colour = (20, 24, 28)
GROUND: Colour = (240, 240, 238)
LEVEL_DEG = 1.0
"""Slope of a third below which its line is as good as level, and not drawn."""


def sheet(
    pictures: Iterable[tuple[Picture, PhotographedPile | Refusal]],
    measured: MeasuredPhotographs,
    thirds: bool = False,
) -> Image.Image:
    """All panels, one below the other: ``pictures``, each with its reading, and a simulated pile that was ``measured``.

    ``thirds``: with the lines of the thirds.
    """
    panels = [_panel(*pair, thirds) for pair in pictures]
    simulated = measured.simulated
    if simulated is not None:
        panels.append(_simulated_panel(simulated, measured.piles[0] if measured.piles else None))
    whole = Image.new("RGB", (WIDTH, sum(panel.height for panel in panels)), GROUND)
    top = 0
    for panel in panels:
        whole.paste(panel, (0, top))
        top += panel.height
    return whole


def _panel(picture: Picture, reading: PhotographedPile | Refusal, thirds: bool) -> Image.Image:
    grey = Image.fromarray(np.clip(picture.grey, 0, 255).astype(np.uint8))
    size = (WIDTH, max(1, round(WIDTH * picture.height / picture.width)))
    head = 2 * TEXT + 2 * MARGIN
    panel = Image.new("RGB", (WIDTH, size[1] + head), GROUND)
    panel.paste(grey.resize(size, Image.Resampling.LANCZOS).convert("RGB"), (0, head))
    draw = ImageDraw.Draw(panel)
    if isinstance(reading, Refusal):
        _write(draw, picture.name, f"no angle: {reading.reason}")
        return panel
    angles = reading.angles
    flanks = ", ".join(f"{name} {angle_text(getattr(angles, name))}°" for name in ("left", "right", "mean"))
    _write(draw, picture.name, f"{flanks} (±: 95 %)")
    zoom = WIDTH / picture.width

    def place(u: Array, z: Array) -> Array:
        x, y = reading.in_picture(u, z)
        return np.stack([(x + 0.5) * zoom, (y + 0.5) * zoom + head], axis=1)

    x = np.linspace(0.0, picture.width - 1.0, 33)
    x, y = reading.as_seen(x, reading.base.at(x))
    _line(draw, np.stack([(x + 0.5) * zoom, (y + 0.5) * zoom + head], axis=1), BASE, 2)
    _line(draw, place(reading.outline.u, reading.outline.top), OUTLINE, 1)
    for flank in reading.flanks:
        _line(draw, place(np.array(flank.u), np.array(flank.z)), FLANK, 4)
    for u, z in _thirds(reading) if thirds else ():
        _line(draw, place(u, z), THIRD, 2)
    return panel


def _thirds(reading: PhotographedPile) -> Iterator[tuple[Array, Array]]:
    """u, z of a line of each third of a flank: of its own slope, through the middle of the outline there."""
    u, z = reading.outline.u, reading.outline.top
    for side, angle in ((-1.0, reading.angles.left), (1.0, reading.angles.right)):
        for (low, high), slope_deg in zip(pairwise(THIRDS), angle.thirds_deg, strict=True):
            ends = reading.height * np.array([low, high])
            there = (side * u > 0.0) & (z >= ends[0]) & (z <= ends[1])
            ends = ends + np.array([0.1, -0.1]) * np.ptp(ends)  # gaps, so that three lines are seen
            if there.sum() > 1 and abs(slope_deg) > LEVEL_DEG:
                run = (ends - z[there].mean()) / np.tan(np.radians(slope_deg))
                yield u[there].mean() - side * run, ends


def _simulated_panel(simulated: SimulatedPiles, beside: PhotographedPile | None) -> Image.Image:
    """The first view of the first pile, on the scale of ``beside`` in metres or else as wide as the panel."""
    front = simulated.front
    left, right = front.flanks
    assert left is not None
    assert right is not None
    widest = float(max(front.u[-1], -front.u[0], *map(abs, flank_feet((left, right)))))
    if beside is not None and beside.unit == "m":
        widest = max(widest, float(np.abs(beside.outline.u).max()))
    zoom = (WIDTH / 2 - 4 * MARGIN) / widest
    high = max(float(front.top.max()), beside.height if beside is not None and beside.unit == "m" else 0.0)
    head = 2 * TEXT + 2 * MARGIN
    foot = head + round(high * zoom) + 2 * MARGIN
    panel = Image.new("RGB", (WIDTH, foot + 2 * MARGIN), GROUND)
    draw = ImageDraw.Draw(panel)
    both = np.concatenate([simulated.left_deg, simulated.right_deg])
    _write(
        draw,
        f"simulated: {simulated.source}",
        f"mean {both.mean():.2f}°, SD over {both.size} flanks {both.std(ddof=1):.2f}°"
        + ("; blue: the photographed outline" if beside is not None and beside.unit == "m" else ""),
    )

    def place(u: Array, z: Array) -> Array:
        return np.stack([WIDTH / 2 + zoom * u, foot - zoom * z], axis=1)

    _line(draw, np.array([[0.0, foot], [WIDTH, foot]]), RIM, 1)
    _line(draw, place(front.u, front.top), OUTLINE, 1)
    if beside is not None and beside.unit == "m":
        _line(draw, place(beside.outline.u, beside.outline.top), BASE, 1)
    for flank in (left, right):
        _line(draw, place(np.array(flank.u), np.array(flank.z)), FLANK, 4)
    return panel


def _line(draw: ImageDraw.ImageDraw, points: Array, colour: Colour, width: int) -> None:
    corners = [(float(x), float(y)) for x, y in points]
    draw.line(corners, fill=RIM, width=width + 2)
    draw.line(corners, fill=colour, width=width)


def _write(draw: ImageDraw.ImageDraw, head: str, text: str) -> None:
    font = ImageFont.load_default(size=TEXT)
    for k, line in enumerate((head, text)):
        draw.text((MARGIN, MARGIN // 2 + k * (TEXT + MARGIN // 2)), line[:110], fill=RIM, font=font)
