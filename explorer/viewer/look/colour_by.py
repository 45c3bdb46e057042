"""Colours of bodies by what they do: quantities, their range, the bar that explains them, and the controls of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
import viser

from explorer.live.details import Details
from explorer.units import checked
from explorer.viewer.actions import Post, add_keys
from explorer.viewer.look.look import COMPONENT, Look
from explorer.viewer.look.look_settings import LookSettings, one_of
from explorer.viewer.palette import SELECTED, VIRIDIS, css, linear, linear_all, mapped

Array = npt.NDArray[np.float64]

TOP_PERCENTILE = 99.0
"""An automatic range reaches to here: a single fast body must not make all others look the same."""

NICE = (1.0, 2.0, 5.0, 10.0)

COLOUR_KEY, NEXT_COLOUR = "C", "Colour by the next quantity"

LARGEST = 1e6
"""Largest end of a fixed range of colours, in the unit of the screen."""

STEP = 1e-3
"""Step of these ends; viser rounds what a box shows to this, and by itself to whole numbers."""


class Numbered(Protocol):
    """What is known of bodies at a moment: :class:`Details` of a live pour, or the motion of a recorded one."""

    @property
    def number(self) -> int:
        """Another number: another moment."""


@dataclass(frozen=True)
class ColourQuantity:
    """Something that bodies can be coloured by."""

    unit: str
    """On the screen."""
    per_si: float
    """Numbers on the screen per number in SI."""
    read: Callable[[Any], npt.NDArray[Any]]
    """One number in SI per body, out of what is known of them at a moment."""
    meaning: str = ""
    """In a few words, where the name does not say it all."""

    def shown(self, details: Numbered) -> Array:
        """One number per body in the unit of the screen, shape (n,)."""
        return self.per_si * np.asarray(self.read(details), dtype=np.float64)


def _speed(details: Details) -> npt.NDArray[Any]:
    return np.asarray(np.linalg.norm(details.velocity, axis=1))


def _residence(details: Details) -> npt.NDArray[Any]:
    return details.time - details.entered


QUANTITIES: Mapping[str, ColourQuantity] = {
    "speed": ColourQuantity("m/s", 1.0, _speed),
    "contact force": ColourQuantity("mN", 1e3, lambda details: details.load, "sum of the normal forces on a body"),
    "coordination number": ColourQuantity(
        "", 1.0, lambda details: details.neighbours, "other bodies that a body touches"
    ),
    "residence time": ColourQuantity("s", 1.0, _residence, "time since a body entered"),
}
"""Of a live pour."""


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


def body_colours(
    plain: npt.NDArray[np.uint8],
    look: Look,
    quantity: ColourQuantity | None,
    details: Numbered | None,
    selected: int | None,
) -> npt.NDArray[np.uint8]:
    """Colours of the n bodies of a frame for batched meshes, shape (n, 3).

    Args:
        plain: those of their components, shape (n, 3).
        look: the range of the colours.
        quantity: what the colours tell; None: the component.
        details: what is known of the first bodies; those that entered later, and those without a number, stay plain.
        selected: the body under inspection, if any.
    """
    painted = plain.copy()
    if quantity is not None and details is not None:
        values = quantity.shown(details)[: len(painted)]
        low, high = colour_range(look, values)
        known = np.flatnonzero(np.isfinite(values))
        painted[known] = linear_all(mapped((values[known] - low) / (high - low)))
    if selected is not None and selected < len(painted):
        painted[selected] = linear(SELECTED)
    return painted


def bar_html(look: Look, quantity: ColourQuantity | None, details: Numbered | None) -> str:
    """The bar below the choice of colours: the map, its ends, the quantity with its unit."""
    if quantity is None:
        return ""
    values = quantity.shown(details) if details is not None else np.zeros(0)
    low, high = colour_range(look, values)
    stops = ", ".join(css(colour) for colour in VIRIDIS)
    unit = f" [{quantity.unit}]" if quantity.unit else ""
    meaning = f": {quantity.meaning}" if quantity.meaning else ""
    middle = 0.5 * (low + high)
    ends = "".join(f"<span>{number:.4g}</span>" for number in (low, middle, high))
    return (
        "<div style='padding:0.2em 0.9em; font-size:0.82em'>"
        f"<div style='height:0.9em; border-radius:0.2em; background:linear-gradient(to right, {stops})'></div>"
        f"<div style='display:flex; justify-content:space-between'>{ends}</div>"
        f"<div style='opacity:0.75'>{look.colour_by}{unit}{meaning}</div></div>"
    )


class ColourPanel:
    """Changes ``settings``; ``bar`` is where the colours are explained, ``quantities`` what there is to choose from.

    ``note`` says more to the person who chooses.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        bar: viser.GuiHtmlHandle,
        settings: LookSettings,
        quantities: Mapping[str, ColourQuantity],
        post: Post,
        note: str = "",
    ) -> None:
        self._bar, self._settings, self._quantities = bar, settings, quantities
        gui, look, choices = server.gui, settings.look, (COMPONENT, *quantities)
        with gui.add_folder("Colour"):
            hint = f"What the colour of a body says. Key {COLOUR_KEY}: the next one.{' ' if note else ''}{note}"
            self._colour = gui.add_dropdown("Colour by", choices, hint=hint)
            self._automatic = gui.add_checkbox(
                "Automatic range", True, hint="From 0 to a round number near the largest value."
            )
            self._low, self._high = (
                gui.add_number(label, end, min=-LARGEST, max=LARGEST, step=STEP, hint="In the unit of the bar.")
                for label, end in (("From", look.low), ("To", look.high))
            )
        settings.bind(
            self._colour, lambda look: look.colour_by, lambda sent: {"colour_by": one_of(sent, choices, "colour by")}
        )
        settings.bind(
            self._automatic, lambda look: look.automatic, lambda sent: {**self._ends(), "automatic": sent is True}
        )
        settings.listen(self._low, lambda sent: self._fixed(low=checked(sent, -LARGEST, LARGEST, "from")))
        settings.listen(self._high, lambda sent: self._fixed(high=checked(sent, -LARGEST, LARGEST, "to")))
        add_keys(gui, {NEXT_COLOUR: lambda: settings.next("colour_by", choices)}, {NEXT_COLOUR: COLOUR_KEY}, post)

    @property
    def quantity(self) -> ColourQuantity | None:
        """What the colours tell; None: the component."""
        return self._quantities.get(self._settings.look.colour_by)

    def show(self, details: Numbered | None) -> None:
        """Draw the bar; call it inside ``server.atomic()``."""
        look, quantity = self._settings.look, self.quantity
        bar = bar_html(look, quantity, details)
        if self._bar.content != bar:
            self._bar.content, self._bar.visible = bar, bool(bar)
        if look.automatic and quantity is not None and details is not None:
            # The boxes follow, so that a person who fixes the range begins with the one that is on the screen.
            boxes: tuple[Any, ...] = (self._low, self._high)
            for box, end in zip(boxes, colour_range(look, quantity.shown(details)), strict=True):
                if box.value != end:
                    box.value = end

    def _ends(self) -> dict[str, float]:
        low, high = (checked(box.value, -LARGEST, LARGEST, "range") for box in (self._low, self._high))
        return {"low": low, "high": high}

    def _fixed(self, **end: float) -> dict[str, Any]:
        """One end was entered: from now on the range is fixed, at what both boxes say."""
        return {"automatic": False, **self._ends(), **end}
