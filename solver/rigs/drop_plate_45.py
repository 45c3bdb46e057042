"""The drop on a plate at 45°: a body falls from a height H and bounces off to the side.

         ○  ↓ H                    n = (1, 0, 1)/√2
          \\                        incoming  v·n = −√(2gH)/√2
           \\  → v_x, ↑ v_z          outgoing  v·n = (v_x + v_z)/√2
            \\

so that e = (v_x + v_z)/√(2gH) for any friction, as long as the contact is central. The paper instead measures the
distance L that the body flies until it is H below the plate, and takes e = L/(2H), which holds for a horizontal rebound
only.
``single_body/drop_plate_45.py`` runs the test and reports both.
Source of the test: Processes 2022, 10, 185, §2.5, Equations (4)–(7); H is 20 cm there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from solver.params import param
from solver.rigs.rig import BenchRig
from solver.rigs.surface import Plane, Surface, SurfacePose

FACING_UP_AND_RIGHT = (math.cos(math.pi / 8.0), 0.0, math.sin(math.pi / 8.0), 0.0)
"""An eighth of a turn about +y: local z becomes (1, 0, 1)/√2."""


@dataclass(frozen=True)
class DropPlate45(BenchRig):
    """Height of the fall and what falls."""

    drop_height: float = param(0.200, unit="m", low=1e-3, high=5.0, doc="Height H of the fall, surface to plate.")
    specimen: str = param(
        "sphere",
        doc="sphere: a ball of the body's volume and material; body: the body itself, in random orientations.",
        choices=("sphere", "body"),
    )
    drops: float = param(10.0, low=2.0, high=1000.0, doc="Number of drops of a body; a sphere is dropped once.")
    body: str = ""
    wall: str = "rigid_sieve_plate"
    domain_half_width: float = 100.0

    name = "drop_plate_45"
    surface_names = ("plate",)

    def surfaces(self) -> tuple[Surface, ...]:
        """The plate, through the origin."""
        return (Plane(self.wall, SurfacePose((0.0, 0.0, 0.0), FACING_UP_AND_RIGHT)),)
