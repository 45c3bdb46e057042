"""Controls of what one looks past: bodies that are cut away, a rig that is seen through, shadows."""

from __future__ import annotations

import viser

from explorer.screen_units import checked
from explorer.viewer.actions import Post
from explorer.viewer.buttons import add_keys
from explorer.viewer.look.look import CUTS, NOTHING
from explorer.viewer.look.look_settings import LookSettings, one_of

CUT_KEY, NEXT_CUT = "X", "Cut away the next side"
CUT_CHOICES = (NOTHING, *CUTS)
REACH_MM = 200.0
"""The cut can be moved as far as this from the axis and above the plate [mm]."""


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
