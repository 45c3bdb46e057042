"""Lamps and the camera that new clients start with; the same for the live page and a replay."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import viser

VIEW_DIRECTION = (0.62, -0.75, 0.24)
"""From the pile to the camera."""
VIEW_FIELD = 0.6
"""Vertical field of view [rad]."""
FILL = 0.68
"""Share of the height of the window that rig and feed take."""
MIDDLE = 0.42
"""Height that the camera looks at, as a share of the height of rig and feed."""
SKY = 0.7
"""Light from everywhere, so that what lies in the shade is not black."""


@dataclass(frozen=True)
class CameraView:
    """A place of the camera [m] and what it looks at [m]."""

    position: npt.NDArray[np.float64]
    look_at: npt.NDArray[np.float64]


def view_from(direction: tuple[float, float, float], height: float) -> CameraView:
    """From ``direction`` (pile to camera), with everything up to ``height`` [m] in one picture."""
    distance = height / FILL / (2.0 * math.tan(VIEW_FIELD / 2.0))
    middle = np.array([0.0, 0.0, MIDDLE * height])
    return CameraView(middle + distance * np.array(direction), middle)


def light(server: viser.ViserServer, shadows: bool = True) -> None:
    """viser's lamps with shadows; no sky, which takes a browser without a graphics card a third of its time."""
    server.scene.configure_default_lights(enabled=True, cast_shadow=shadows)
    server.scene.configure_environment_map(None)
    server.scene.add_light_ambient("/sky", intensity=SKY)


def look_at_height(server: viser.ViserServer, height: float) -> None:
    """Camera that new clients start with: everything up to ``height`` [m] in one picture."""
    view, camera = view_from(VIEW_DIRECTION, height), server.initial_camera
    camera.position, camera.look_at = view.position, view.look_at
    camera.fov = VIEW_FIELD
    camera.near = 0.01
