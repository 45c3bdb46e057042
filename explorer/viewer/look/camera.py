"""The camera of a browser: presets with their keys, a link that restores a view, following a body."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
import viser

from explorer.errors import CommandError
from explorer.live.frames import Frame
from explorer.scene.link import INSTEAD, LONGEST
from explorer.units import InputError
from explorer.viewer.actions import ClientAction, Post, add_client_key, client_buttons
from explorer.viewer.guarded_server import GuardedServer
from explorer.viewer.view import VIEW_DIRECTION, VIEW_FIELD, CameraView, view_from

Array = npt.NDArray[np.float64]

DIRECTIONS: Mapping[str, tuple[float, float, float]] = {
    "Whole": VIEW_DIRECTION,
    "Front": (0.0, -1.0, 0.0),
    "Side": (1.0, 0.0, 0.0),
    # Not quite from above: looking straight down, the camera would have no upward direction.
    "Top": (0.0, -1e-3, 1.0),
}
"""Directions from the pile to the camera."""
STILL = 1e-5
"""A body that has moved by less than this [m] does not move the camera."""
LINK = "Link to this view"
FRAME_PILE, FRAME_KEY = "Frame the pile", "5"
FRAMED = 0.9
"""Share of the picture that the pile fills, in width or height."""
BODY_REACH = 0.01
"""Assumed reach of a body from its centre [m], for a picture of the pile."""
VIEW_KEYS: dict[str, Any] = dict(zip(DIRECTIONS, ("1", "2", "3", "4"), strict=True))


class CameraPanel:
    """Moves the cameras of browsers.

    Args:
        server: the page.
        post: where actions go.
        height: returns the height of what has to be in the picture [m].
        pile: returns the positions of the bodies of the pile [m], shape (n, 3).
        leaves: is called with a browser whose camera goes to a preset.
        pour: returns the pour and its moment, as the text after # in an address; "" if there is none.
    """

    def __init__(
        self,
        server: GuardedServer,
        post: Post,
        height: Callable[[], float],
        pile: Callable[[], Array],
        leaves: ClientAction = lambda _: None,
        pour: Callable[[], str] = str,
    ) -> None:
        self._server, self._height, self._pile, self._pour, self._leaves = server, height, pile, pour, leaves
        gui = server.gui
        acts = {name: partial(self._look_from, name) for name in DIRECTIONS}
        with gui.add_folder("Camera"):
            client_buttons(gui, "View", acts, post, hint="Keys 1, 2, 3, 4.")
            framed = gui.add_button(
                FRAME_PILE, hint=f"The heap and its strays fill the picture, without the rig. Key {FRAME_KEY}."
            )
            link = gui.add_button(LINK, hint="Puts the address of what you see into the field below.")
            self._link: Any = gui.add_text(
                "Address",
                "",
                hint="Opens the page with this view, and offers to pour what is on the screen up to this moment: from "
                "the start, with the parameters now in force.",
            )
        for name, key in VIEW_KEYS.items():
            add_client_key(gui, f"View: {name.lower()}", key, acts[name], post)

        add_client_key(gui, FRAME_PILE, FRAME_KEY, self._frame_pile, post)

        @framed.on_click
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:
                post(partial(self._frame_pile, event.client))

        @link.on_click
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:
                post(partial(self._show_link, event.client))

    def _look_from(self, name: str, client: Any) -> None:
        self._leaves(client)
        go_to(client, view_of(self._height(), name))

    def _frame_pile(self, client: Any) -> None:
        points = self._pile()
        if not len(points):
            raise InputError("frame the pile: no body has entered yet")
        self._leaves(client)
        camera = client.camera
        go_to_place(client, framing(points, camera.position - camera.look_at, camera.fov, aspect_of(camera)))

    def _show_link(self, client: Any) -> None:
        self._link.value = view = link_to(self._server.address(), client.camera)
        try:
            pour = self._pour()
        except CommandError as error:
            raise CommandError(f"the link holds the view only: {error}") from None
        if len(view) + len(pour) >= LONGEST:
            raise CommandError(f"the link holds the view only: the pour takes {len(pour)} characters; {INSTEAD}")
        self._link.value = f"{view}#{pour}" if pour else view


def view_of(height: float, name: str) -> CameraView:
    """The preset ``name``: everything up to ``height`` [m] in one picture."""
    return view_from(DIRECTIONS[name], height)


def aspect_of(camera: Any) -> float:
    """Width of a browser's picture over its height; 1 if the browser has not sent it yet."""
    return camera.image_width / max(camera.image_height, 1) or 1.0


def framing(points: Array, direction: Array, field: float, aspect: float) -> CameraView:
    """The view from ``direction`` (pile to camera), so near that ``points`` (n, 3), each with a body, just fit in.

    Args:
        points: [m].
        direction: of any length; if straight from above or below, it is tilted a little to define the upward direction.
        field: vertical field of view [rad].
        aspect: width of the picture over its height.
    """
    back = np.asarray(direction, dtype=np.float64) + np.array([0.0, -1e-3 * np.linalg.norm(direction), 0.0])
    back /= np.linalg.norm(back)
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(back, right), back])
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    across, upright, depth = axes @ (points - middle).T
    slope = FRAMED * math.tan(0.5 * field)
    distance = depth + np.maximum((abs(across) + BODY_REACH) / (slope * aspect), (abs(upright) + BODY_REACH) / slope)
    return CameraView(middle + float(distance.max()) * back, middle)


def pile_points(frame: Frame | None, outlet: float) -> Array:
    """Positions of the bodies of ``frame`` that have left the rig, below its ``outlet`` [m]; if none have, of all."""
    if frame is None:
        return np.zeros((0, 3))
    points = frame.position[frame.inside].astype(np.float64)
    below = points[points[:, 2] < outlet]
    return below if len(below) else points


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
        # In this order: setting the position also moves the point that is looked at.
        client.camera.position = view.position
        client.camera.look_at = view.look_at


def link_to(address: str, camera: Any) -> str:
    """Address of the page at ``address`` that opens with the view of ``camera``."""
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
    return f"{address}/?{query}"
