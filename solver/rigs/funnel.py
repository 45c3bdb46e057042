"""The funnel rig: material falls through a conical funnel onto a plate and piles up.

        inlet_diameter
      \\              /     ↑
       \\            /      cone_height
        \\          /       ↓
         |outlet  |        ↑ outlet_height
    ─────────────────────  plate, z = 0

The plate is infinite; bodies that roll further than ``domain_half_width`` from the axis are removed and counted.
Source of the shipped dimensions: Processes 2022, 10, 185, §2.6 (funnel); the outlet height is assumed, not published.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from solver.params import ParameterError, param
from solver.rigs.feed import RoundFeed
from solver.rigs.outlet import RoundOutlet
from solver.rigs.rig import DISCHARGE, OUTLET_HEIGHTS, PILE, Action, Container, PourRig, Switch
from solver.rigs.surface import Revolved, Surface, horizontal


@dataclass(frozen=True)
class Funnel(PourRig):
    """Dimensions of the rig and the mass that is poured."""

    inlet_diameter: float = param(0.114, unit="m", low=0.01, high=2.0, doc="Inner diameter of the feed opening.")
    outlet_diameter: float = param(0.030, unit="m", low=0.003, high=2.0, doc="Inner diameter of the outlet.")
    cone_height: float = param(0.130, unit="m", low=0.005, high=2.0, doc="Length of the funnel along its axis.")
    outlet_height: float = param(0.065, unit="m", low=0.005, high=2.0, doc="Height of the outlet above the plate.")
    mass: float = param(0.030, unit="kg", low=1e-5, high=10.0, doc="Poured mass.")
    domain_half_width: float = param(
        0.4, unit="m", low=0.05, high=10.0, doc="Bodies farther than this from the axis are removed."
    )
    wall: str = "rigid_sieve_plate"

    name = "funnel"
    surface_names = ("plate", "cone", "gate")
    gives = (PILE, DISCHARGE)
    quarter_turns = True
    protocols = ("pour_through", "fill_then_open")
    refills = True
    quick_changes: ClassVar[Mapping[str, Mapping[str, float]]] = {
        **OUTLET_HEIGHTS,
        "outlet 1.3 times as wide": {"rig.outlet_diameter": 1.3},
        "outlet 1.3 times as wide at twice the height": {"rig.outlet_diameter": 1.3, "rig.outlet_height": 2.0},
    }

    @property
    def inlet_height(self) -> float:
        """Height of the feed opening above the plate [m]."""
        return self.outlet_height + self.cone_height

    def surfaces(self) -> tuple[Surface, ...]:
        """Plate, cone and gate, in the order of ``surface_names``."""
        outlet, inlet = self.outlet_diameter / 2.0, self.inlet_diameter / 2.0
        return (
            horizontal(0.0, self.wall),
            Revolved(outlet, self.outlet_height, inlet, self.inlet_height, self.wall),
            Revolved(0.0, self.outlet_height, outlet, self.outlet_height, self.wall),
        )

    def poured_mass(self, density: float) -> float:
        """Mass that is poured [kg], whatever its density."""
        return self.mass

    def feed(self) -> RoundFeed:
        """The feed opening."""
        return RoundFeed(self.inlet_height, self.inlet_diameter / 2.0)

    def container(self, since: float) -> Container:
        """Above the outlet, within the radius of the feed opening."""
        return Container(self.outlet_height, self.inlet_diameter / 2.0)

    @property
    def outlet(self) -> RoundOutlet:
        """The narrow end of the cone."""
        return RoundOutlet(self.outlet_diameter / 2.0)

    def actions(self) -> tuple[Action, ...]:
        """The gate opens."""
        return (Switch(0.0, self.surface_names.index("gate"), False),)

    def check(self, widest_body: float) -> None:
        """Refuse a funnel that narrows upward or whose outlet is narrower than ``widest_body`` [m].

        ``widest_body`` is the smallest width through which the widest of the bodies can pass: its middle extent,
        since a body may turn and only its two smaller extents have to go through.
        """
        if self.inlet_diameter <= self.outlet_diameter:
            raise ParameterError(
                f"rig.inlet_diameter: {self.inlet_diameter:g} m must be larger than rig.outlet_diameter "
                f"({self.outlet_diameter:g} m)"
            )
        if self.outlet_diameter <= widest_body:
            raise ParameterError(
                f"rig.outlet_diameter: {self.outlet_diameter:g} m is too narrow for a body; "
                f"allowed: more than {widest_body:g} m"
            )
