"""Controls of the colours: by which quantity, in which range; and the bar that explains them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import viser

from explorer.screen_units import checked
from explorer.viewer.actions import Post
from explorer.viewer.buttons import add_keys
from explorer.viewer.look.colouring import Numbered, Quantity, bar_html, colour_range
from explorer.viewer.look.look import COMPONENT
from explorer.viewer.look.look_settings import LookSettings, one_of

COLOUR_KEY, NEXT_COLOUR = "C", "Colour by the next quantity"
LARGEST = 1e6
"""Largest end of a fixed range of colours, in the unit of the screen."""
STEP = 1e-3
"""Of its ends; viser rounds what a box shows to this, and by itself to whole numbers."""


class ColourPanel:
    """Changes ``settings``; ``bar`` is where the colours are explained, ``quantities`` what there is to choose from.

    ``note`` says more to the person who chooses.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        bar: viser.GuiHtmlHandle,
        settings: LookSettings,
        quantities: Mapping[str, Quantity],
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
    def quantity(self) -> Quantity | None:
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
