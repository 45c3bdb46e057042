"""Each picture with what was read off it drawn over it, and the simulated pile below, as one image.

White: the outline. Orange: the flank lines. Blue: the base line. All have a dark rim, to be seen on any grey.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont

from explorer.photograph.simulated import SimulatedPiles
from explorer.tables.photograph import angle_text
from solver.observables.repose import flank_feet
from solver.photograph import PhotographedPile, Picture, Refusal

Array = npt.NDArray[np.float64]
Colour = tuple[int, int, int]

WIDTH = 960
MOST_PANELS = 24
MARGIN = 12
TEXT = 18
OUTLINE: Colour = (255, 255, 255)
FLANK: Colour = (230, 159, 0)
BASE: Colour = (86, 180, 233)
RIM: Colour = (20, 24, 28)
GROUND: Colour = (240, 240, 238)


def sheet(
    pictures: Sequence[Picture], readings: Sequence[PhotographedPile | Refusal], simulated: SimulatedPiles | None
) -> Image.Image:
    """All panels, one below the other; at most ``MOST_PANELS`` pictures."""
    panels = [_panel(*pair) for pair in zip(pictures, readings, strict=True)][:MOST_PANELS]
    if simulated is not None:
        piles = [reading for reading in readings if isinstance(reading, PhotographedPile)]
        panels.append(_simulated_panel(simulated, piles[0] if piles else None))
    whole = Image.new("RGB", (WIDTH, sum(panel.height for panel in panels)), GROUND)
    top = 0
    for panel in panels:
        whole.paste(panel, (0, top))
        top += panel.height
    return whole


def _panel(picture: Picture, reading: PhotographedPile | Refusal) -> Image.Image:
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
    return panel


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
