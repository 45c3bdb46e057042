"""Controls of the camera: presets with their keys, and a link to the view."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import viser

from explorer.viewer.actions import Post
from explorer.viewer.buttons import ClientAction, add_client_key, client_buttons
from explorer.viewer.look.camera import DIRECTIONS, go_to, link_to, view_of

LINK = "Link to this view"
VIEW_KEYS: dict[str, Any] = dict(zip(DIRECTIONS, ("1", "2", "3", "4"), strict=True))


class CameraPanel:
    """Moves the cameras of browsers.

    Args:
        server: the page.
        post: where actions go.
        height: tells how high it is what has to be in the picture [m].
        leaves: is told of a browser whose camera goes to a preset.
    """

    def __init__(
        self, server: viser.ViserServer, post: Post, height: Callable[[], float], leaves: ClientAction = lambda _: None
    ) -> None:
        self._server, self._height, self._leaves = server, height, leaves
        gui = server.gui
        acts = {name: partial(self._look_from, name) for name in DIRECTIONS}
        with gui.add_folder("Camera"):
            client_buttons(gui, "View", acts, post, hint="Keys 1, 2, 3, 4.")
            link = gui.add_button(LINK, hint="Puts the address of what you see into the field below.")
            self._link: Any = gui.add_text("Address", "", hint="Opens the page with this view.")
        for name, key in VIEW_KEYS.items():
            add_client_key(gui, f"View: {name.lower()}", key, acts[name], post)

        @link.on_click
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:
                post(partial(self._show_link, event.client))

    def _look_from(self, name: str, client: Any) -> None:
        self._leaves(client)
        go_to(client, view_of(self._height(), name))

    def _show_link(self, client: Any) -> None:
        self._link.value = link_to(self._server, client.camera)
