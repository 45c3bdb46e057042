"""The inclined plane: a body lies on a plane that is tilted slowly, until it slides. The tangent of that angle is μ_s.

The body is held so that it cannot roll or tip, as in a laboratory, where several grains are glued to a carrier. The
test turns gravity, in the frame of the plane, instead of the plane; ``single_body/inclined_plane.py`` runs it.
Source of the test: Processes 2022, 10, 185, §2.4.
"""

from __future__ import annotations

from dataclasses import dataclass

from solver.params import param
from solver.rigs.rig import BenchRig
from solver.rigs.surface import Surface, horizontal


@dataclass(frozen=True)
class InclinedPlane(BenchRig):
    """How the plane is tilted."""

    tilt_rate: float = param(1.0, unit="deg/s", low=0.01, high=20.0, doc="Speed of tilting near the angle of sliding.")
    body: str = ""
    wall: str = "rigid_sieve_plate"
    domain_half_width: float = 100.0

    name = "inclined_plane"
    surface_names = ("plane",)

    def surfaces(self) -> tuple[Surface, ...]:
        """The plane, in whose frame the body is watched."""
        return (horizontal(0.0, self.wall),)
