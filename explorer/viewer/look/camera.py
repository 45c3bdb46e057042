"""Where the camera of a browser stands: presets with their keys, a link that leads back to a view, following a body."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
import viser

from explorer.viewer.actions import ClientAction, Post, add_client_key, client_buttons
from explorer.viewer.guarded_server import address
from explorer.viewer.view import VIEW_DIRECTION, VIEW_FIELD, CameraView, view_from

Array = npt.NDArray[np.float64]

DIRECTIONS: Mapping[str, tuple[float, float, float]] = {
    "Whole": VIEW_DIRECTION,
    "Front": (0.0, -1.0, 0.0),
    "Side": (1.0, 0.0, 0.0),
    # Not quite from above: straight down, the camera would not know which way is up.
    "Top": (0.0, -1e-3, 1.0),
}
"""From the pile to the camera."""
STILL = 1e-5
"""A body that has moved by less than this [m] does not move the camera."""
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


def view_of(height: float, name: str) -> CameraView:
    """The preset ``name``: everything up to ``height`` [m] in one picture."""
    return view_from(DIRECTIONS[name], height)


def go_to(client: Any, view: CameraView) -> None:
    """Put the camera of a browser to ``view``, and its field of view to that of new clients."""
    go_to_place(client, view)
    client.camera.fov = VIEW_FIELD


def go_along(clients: Iterable[Any], target: Array) -> None:
    """Let the cameras of browsers look at ``target`` [m] from the side and distance from which they look now."""
    for client in clients:
        camera = client.camera
        offset = camera.position - camera.look_at
        if np.linalg.norm(camera.look_at - target) > STILL:
            go_to_place(client, CameraView(target + offset, target))


def go_to_place(client: Any, view: CameraView) -> None:
    """Put the camera of a browser to ``view`` and leave its field of view alone."""
    with client.atomic():
        # In this order: a new position takes the point that is looked at along.
        client.camera.position = view.position
        client.camera.look_at = view.look_at


def link_to(server: viser.ViserServer, camera: Any) -> str:
    """Address of the page that opens with the view of ``camera``."""
    numbers = {
        "initialCameraPosition": camera.position,
        "initialCameraLookAt": camera.look_at,
        "initialCameraUp": camera.up_direction,
        "initialCameraFov": [camera.fov],
    }
    # Rounded to a tenth of a millimetre; + 0.0 takes the sign from a zero.
    query = "&".join(
        f"{name}={','.join(f'{round(float(x), 4) + 0.0:g}' for x in values)}" for name, values in numbers.items()
    )
    return f"http://{address(server.get_host())}:{server.get_port()}/?{query}"
