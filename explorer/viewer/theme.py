"""Dark or light, for the page as a whole: viser's own parts, and the charts, which follow no theme by themselves."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import viser

from explorer.viewer.actions import Post
from explorer.viewer.palette import BRAND

DARK = True
"""How the page begins."""


def apply_theme(server: viser.ViserServer, dark: bool) -> None:
    """Set viser's theme."""
    server.gui.configure_theme(
        dark_mode=dark, show_share_button=False, show_logo=False, brand_color=BRAND, control_width="large"
    )


class ThemeSwitch:
    """A switch for all browsers; ``follow`` is called with True for dark."""

    def __init__(self, server: viser.ViserServer, post: Post, follow: Callable[[bool], None]) -> None:
        self._server, self._follow = server, follow
        self._dark = server.gui.add_checkbox("Dark page", DARK, hint="Dark or light, charts included.")

        @self._dark.on_update
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                post(self._switch)

    def _switch(self) -> None:
        dark = self._dark.value is True  # what a browser sent may be anything
        apply_theme(self._server, dark)
        self._follow(dark)
