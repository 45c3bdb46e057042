"""The settings of how things are drawn: handles on the page show a :class:`Look` and change it.

Settings for what is in the way are here too: bodies that are cut away, a transparent rig, shadows.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import viser

from explorer.units import InputError, checked
from explorer.viewer.actions import Post, add_keys
from explorer.viewer.look.look import CUTS, NOTHING, Look

Take = Callable[[object], Mapping[str, Any]]
"""Turns what a browser sent into settings of :class:`Look`; raises InputError if it is not allowed."""

CUT_KEY, NEXT_CUT = "X", "Cut away the next side"
CUT_CHOICES = (NOTHING, *CUTS)
REACH_MM = 200.0
"""Largest distance of the cut from the axis and above the plate [mm]."""


class LookSettings:
    """Holds the settings; readers of :attr:`look` apply them."""

    def __init__(self, post: Post) -> None:
        self.look, self._post = Look(), post
        self._shown: list[tuple[Any, Callable[[Look], Any]]] = []

    def bind(self, handle: Any, shown: Callable[[Look], Any], take: Take) -> None:
        """Let ``handle`` always show ``shown`` of the look, and apply what the user enters there."""
        self._shown.append((handle, shown))
        self.listen(handle, take)

    def listen(self, handle: Any, take: Take) -> None:
        """Apply what the user enters at ``handle``, but not what this program writes there."""

        def entered(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                value = event.target.value
                self._post(lambda: self.change(**take(value)))

        handle.on_update(entered)

    def change(self, **settings: Any) -> None:
        """Apply settings of :class:`Look` and show them; raises InputError for an invalid range."""
        look = replace(self.look, **settings)
        if look.high <= look.low:
            raise InputError(f"colour range: its end {look.high:g} is not above its beginning {look.low:g}")
        self.look = look
        for handle, shown in self._shown:
            if handle.value != shown(look):
                handle.value = shown(look)

    def next(self, setting: str, choices: tuple[str, ...]) -> None:
        """Change ``setting`` to the next choice, cyclically."""
        following = (choices.index(getattr(self.look, setting)) + 1) % len(choices)
        self.change(**{setting: choices[following]})


def one_of(value: object, choices: tuple[str, ...], name: str) -> str:
    """A choice from a browser; raises InputError if it is not one of ``choices``."""
    for choice in choices:
        if value == choice:
            return choice
    raise InputError(f"{name}: {str(value)[:40]!r} is not one of {', '.join(choices)}")


class CutPanel:
    """Changes ``settings``."""

    def __init__(self, server: viser.ViserServer, settings: LookSettings, post: Post) -> None:
        gui, look = server.gui, settings.look
        with gui.add_folder("Cut and rig"):
            self._cut = gui.add_dropdown(
                "Cut away",
                CUT_CHOICES,
                hint=f"Hides the bodies whose centres are on that side of the place. Key {CUT_KEY}: the next one.",
            )
            self._cut_at = gui.add_slider("Place of the cut [mm]", -REACH_MM, REACH_MM, 1.0, 0.0)
            self._opacity = gui.add_slider("Opacity of the rig", 0.0, 1.0, 0.01, look.rig_opacity)
            self._shadows = gui.add_checkbox(
                "Shadows", look.shadows, hint="Off: nearly twice as quick in a browser without a graphics card."
            )
        settings.bind(
            self._cut, lambda look: look.cut_away, lambda sent: {"cut_away": one_of(sent, CUT_CHOICES, "cut away")}
        )
        settings.bind(
            self._cut_at,
            lambda look: 1e3 * look.cut_at,
            lambda sent: {"cut_at": 1e-3 * checked(sent, -REACH_MM, REACH_MM, "place of the cut")},
        )
        settings.bind(
            self._opacity,
            lambda look: look.rig_opacity,
            lambda sent: {"rig_opacity": checked(sent, 0.0, 1.0, "opacity")},
        )
        settings.bind(self._shadows, lambda look: look.shadows, lambda sent: {"shadows": sent is True})
        add_keys(gui, {NEXT_CUT: lambda: settings.next("cut_away", CUT_CHOICES)}, {NEXT_CUT: CUT_KEY}, post)
