"""The draw-down box: an upper box with a slot in its floor is filled, the slot opens, material stays on both sides of
it and a pile forms below.

    |                |     ↑ box_height
    |\\              /|
    | \\____    ____/ |     shelf at shelf_height, slot of slot_width in its middle, over the whole depth
            ↓
           /\\
    ──────/──\\───────────  plate, z = 0

One run gives two angles and the flow between them: the slope that remains above (an angle of internal shear) and the
pile below. Front and back walls, ``depth`` apart, reach down to the plate, so that slope and pile are plane; the plate
is open to the sides. Source of the test: Roessler et al. 2019, Powder Technology 343:803; dimensions are ours.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from solver.params import ParameterError, param
from solver.rigs.feed import BoxFeed
from solver.rigs.outlet import Slot
from solver.rigs.rig import DISCHARGE, DRAW_DOWN, Action, Container, PourRig, Switch
from solver.rigs.surface import FACING_MINUS_Y, FACING_PLUS_Y, Surface, horizontal, rectangle, turned_plane


@dataclass(frozen=True)
class DrawDownBox(PourRig):
    """Dimensions of the rig and the mass that is filled in."""

    width: float = param(0.240, unit="m", low=0.01, high=2.0, doc="Inner width of the upper box (x).")
    depth: float = param(0.080, unit="m", low=0.002, high=2.0, doc="Distance between the front and back walls (y).")
    box_height: float = param(0.200, unit="m", low=0.005, high=2.0, doc="Height of the upper box above its shelf.")
    shelf_height: float = param(0.200, unit="m", low=0.01, high=2.0, doc="Height of the shelf above the plate.")
    slot_width: float = param(0.090, unit="m", low=0.002, high=1.0, doc="Width of the slot in the shelf (x).")
    mass: float = param(0.300, unit="kg", low=1e-5, high=50.0, doc="Filled mass.")
    domain_half_width: float = param(
        0.4, unit="m", low=0.05, high=10.0, doc="Bodies farther than this from the middle are removed."
    )
    wall: str = "rigid_sieve_plate"

    name = "draw_down_box"
    surface_names = ("plate", "front", "back", "left", "right", "left_shelf", "right_shelf", "gate")
    gives = (
        DRAW_DOWN,
        "angle_of_repose_deg@0",
        "angle_of_repose_left_deg",
        "angle_of_repose_right_deg",
        "apex_height_m",
        DISCHARGE,
    )
    keeps_material = True
    quick_changes: ClassVar[Mapping[str, Mapping[str, float]]] = {
        "slot 1.3 times as wide": {"rig.slot_width": 1.3},
        "shelf at 1.5 times the height": {"rig.shelf_height": 1.5},
    }

    @property
    def suits(self) -> Mapping[str, float | str]:
        """Fill the whole opening evenly and fast, then open."""
        return {
            "insertion.protocol": "fill_then_open",
            "insertion.rate": 0.3,
            "insertion.region_radius": 1.0,
            "numerics.max_time": 20.0,
        }

    @property
    def floor(self) -> float:
        """Height below which a body has left the upper box [m]: half a slot's width below the shelf."""
        return max(0.5 * self.shelf_height, self.shelf_height - 0.5 * self.slot_width)

    def surfaces(self) -> tuple[Surface, ...]:
        """In the order of ``surface_names``."""
        x, y, slot = self.width / 2.0, self.depth / 2.0, self.slot_width / 2.0
        low, high, wall = self.shelf_height, self.box_height, self.wall
        along_y, up = (0.0, self.depth, 0.0), (0.0, 0.0, high)
        return (
            horizontal(0.0, wall),
            turned_plane((0.0, -y, 0.0), FACING_PLUS_Y, wall),
            turned_plane((0.0, y, 0.0), FACING_MINUS_Y, wall),
            rectangle((-x, -y, low), along_y, up, wall),
            rectangle((x, -y, low), along_y, up, wall),
            rectangle((-x, -y, low), along_y, (x - slot, 0.0, 0.0), wall),
            rectangle((slot, -y, low), along_y, (x - slot, 0.0, 0.0), wall),
            rectangle((-slot, -y, low), along_y, (self.slot_width, 0.0, 0.0), wall),
        )

    def poured_mass(self, density: float) -> float:
        """Mass that is filled in [kg], whatever its density."""
        return self.mass

    def feed(self) -> BoxFeed:
        """The open top of the box."""
        return BoxFeed(self.shelf_height + self.box_height, self.width / 2.0, self.depth / 2.0)

    def container(self, since: float) -> Container:
        """The upper box and the upper half of the way through the slot, where a body may lie across it."""
        return Container(self.floor, math.hypot(self.width, self.depth) / 2.0)

    @property
    def outlet(self) -> Slot:
        """The slot."""
        return Slot(self.slot_width / 2.0, self.shelf_height - self.floor)

    def actions(self) -> tuple[Action, ...]:
        """The slot opens."""
        return (Switch(0.0, self.surface_names.index("gate"), False),)

    def check(self, widest_body: float) -> None:
        """Refuse a slot that is wider than the box or narrower than a body."""
        if self.slot_width >= self.width:
            raise ParameterError(
                f"rig.slot_width: {self.slot_width:g} m is not narrower than the box; allowed: below rig.width "
                f"({self.width:g} m)"
            )
        if self.slot_width <= widest_body:
            raise ParameterError(
                f"rig.slot_width: {self.slot_width:g} m is too narrow for a body; allowed: more than {widest_body:g} m"
            )
