"""How the user wants to see the pour: settings, and which bodies they leave in sight."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explorer.live.frames import Frame
from explorer.viewer.scene_nodes import CLEAR

COMPONENT = "component"
"""Colour by component."""
NOTHING = "nothing"
CUTS: Mapping[str, tuple[int, float]] = {
    f"{axis} {word}": (k, side)
    for k, axis in enumerate(("x", "y", "z"))
    for word, side in (("below", -1.0), ("above", 1.0))
}
"""What can be cut away: axis, and the side of the cut."""


@dataclass(frozen=True)
class Look:
    """Settings of the tab "Look"."""

    colour_by: str = COMPONENT
    automatic: bool = True
    """Whether the range of the colours follows the values."""
    logarithmic: bool = False
    """Whether colours follow the logarithm of a value."""
    low: float = 0.0
    """Lower end of a fixed range of the colours, in the displayed unit."""
    high: float = 1.0
    chains: bool = False
    threshold: float = 1.0
    """Weakest contact that is drawn, as a multiple of the mean normal force."""
    cut_away: str = NOTHING
    cut_at: float = 0.0
    """Position of the cut on its axis [m]."""
    rig_opacity: float = CLEAR
    shadows: bool = True

    @property
    def needs_details(self) -> bool:
        """Whether it shows what frames do not carry."""
        return self.chains or self.colour_by != COMPONENT


def in_sight(frame: Frame, look: Look) -> npt.NDArray[np.bool_]:
    """Which bodies are drawn, shape (n,): those in the domain whose centre is not cut away."""
    if look.cut_away not in CUTS:
        return frame.inside
    axis, side = CUTS[look.cut_away]
    return frame.inside & (side * (frame.position[:, axis] - look.cut_at) <= 0.0)
