"""Controls of how the pour is drawn: colours, force chains, cut, see-through rig. They only make a :class:`Look`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import viser

from explorer.live.details import Details
from explorer.screen_units import InputError, checked
from explorer.viewer.actions import Action, Post
from explorer.viewer.buttons import add_keys
from explorer.viewer.look.colouring import QUANTITIES, bar_html, colour_range
from explorer.viewer.look.force_chains import chain_text
from explorer.viewer.look.look import COMPONENT, CUTS, NOTHING, Look

COLOUR_KEY, CHAINS_KEY, CUT_KEY = "C", "K", "X"
COLOURS = (COMPONENT, *QUANTITIES)
CUT_CHOICES = (NOTHING, *CUTS)
LARGEST = 1e6
"""Largest end of a fixed range of colours, in the unit of the screen."""
MOST_TIMES_MEAN = 5.0
REACH_MM = 200.0
"""The cut can be moved as far as this from the axis and above the plate [mm]."""


class LookPanel:
    """Holds the settings; what they do is up to who reads :attr:`look`. ``bar`` is where the colours are explained."""

    def __init__(self, server: viser.ViserServer, bar: viser.GuiHtmlHandle, post: Post) -> None:
        self.look = Look()
        self._bar, self._post, gui = bar, post, server.gui
        with gui.add_folder("Colour"):
            self._colour = gui.add_dropdown(
                "Colour by", COLOURS, hint=f"What the colour of a body says. Key {COLOUR_KEY}: the next one."
            )
            self._automatic = gui.add_checkbox(
                "Automatic range", True, hint="From 0 to a round number near the largest value."
            )
            self._low = gui.add_number("From", self.look.low, min=-LARGEST, max=LARGEST, hint="In the unit of the bar.")
            self._high = gui.add_number("To", self.look.high, min=-LARGEST, max=LARGEST, hint="In the unit of the bar.")
        with gui.add_folder("Forces"):
            self._chains = gui.add_checkbox(
                "Force chains", False, hint=f"Lines through the contacts that press hardest. Key {CHAINS_KEY}."
            )
            self._threshold = gui.add_slider(
                "From × mean force", 0.0, MOST_TIMES_MEAN, 0.1, 1.0, hint="Weakest contact that is drawn."
            )
            self._chain_text = gui.add_markdown("")
        with gui.add_folder("Cut and rig"):
            self._cut = gui.add_dropdown(
                "Cut away",
                CUT_CHOICES,
                hint=f"Hides the bodies whose centres are on that side of the place. Key {CUT_KEY}: the next one.",
            )
            self._cut_at = gui.add_slider("Place of the cut [mm]", -REACH_MM, REACH_MM, 1.0, 0.0)
            self._opacity = gui.add_slider("Opacity of the rig", 0.0, 1.0, 0.01, self.look.rig_opacity)
            self._shadows = gui.add_checkbox(
                "Shadows", self.look.shadows, hint="Off: nearly twice as quick in a browser without a graphics card."
            )
        self._listen()
        acts: dict[str, Action] = {
            "Colour by the next quantity": lambda: self._next("colour_by", COLOURS),
            "Force chains": lambda: self.change(chains=not self.look.chains),
            "Cut away the next side": lambda: self._next("cut_away", CUT_CHOICES),
        }
        add_keys(gui, acts, dict(zip(acts, (COLOUR_KEY, CHAINS_KEY, CUT_KEY), strict=True)), post)

    def change(self, **settings: Any) -> None:
        """Take over settings of :class:`Look` and show them; raises InputError for a range that is none."""
        look = replace(self.look, **settings)
        if look.high <= look.low:
            raise InputError(f"colour range: its end {look.high:g} is not above its beginning {look.low:g}")
        self.look = look
        shown: tuple[tuple[Any, Any], ...] = (
            (self._colour, look.colour_by),
            (self._automatic, look.automatic),
            (self._chains, look.chains),
            (self._threshold, look.threshold),
            (self._cut, look.cut_away),
            (self._cut_at, 1e3 * look.cut_at),
            (self._opacity, look.rig_opacity),
            (self._shadows, look.shadows),
        )
        for handle, value in shown:
            if handle.value != value:
                handle.value = value

    def show(self, details: Details | None) -> None:
        """Draw the bar and say what the lines mean; call it inside ``server.atomic()``."""
        bar, lines = bar_html(self.look, details), chain_text(details, self.look)
        if self._bar.content != bar:
            self._bar.content, self._bar.visible = bar, bool(bar)
        if self._chain_text.content != lines:
            self._chain_text.content = lines
        quantity = QUANTITIES.get(self.look.colour_by)
        if self.look.automatic and quantity is not None and details is not None:
            # The boxes follow, so that a person who fixes the range begins with the one that is on the screen.
            ends = colour_range(self.look, quantity.shown(details))
            boxes: tuple[Any, ...] = (self._low, self._high)
            for box, end in zip(boxes, ends, strict=True):
                if box.value != end:
                    box.value = end

    def _listen(self) -> None:
        _on(self._colour, self._post, lambda value: self.change(colour_by=_one_of(value, COLOURS, "colour by")))
        _on(self._automatic, self._post, self._set_automatic)
        _on(self._low, self._post, lambda value: self._set_end(low=checked(value, -LARGEST, LARGEST, "from")))
        _on(self._high, self._post, lambda value: self._set_end(high=checked(value, -LARGEST, LARGEST, "to")))
        _on(self._chains, self._post, lambda value: self.change(chains=value is True))
        _on(
            self._threshold,
            self._post,
            lambda value: self.change(threshold=checked(value, 0.0, MOST_TIMES_MEAN, "threshold")),
        )
        _on(self._cut, self._post, lambda value: self.change(cut_away=_one_of(value, CUT_CHOICES, "cut away")))
        _on(
            self._cut_at,
            self._post,
            lambda value: self.change(cut_at=1e-3 * checked(value, -REACH_MM, REACH_MM, "place of the cut")),
        )
        _on(self._opacity, self._post, lambda value: self.change(rig_opacity=checked(value, 0.0, 1.0, "opacity")))
        _on(self._shadows, self._post, lambda value: self.change(shadows=value is True))

    def _set_automatic(self, value: object) -> None:
        low, high = (checked(box.value, -LARGEST, LARGEST, "range") for box in (self._low, self._high))
        self.change(automatic=value is True, low=low, high=high)

    def _set_end(self, **end: float) -> None:
        """One end was entered: from now on the range is fixed, at what both boxes say."""
        low, high = (checked(box.value, -LARGEST, LARGEST, "range") for box in (self._low, self._high))
        self.change(**({"automatic": False, "low": low, "high": high} | end))

    def _next(self, setting: str, choices: tuple[str, ...]) -> None:
        following = (choices.index(getattr(self.look, setting)) + 1) % len(choices)
        self.change(**{setting: choices[following]})


def _one_of(value: object, choices: tuple[str, ...], name: str) -> str:
    """A choice that came from a browser; raises InputError if it is none."""
    for choice in choices:
        if value == choice:
            return choice
    raise InputError(f"{name}: {str(value)[:40]!r} is not one of {', '.join(choices)}")


def _on(handle: Any, post: Post, act: Callable[[object], None]) -> None:
    """Post ``act`` with what a person entered at ``handle``, and not with what this program wrote there."""

    def entered(event: viser.GuiEvent[Any]) -> None:
        if event.client_id is not None:
            value = event.target.value
            post(lambda: act(value))

    handle.on_update(entered)
