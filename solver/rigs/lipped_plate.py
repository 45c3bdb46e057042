"""The lipped plate: a cylinder is lifted off a plate with a low lip around it, which keeps the heap's lowest layer.

       |        |   ↑          ↑ lift_speed
       |        |   cylinder_height
     ╷ |________| ╷ ↓          ↕ lip_height
    ─────────────────────  plate, z = 0
     ← lip_diameter →

On a bare smooth plate, round grains roll away from under their heap. Per width and ρg, a heap of slope θ and height h
pushes its base outwards with about K h²/2 (K ≈ 0.3 … 0.5), while half of it weighs h²/(2 tan θ) and is held by no more
than its rolling friction μ, so that tan θ ≤ μ/K. Behind the lip, grains rest on grains. Grains that spill over it roll
away and are removed at ``domain_half_width``.
Source: test platforms of USP <1174> and ISO 4324, 100 mm across, whose "protruding outer lip" retains a layer on which
the cone is formed, the surplus falling off (gardco.com, powder angle of repose). The lip's height is ours.
"""

from __future__ import annotations

from dataclasses import dataclass

from solver.params import ParameterError, param
from solver.rigs.lifting_cylinder import LiftingCylinder
from solver.rigs.surface import Revolved, Surface


@dataclass(frozen=True)
class LippedPlate(LiftingCylinder):
    """Lip, cylinder, the motion of the cylinder and the mass that is poured."""

    lip_diameter: float = param(0.100, unit="m", low=0.005, high=2.0, doc="Inner diameter of the lip.")
    lip_height: float = param(0.003, unit="m", low=1e-4, high=0.1, doc="Height of the lip above the plate.")

    name = "lipped_plate"
    surface_names = ("plate", "cylinder", "lip")

    def surfaces(self) -> tuple[Surface, ...]:
        """Plate, cylinder and lip."""
        radius = self.lip_diameter / 2.0
        return (*super().surfaces(), Revolved(radius, 0.0, radius, self.lip_height, self.wall))

    def check(self, widest_body: float) -> None:
        """Refuse a lip inside the cylinder or outside the domain."""
        super().check(widest_body)
        if self.lip_diameter <= self.diameter:
            raise ParameterError(
                f"rig.lip_diameter: {self.lip_diameter:g} m is no wider than the cylinder; allowed: above rig.diameter "
                f"({self.diameter:g} m)"
            )
        if self.lip_diameter >= 2.0 * self.domain_half_width:
            raise ParameterError(
                f"rig.lip_diameter: {self.lip_diameter:g} m reaches rig.domain_half_width "
                f"({self.domain_half_width:g} m), beyond which bodies are removed; allowed: below "
                f"{2.0 * self.domain_half_width:g} m"
            )
