"""The lifting cylinder: a cylinder on the plate is filled, the fill settles, the cylinder is lifted, a pile stays.

        diameter
       |        |   ↑          ↑ lift_speed, over lift_height
       |        |   cylinder_height
       |________|   ↓
    ─────────────────────  plate, z = 0

The test is slow: the material flows out at the bottom edge without falling, so that its pile shows friction where that
of a funnel shows impacts. The plate is infinite; bodies that roll further than ``domain_half_width`` from the axis are
removed.
Source: Roessler & Katterfeld 2019, Particuology 45:17 (angle of repose test); dimensions are ours.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from solver.params import ParameterError, param
from solver.rigs.feed import RoundFeed
from solver.rigs.outlet import RoundOutlet
from solver.rigs.rig import DISCHARGE, PILE, Action, Container, Move, PourRig
from solver.rigs.surface import Revolved, Surface, horizontal


@dataclass(frozen=True)
class LiftingCylinder(PourRig):
    """Dimensions of the rig, the motion of the cylinder and the mass that is poured."""

    diameter: float = param(0.080, unit="m", low=0.005, high=2.0, doc="Inner diameter of the cylinder.")
    cylinder_height: float = param(0.150, unit="m", low=0.005, high=2.0, doc="Height of the cylinder.")
    lift_speed: float = param(0.020, unit="m/s", low=1e-3, high=1.0, doc="Speed at which the cylinder is lifted.")
    lift_height: float = param(0.150, unit="m", low=0.01, high=2.0, doc="Height to which it is lifted and then held.")
    mass: float = param(0.030, unit="kg", low=1e-5, high=10.0, doc="Filled mass.")
    domain_half_width: float = param(
        0.4, unit="m", low=0.05, high=10.0, doc="Bodies farther than this from the axis are removed."
    )
    wall: str = "rigid_sieve_plate"

    name = "lifting_cylinder"
    surface_names: ClassVar[tuple[str, ...]] = ("plate", "cylinder")
    gives = (PILE, DISCHARGE)
    quarter_turns = True
    quick_changes: ClassVar[Mapping[str, Mapping[str, float]]] = {
        "lifted three times as fast": {"rig.lift_speed": 3.0},
        "lifted at half the speed": {"rig.lift_speed": 0.5},
    }

    @property
    def suits(self) -> Mapping[str, float | str]:
        """Fill first, over nearly the whole opening; time for a slow lift."""
        return {
            "insertion.protocol": "fill_then_open",
            "insertion.rate": 0.05,
            "insertion.region_radius": 0.04,
            "numerics.max_time": 30.0,
        }

    def surfaces(self) -> tuple[Surface, ...]:
        """Plate and cylinder."""
        radius = self.diameter / 2.0
        return (
            horizontal(0.0, self.wall),
            Revolved(radius, 0.0, radius, self.cylinder_height, self.wall),
        )

    def poured_mass(self, density: float) -> float:
        """Mass that is filled in [kg], whatever its density."""
        return self.mass

    def feed(self) -> RoundFeed:
        """The upper end of the cylinder."""
        return RoundFeed(self.cylinder_height, self.diameter / 2.0)

    def container(self, since: float) -> Container:
        """Above the rising lower edge of the cylinder, within its radius."""
        return Container(min(self.lift_speed * since, self.lift_height), self.diameter / 2.0)

    @property
    def outlet(self) -> RoundOutlet:
        """The lower end of the cylinder."""
        return RoundOutlet(self.diameter / 2.0)

    def actions(self) -> tuple[Action, ...]:
        """The cylinder rises, then stands still."""
        cylinder = self.surface_names.index("cylinder")
        return (
            Move(0.0, cylinder, velocity=(0.0, 0.0, self.lift_speed)),
            Move(self.lift_height / self.lift_speed, cylinder),
        )

    def check(self, widest_body: float) -> None:
        """Refuse a cylinder that a body cannot fall through."""
        if self.diameter <= widest_body:
            raise ParameterError(
                f"rig.diameter: {self.diameter:g} m is too narrow for a body; allowed: more than {widest_body:g} m"
            )
