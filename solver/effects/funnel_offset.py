"""The funnel is not centred over the point of the plate from which the pile is measured.

    measured position = true position + (dx, dy)

Plate and gravity are the same everywhere, so the pile of a displaced funnel is the same pile, displaced. This is exact
except for the edge of the domain, which stays centred on the funnel. Vanishes for both → 0.
"""

from dataclasses import dataclass, replace
from typing import Any

from solver.effects.effect import SetUpEffect, Telltale
from solver.params import param


@dataclass(frozen=True)
class FunnelOffset(SetUpEffect):
    """Displacement of the funnel's axis; ``dx`` and ``dy`` are the amplitudes."""

    dx: float = param(0.0, unit="m", low=-0.1, high=0.1, doc="Displacement along x.")
    dy: float = param(0.0, unit="m", low=-0.1, high=0.1, doc="Displacement along y.")

    name = "funnel_offset"
    amplitudes = ("dx", "dy")
    strongest = 0.02
    literature = "a stand set up by eye is off by 2–10 mm"
    lever = "centre the funnel with a plumb line"
    telltales = (Telltale.ASYMMETRY,)

    def applied(self, scene: Any) -> Any:
        """``scene`` measured from a point displaced by −(dx, dy) from the funnel's axis."""
        x, y = scene.axis
        return replace(scene, axis=(x + self.dx, y + self.dy))
