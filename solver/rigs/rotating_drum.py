"""The rotating drum: a closed cylinder that lies on its side, partly filled, turns about its axis, and the bed flows.

    view along +y              ↻ the bottom moves towards −x, so the bed lies higher there
       .-‾‾‾-.
      /'.     \\     y(x) from the drum's centre
     |   '.    |    the axis is parallel to y, at height diameter/2 above z = 0
      \\    '. /
       '-___-'

A thin drum (``axial_length`` of a few bodies) is the quasi-two-dimensional drum of powder testers; a long one is the
drum of a kiln. The end plates are walls that turn with the shell or stand still. The filled volume includes the pores
between the bodies; the density of the solid and an assumed ``packing`` convert it into a mass.
Source of the instrument: Lumay et al. 2012, Powder Technology 224:19; its cell is 84 mm wide.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from solver.params import ParameterError, param
from solver.rigs.feed import BoxFeed
from solver.rigs.rig import EVERYWHERE, FREE_SURFACE, Action, Container, Move, PourRig, Watch
from solver.rigs.surface import FACING_MINUS_Y, FACING_PLUS_Y, Revolved, Surface, SurfacePose, turned_plane

FEED_BOTTOM, FEED_WIDTH, FEED_TOP = 0.1, 0.6, 0.75
"""The feed: between these heights above the axis and within this half width, in radii of the drum. Its upper corners
lie 0.96 radii from the axis."""
TURNED_OVER = 0.5
"""Turns after which the way of filling no longer matters. For 89 beads in a drum of 16 bead diameters, fed at 0.4 and 4
times the rate, the angle after half a turn shows no trend: + 0.7° and + 0.6° with standard errors of 0.4° and 0.5°."""
MOST_FILLED = 0.5
"""Largest share of the drum's volume that may be filled: the feed is above the axis."""


@dataclass(frozen=True)
class RotatingDrum(PourRig):
    """Dimensions, filling, speed and the time over which the free surface is averaged."""

    diameter: float = param(0.200, unit="m", low=0.005, high=5.0, doc="Inner diameter of the drum.")
    axial_length: float = param(0.080, unit="m", low=0.002, high=5.0, doc="Distance between the end plates (y).")
    filled_volume: float = param(8e-4, unit="m3", low=1e-9, high=10.0, doc="Volume of the bed at rest, pores included.")
    packing: float = param(0.55, low=0.1, high=1.0, doc="Solid fraction that converts the filled volume into a mass.")
    speed_rpm: float = param(15.0, unit="rpm", low=0.1, high=300.0, doc="Rotation speed.")
    transient_turns: float = param(0.5, low=0.0, high=100.0, doc="Turns before the free surface is measured.")
    averaging_turns: float = param(1.0, low=0.05, high=1000.0, doc="Turns over which the free surface is averaged.")
    end_plates: str = param(
        "turning",
        doc="turning: the end plates rotate with the shell; standing: they do not.",
        choices=("turning", "standing"),
    )
    wall: str = "rigid_sieve_plate"

    name = "rotating_drum"
    surface_names = ("shell", "front", "back")
    gives = (FREE_SURFACE,)
    quick_changes: ClassVar[Mapping[str, Mapping[str, float]]] = {
        "turned twice as fast": {"rig.speed_rpm": 2.0},
        "turned at half the speed": {"rig.speed_rpm": 0.5},
        "bed 1.3 times as large": {"rig.filled_volume": 1.3},
        "bed 0.7 times as large": {"rig.filled_volume": 0.7},
    }

    @property
    def forgets(self) -> tuple[str, ...]:
        """The settings of the feed, once every body of a bed of up to half the drum has been in the flowing layer."""
        return ("insertion.rate", "insertion.drop_speed") if self.transient_turns >= TURNED_OVER else ()

    @property
    def suits(self) -> Mapping[str, float | str]:
        """Fill the whole feed fast, settle, turn; the rig itself says when it has turned enough."""
        return {
            "insertion.protocol": "fill_then_open",
            "insertion.rate": 0.5,
            "insertion.drop_speed": 0.2,
            "insertion.region_radius": 1.0,
            "insertion.region_height": 1.0,
            "numerics.max_time": 60.0,
        }

    @property
    def radius(self) -> float:
        """Inner radius [m]; also the height of the axis above z = 0."""
        return self.diameter / 2.0

    @property
    def fill_level(self) -> float:
        """Share of the drum's volume that the bed at rest takes."""
        return self.filled_volume / (math.pi * self.radius**2 * self.axial_length)

    @property
    def angular_speed(self) -> float:
        """[rad/s]"""
        return 2.0 * math.pi * self.speed_rpm / 60.0

    @property
    def domain_half_width(self) -> float:
        """Nothing leaves a closed drum: a body outside it is lost."""
        return 1.5 * max(self.diameter, self.axial_length)

    @property
    def running_time(self) -> float:
        """Transient and averaging time [s]."""
        return 60.0 / self.speed_rpm * (self.transient_turns + self.averaging_turns)

    @property
    def watch(self) -> Watch:
        """The free surface after the transient, from the drum's centre."""
        return Watch(60.0 / self.speed_rpm * self.transient_turns, self.radius, self.radius)

    def surfaces(self) -> tuple[Surface, ...]:
        """Shell and end plates, each with its origin on the axis."""
        half = self.axial_length / 2.0
        return (
            Revolved(
                self.radius, -half, self.radius, half, self.wall, SurfacePose((0.0, 0.0, self.radius), FACING_PLUS_Y)
            ),
            turned_plane((0.0, -half, self.radius), FACING_PLUS_Y, self.wall),
            turned_plane((0.0, half, self.radius), FACING_MINUS_Y, self.wall),
        )

    def poured_mass(self, density: float) -> float:
        """Filled volume × packing × density of the solid [kg]."""
        return self.filled_volume * self.packing * density

    def feed(self) -> BoxFeed:
        """A box in the upper half of the drum."""
        return BoxFeed(
            floor=self.radius * (1.0 + FEED_BOTTOM),
            half_x=FEED_WIDTH * self.radius,
            half_y=self.axial_length / 2.0,
            ceiling=self.radius * (1.0 + FEED_TOP),
        )

    def container(self, since: float) -> Container:
        """Everywhere: the drum has no outside."""
        return EVERYWHERE

    def actions(self) -> tuple[Action, ...]:
        """Shell, and end plates if they are fixed to it, turn from when the rig begins to act."""
        turn = (0.0, self.angular_speed, 0.0)
        turning = self.surface_names if self.end_plates == "turning" else ("shell",)
        return tuple(Move(0.0, self.surface_names.index(name), angular_velocity=turn) for name in turning)

    def check(self, widest_body: float) -> None:
        """Refuse a drum that is filled above its axis."""
        if self.fill_level > MOST_FILLED:
            most = MOST_FILLED * self.filled_volume / self.fill_level
            raise ParameterError(
                f"rig.filled_volume: {self.filled_volume:g} m3 is {self.fill_level:.0%} of the drum; "
                f"allowed: up to {most:g} m3"
            )
