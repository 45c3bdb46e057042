"""Colours of bodies by what they do: quantities, their range, the bar that explains them, and their controls."""

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
from explorer.viewer.palette import SELECTED, STILL, VIRIDIS, css, linear, linear_all, mapped

Array = npt.NDArray[np.float64]

LOW_PERCENTILE, TOP_PERCENTILE = 2.0, 98.0
"""Ends of an automatic range: a single fast body must not make all others look the same."""

MOST_DECADES = 4.0
"""An automatic logarithmic range spans no more than this."""

MOST_WRITTEN = 3
"""Significant digits of a number beside a bar."""

NICE = (1.0, 2.0, 5.0, 10.0)

RESET = "Reset the range"
COLOUR_KEY, NEXT_COLOUR = "C", "Colour by the next quantity"

LARGEST = 1e6
"""Largest end of a fixed range of colours, in the displayed unit."""

STEP = 1e-3
"""Step of these ends; viser rounds what a box shows to this, and by itself to whole numbers."""


class Numbered(Protocol):
    """What is known of bodies at a moment: :class:`Details` of a live pour, or the motion of a recorded one."""

    @property
    def number(self) -> int:
        """Number of the moment; a different number means a different moment."""


@dataclass(frozen=True)
class ColourQuantity:
    """A quantity by which bodies can be coloured."""

    unit: str
    """On the screen."""
    per_si: float
    """Numbers on the screen per number in SI."""
    read: Callable[[Any], npt.NDArray[Any]]
    """Gives one number in SI per body, from what is known of them at a moment."""
    meaning: str = ""
    """Explanation in a few words, if the name is not enough."""
    least: float = 0.0
    """Least width of an automatic range, in the displayed unit: noise is not to span all colours."""
    still: float = -math.inf
    """Bodies below this, in the displayed unit, are grey."""
    still_words: str = ""
    """What the grey bodies are."""

    def shown(self, details: Numbered) -> Array:
        """One number per body in the displayed unit, shape (n,)."""
        return self.per_si * np.asarray(self.read(details), dtype=np.float64)


STILL_SPEED, STILL_WORDS = 1e-3, "at rest: below 1 mm/s"
"""Speed [m/s] below which a body is grey, and what the key says about it."""


def _speed(details: Details) -> npt.NDArray[Any]:
    return np.asarray(np.linalg.norm(details.velocity, axis=1))


def _residence(details: Details) -> npt.NDArray[Any]:
    return details.time - details.entered


QUANTITIES: Mapping[str, ColourQuantity] = {
    "speed": ColourQuantity("m/s", 1.0, _speed, least=0.01, still=STILL_SPEED, still_words=STILL_WORDS),
    "contact force": ColourQuantity(
        "mN", 1e3, lambda details: details.load, "sum of the normal forces on a body", 0.1, 1e-6, "no contact"
    ),
    "coordination number": ColourQuantity(
        "", 1.0, lambda details: details.neighbours, "other bodies that a body touches", 1.0
    ),
    "residence time": ColourQuantity("s", 1.0, _residence, "time since a body entered", 0.1),
}
"""Of a live pour."""


def colour_range(look: Look, quantity: ColourQuantity, values: Array) -> tuple[float, float]:
    """Ends of the colours in the displayed unit: fixed, or percentiles of ``values``, rounded outward.

    Values of grey bodies do not count. A logarithmic range begins above 0: if its lower end would not, it is
    ``MOST_DECADES`` below the upper one.
    """
    low, high = (look.low, look.high) if not look.automatic else _percentiles(look, quantity, values)
    if look.logarithmic:
        high = high if high > 0.0 else 1.0
        low = low if 0.0 < low < high else high / 10.0**MOST_DECADES
    return low, high


def _percentiles(look: Look, quantity: ColourQuantity, values: Array) -> tuple[float, float]:
    least = max(quantity.still, 0.0 if look.logarithmic else -math.inf)
    told = values[np.isfinite(values) & (values > least)]
    if not len(told):
        return 0.0, quantity.least or 1.0
    low, high = (float(end) for end in np.percentile(told, (LOW_PERCENTILE, TOP_PERCENTILE)))
    if look.logarithmic:
        low = max(low, high / 10.0**MOST_DECADES)
        return _rounded(low, low, math.floor), _rounded(high, high, math.ceil)
    low = min(low, high - max(quantity.least, 1e-6 * abs(high), 1e-12))
    if low < 0.0 <= told.min():
        low, high = 0.0, max(high, quantity.least)
    return _rounded(low, high - low, math.floor), _rounded(high, high - low, math.ceil)


def _rounded(number: float, span: float, way: Callable[[float], int]) -> float:
    """``number`` up or down (``way``) to a digit that is a tenth to a hundredth of ``span``."""
    digit = math.floor(math.log10(span)) - 1
    # A small tolerance: numbers that are already round stay.
    hair = 1e-9 if way is math.floor else -1e-9
    return round(way(number / 10.0**digit + hair) * 10.0**digit, max(0, -digit))


def shares(look: Look, ends: tuple[float, float], values: Array) -> Array:
    """Where ``values`` lie between the ``ends`` of the colours, 0 … 1."""
    low, high = ends
    if look.logarithmic:
        return np.asarray(np.log(np.maximum(values, low) / low) / math.log(high / low), dtype=np.float64)
    return (values - low) / (high - low)


def nice_top(values: Array) -> float:
    """1, 2 or 5 times a power of ten that ``TOP_PERCENTILE`` of ``values`` do not exceed; 1 where all are 0."""
    finite = values[np.isfinite(values)]
    top = float(np.percentile(finite, TOP_PERCENTILE)) if len(finite) else 0.0
    if top <= 0.0:
        return 1.0
    decade = 10.0 ** math.floor(math.log10(top))
    # A small tolerance: 0.5 / 0.1 must not count as more than 5.
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
        plain: colours of their components, shape (n, 3).
        look: the range of the colours.
        quantity: what the colours show; None: the component.
        details: what is known of the first bodies; those that entered later, and those without a number, stay plain.
        selected: the body under inspection, if any.
    """
    painted = plain.copy()
    if quantity is not None and details is not None:
        values = quantity.shown(details)[: len(painted)]
        ends, known = colour_range(look, quantity, values), np.flatnonzero(np.isfinite(values))
        painted[known] = linear_all(mapped(shares(look, ends, values[known])))
        painted[known[values[known] < quantity.still]] = linear(STILL)
    if selected is not None and selected < len(painted):
        painted[selected] = linear(SELECTED)
    return painted


@dataclass(frozen=True)
class ColourKey:
    """What the colours of bodies mean, for the page and for a picture."""

    title: str
    """The quantity with its unit."""
    meaning: str
    numbers: tuple[float, float, float]
    """Numbers at the lower end, middle and upper end of the colours."""
    still: str
    """What grey bodies are; empty if there can be none."""


def colour_key(look: Look, quantity: ColourQuantity, details: Numbered | None) -> ColourKey:
    """The key to the colours of :func:`body_colours`."""
    values = quantity.shown(details) if details is not None else np.zeros(0)
    low, high = colour_range(look, quantity, values)
    middle = math.sqrt(low * high) if look.logarithmic else 0.5 * (low + high)
    unit = f" [{quantity.unit}]" if quantity.unit else ""
    return ColourKey(f"{look.colour_by}{unit}", quantity.meaning, (low, middle, high), quantity.still_words)


def bar_html(look: Look, quantity: ColourQuantity | None, details: Numbered | None) -> str:
    """The bar below the choice of colours: the map, its ends and middle, the quantity with its unit, grey bodies."""
    if quantity is None:
        return ""
    key, stops = colour_key(look, quantity, details), ", ".join(css(colour) for colour in VIRIDIS)
    bar = f"<div style='height:0.9em; border-radius:0.2em; background:linear-gradient(to right, {stops})'></div>"
    swatch = f"<span style='display:inline-block; width:0.8em; height:0.8em; background:{css(STILL)}'></span>"
    words = key.title + (f": {key.meaning}" if key.meaning else "")
    words += " (logarithmic)" if look.logarithmic else ""
    return key_html(bar, key.numbers, words + (f" · {swatch} {key.still}" if key.still else ""))


def key_html(bar: str, numbers: tuple[float, float, float], words: str) -> str:
    """A bar (HTML) with the numbers at its ends and its middle, and what it means in ``words`` (HTML)."""
    ends = "".join(f"<span>{written(number)}</span>" for number in numbers)
    return (
        f"<div style='padding:0.2em 0.9em; font-size:13px'>{bar}"
        f"<div style='display:flex; justify-content:space-between'>{ends}</div><div>{words}</div></div>"
    )


def written(number: float) -> str:
    """A number beside a bar: three digits, and no power of ten below a million."""
    return f"{number:.{MOST_WRITTEN}g}" if not 1e3 <= abs(number) < 1e6 else f"{number:.0f}"


class ColourPanel:
    """Changes ``settings``; ``bar`` is where the colours are explained, ``quantities`` are the choices.

    ``note`` gives the user more information.
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
                "Automatic range",
                True,
                hint=f"Follows the values: from their {LOW_PERCENTILE:g} % to their {TOP_PERCENTILE:g} % percentile.",
            )
            self._logarithmic = gui.add_checkbox(
                "Logarithmic", False, hint="The same ratio of two values is the same step of colour."
            )
            self._low, self._high = (
                gui.add_number(label, end, min=-LARGEST, max=LARGEST, step=STEP, hint="In the unit of the bar.")
                for label, end in (("From", look.low), ("To", look.high))
            )
            self._reset = gui.add_button(RESET, hint="Automatic and linear, as at first.")
        settings.bind(
            self._colour, lambda look: look.colour_by, lambda sent: {"colour_by": one_of(sent, choices, "colour by")}
        )
        settings.bind(
            self._automatic,
            lambda look: look.automatic,
            # Refused ends are still in the boxes; an automatic range needs none.
            lambda sent: {"automatic": True} if sent is True else {**self._ends(), "automatic": False},
        )
        settings.bind(self._logarithmic, lambda look: look.logarithmic, lambda sent: {"logarithmic": sent is True})
        settings.listen(self._low, lambda sent: self._fixed(low=checked(sent, -LARGEST, LARGEST, "from")))
        settings.listen(self._high, lambda sent: self._fixed(high=checked(sent, -LARGEST, LARGEST, "to")))
        self._reset.on_click(lambda _: post(lambda: settings.change(automatic=True, logarithmic=False)))
        add_keys(gui, {NEXT_COLOUR: lambda: settings.next("colour_by", choices)}, {NEXT_COLOUR: COLOUR_KEY}, post)

    @property
    def quantity(self) -> ColourQuantity | None:
        """What the colours show; None: the component."""
        return self._quantities.get(self._settings.look.colour_by)

    def show(self, details: Numbered | None, more: str = "") -> None:
        """Draw the bar, and ``more`` below it; call it inside ``server.atomic()``."""
        look, quantity = self._settings.look, self.quantity
        for box in (self._low, self._high):
            if box.disabled != look.automatic:
                box.disabled = look.automatic
        bar = bar_html(look, quantity, details) + more
        if self._bar.content != bar:
            self._bar.content, self._bar.visible = bar, bool(bar)
        if look.automatic and quantity is not None and details is not None:
            # The boxes follow, so that fixing the range begins with the one on the screen.
            boxes: tuple[Any, ...] = (self._low, self._high)
            for box, end in zip(boxes, colour_range(look, quantity, quantity.shown(details)), strict=True):
                if box.value != end:
                    box.value = end

    def _ends(self) -> dict[str, float]:
        low, high = (checked(box.value, -LARGEST, LARGEST, "range") for box in (self._low, self._high))
        return {"low": low, "high": high}

    def _fixed(self, **end: float) -> dict[str, Any]:
        """One end was entered: from now on the range is fixed to the values in both boxes."""
        return {"automatic": False, **self._ends(), **end}
