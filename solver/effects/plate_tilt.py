"""Plate and funnel are tilted: gravity is rotated relative to both.

    g → R g,   R rotates by √(tilt_x² + tilt_y²) so that the plate slopes down by tilt_x along +x and tilt_y along +y

Vanishes for both → 0. The pile leans: its centre of mass moves downhill, and the flank on that side is flatter as seen
from the plate. The mean over all azimuths changes only to second order.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

from solver.effects.effect import SetUpEffect, Telltale
from solver.params import param


@dataclass(frozen=True)
class PlateTilt(SetUpEffect):
    """Tilt of plate and funnel; ``tilt_x`` and ``tilt_y`` are the amplitudes."""

    tilt_x: float = param(0.0, unit="deg", low=-20.0, high=20.0, doc="Downward slope along +x.")
    tilt_y: float = param(0.0, unit="deg", low=-20.0, high=20.0, doc="Downward slope along +y.")

    name = "plate_tilt"
    amplitudes = ("tilt_x", "tilt_y")
    strongest = 5.0
    literature = "a bench that nobody levelled is off by 1–3°; 5° is seen by eye"
    lever = "turn the rig by 180° on its bench; a spirit level"
    on_bench = True
    telltales = (Telltale.ASYMMETRY,)

    def applied(self, scene: Any) -> Any:
        """``scene`` with gravity rotated."""
        angle = math.radians(math.hypot(self.tilt_x, self.tilt_y))
        if angle == 0.0:
            return scene
        ux, uy = (math.radians(tilt) / angle for tilt in (self.tilt_x, self.tilt_y))
        # Rodrigues about the horizontal axis (uy, -ux, 0), which takes -z towards (ux, uy).
        gx, gy, gz = scene.gravity
        along = ux * gx + uy * gy
        level = along * math.cos(angle) - gz * math.sin(angle)
        down = gz * math.cos(angle) + along * math.sin(angle)
        gravity = (gx + (level - along) * ux, gy + (level - along) * uy, down)
        return replace(scene, gravity=gravity)
