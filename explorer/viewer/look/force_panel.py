"""Controls of the force chains."""

from __future__ import annotations

import viser

from explorer.live.details import Details
from explorer.screen_units import checked
from explorer.viewer.actions import Post
from explorer.viewer.buttons import add_keys
from explorer.viewer.look.force_chains import chain_text
from explorer.viewer.look.look_settings import LookSettings

CHAINS_KEY, FORCE_CHAINS = "K", "Force chains"
MOST_TIMES_MEAN = 5.0


class ForcePanel:
    """Changes ``settings``, and says what the lines mean."""

    def __init__(self, server: viser.ViserServer, settings: LookSettings, post: Post) -> None:
        self._settings, gui = settings, server.gui
        with gui.add_folder("Forces"):
            self._chains = gui.add_checkbox(
                FORCE_CHAINS, False, hint=f"Lines through the contacts that press hardest. Key {CHAINS_KEY}."
            )
            self._threshold = gui.add_slider(
                "From × mean force", 0.0, MOST_TIMES_MEAN, 0.1, 1.0, hint="Weakest contact that is drawn."
            )
            self._text = gui.add_markdown("")
        settings.bind(self._chains, lambda look: look.chains, lambda sent: {"chains": sent is True})
        settings.bind(
            self._threshold,
            lambda look: look.threshold,
            lambda sent: {"threshold": checked(sent, 0.0, MOST_TIMES_MEAN, "threshold")},
        )
        add_keys(
            gui,
            {FORCE_CHAINS: lambda: settings.change(chains=not settings.look.chains)},
            {FORCE_CHAINS: CHAINS_KEY},
            post,
        )

    def show(self, details: Details | None) -> None:
        """Say what the lines mean; call it inside ``server.atomic()``."""
        lines = chain_text(details, self._settings.look)
        if self._text.content != lines:
            self._text.content = lines
