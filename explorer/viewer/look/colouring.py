"""Colours of bodies by what they do: quantities, their range, and the bar that explains them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from explorer.live.details import Details
from explorer.live.frames import Frame
from explorer.viewer.look.look import Look
from explorer.viewer.palette import SELECTED, VIRIDIS, css, linear, linear_all, mapped
from explorer.viewer.scene_nodes import component_colour

Array = npt.NDArray[np.float64]

TOP_PERCENTILE = 99.0
"""An automatic range reaches to here: a single fast body must not make all others look the same."""
NICE = (1.0, 2.0, 5.0, 10.0)


@dataclass(frozen=True)
class Quantity:
    """Something that bodies can be coloured by."""

    unit: str
    """On the screen."""
    per_si: float
    """Numbers on the screen per number in SI."""
    read: Callable[[Details], npt.NDArray[Any]]
    """One number in SI per body."""

    def shown(self, details: Details) -> Array:
        """One number per body in the unit of the screen, shape (n,)."""
        return self.per_si * np.asarray(self.read(details), dtype=np.float64)


QUANTITIES: Mapping[str, Quantity] = {
    "speed": Quantity("m/s", 1.0, lambda details: np.linalg.norm(details.velocity, axis=1)),
    "contact force": Quantity("mN", 1e3, lambda details: details.load),
    "coordination number": Quantity("", 1.0, lambda details: details.neighbours),
    "residence time": Quantity("s", 1.0, lambda details: details.time - details.entered),
}
MEANINGS = {
    "contact force": "sum of the normal forces on a body",
    "coordination number": "other bodies that a body touches",
    "residence time": "time since a body entered",
}


def colour_range(look: Look, values: Array) -> tuple[float, float]:
    """Ends of the colours in the unit of the screen: fixed, or from 0 to a round number near the largest value."""
    return (0.0, nice_top(values)) if look.automatic else (look.low, look.high)


def nice_top(values: Array) -> float:
    """1, 2 or 5 times a power of ten that ``TOP_PERCENTILE`` of ``values`` do not exceed; 1 where all are 0."""
    finite = values[np.isfinite(values)]
    top = float(np.percentile(finite, TOP_PERCENTILE)) if len(finite) else 0.0
    if top <= 0.0:
        return 1.0
    decade = 10.0 ** math.floor(math.log10(top))
    # A hair: 0.5 / 0.1 must not count as more than 5.
    return next(nice * decade for nice in NICE if top <= nice * decade * (1.0 + 1e-9))


def body_colours(frame: Frame, details: Details | None, look: Look, selected: int | None) -> npt.NDArray[np.uint8]:
    """Colours of the n bodies of ``frame`` for batched meshes, shape (n, 3).

    Bodies that entered after ``details`` were read keep the colour of their component.
    """
    kinds = int(frame.component.max(initial=-1)) + 1
    colours = np.array([linear(component_colour(k)) for k in range(kinds)], dtype=np.uint8).reshape(-1, 3)
    painted = colours[frame.component]
    quantity = QUANTITIES.get(look.colour_by)
    if quantity is not None and details is not None:
        values = quantity.shown(details)[: len(painted)]
        low, high = colour_range(look, values)
        painted[: len(values)] = linear_all(mapped((values - low) / (high - low)))
    if selected is not None and selected < len(painted):
        painted[selected] = linear(SELECTED)
    return painted


def bar_html(look: Look, details: Details | None) -> str:
    """The bar below the choice of colours: the map, its ends, the quantity with its unit."""
    quantity = QUANTITIES.get(look.colour_by)
    if quantity is None:
        return ""
    values = quantity.shown(details) if details is not None else np.zeros(0)
    low, high = colour_range(look, values)
    stops = ", ".join(css(colour) for colour in VIRIDIS)
    unit = f" [{quantity.unit}]" if quantity.unit else ""
    meaning = f": {MEANINGS[look.colour_by]}" if look.colour_by in MEANINGS else ""
    middle = 0.5 * (low + high)
    ends = "".join(f"<span>{number:.4g}</span>" for number in (low, middle, high))
    return (
        "<div style='padding:0.2em 0.9em; font-size:0.82em'>"
        f"<div style='height:0.9em; border-radius:0.2em; background:linear-gradient(to right, {stops})'></div>"
        f"<div style='display:flex; justify-content:space-between'>{ends}</div>"
        f"<div style='opacity:0.75'>{look.colour_by}{unit}{meaning}</div></div>"
    )
