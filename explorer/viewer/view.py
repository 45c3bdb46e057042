"""How the page starts: lamps, camera, dark or light, and small text in a panel; the same live and in a replay.

Dark or light is set for viser's own parts, and separately for the charts, which do not follow the theme by themselves.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import viser

from explorer.viewer.actions import Post
from explorer.viewer.palette import BRAND, BRAND_ON_WHITE

DARK = True
"""Whether the page starts dark."""
VIEW_DIRECTION = (0.62, -0.75, 0.24)
"""Direction from the pile to the camera."""
VIEW_FIELD = 0.6
"""Vertical field of view [rad]."""
FILL = 0.68
"""Share of the window's height that rig and feed take up."""
MIDDLE = 0.42
"""Height that the camera looks at, as a share of the height of rig and feed."""
SKY = 0.7
"""Intensity of the ambient light, which keeps shaded parts from being black."""


@dataclass(frozen=True)
class CameraView:
    """The position of the camera [m] and the point that it looks at [m]."""

    position: npt.NDArray[np.float64]
    look_at: npt.NDArray[np.float64]


def view_from(direction: tuple[float, float, float], height: float) -> CameraView:
    """View from ``direction`` (pile to camera), with everything up to ``height`` [m] in the picture."""
    distance = height / FILL / (2.0 * math.tan(VIEW_FIELD / 2.0))
    middle = np.array([0.0, 0.0, MIDDLE * height])
    return CameraView(middle + distance * np.array(direction), middle)


def light(server: viser.ViserServer, shadows: bool = True) -> None:
    """Set viser's lamps with shadows, and no sky: it takes a third of the time of a browser without a graphics card."""
    server.scene.configure_default_lights(enabled=True, cast_shadow=shadows)
    server.scene.configure_environment_map(None)
    server.scene.add_light_ambient("/sky", intensity=SKY)


def look_at_height(server: viser.ViserServer, height: float) -> None:
    """Set the camera that new clients start with: everything up to ``height`` [m] is in the picture."""
    view, camera = view_from(VIEW_DIRECTION, height), server.initial_camera
    camera.position, camera.look_at = view.position, view.look_at
    camera.fov = VIEW_FIELD
    camera.near = 0.01


def apply_theme(server: viser.ViserServer, dark: bool) -> None:
    """Set viser's theme."""
    brand = BRAND if dark else BRAND_ON_WHITE
    server.gui.configure_theme(
        dark_mode=dark, show_share_button=False, show_logo=False, brand_color=brand, control_width="large"
    )


class ThemeSwitch:
    """A dark-page switch for all browsers; ``follow`` is called with True for dark."""

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


def small_html(contents: str) -> str:
    """``contents`` (HTML) with the font size and margins of small panel text; long words are broken."""
    return f"<div style='padding:0 0.75em; font-size:13px; overflow-wrap:anywhere'>{contents}</div>"
