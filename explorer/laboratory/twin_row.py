"""The result of a virtual twin, and which tests have one; nothing here loads the solver."""

from __future__ import annotations

import math
from dataclasses import dataclass

from doe.record import Record
from explorer.errors import CommandError

CLOSES = 0.01
"""Largest relative deviation at which a round trip closes."""
RIGS = {
    "inclined_plane": "inclined_plane",
    "drop": "drop_plate_45",
    "rebound": "inclined_plane",
    "rolling": "inclined_plane",
    "compression": "compression",
    "shear": "compression",
}
"""Rig of each test that has a twin; a rebound is run on the plane while it is level."""
LIKE = {
    "bulk_density": "explorer simulate lifting_cylinder (bulk_density_kg_m3, solid_fraction of the pile)",
    "drum": "explorer simulate rotating_drum (dynamic_angle_deg)",
    "draw_down": "explorer simulate draw_down_box (draw_down_angle_deg, angle_of_repose_deg@0, discharge)",
}
"""For a test without a twin: the command that simulates a similar test, with a whole material instead of its result."""


@dataclass(frozen=True)
class TwinRow(Record):
    """One quantity of one twin, SI; None for a missing value.

    error: simulated over put_in, minus one; over measured if nothing was put in. closes: whether the round trip closes;
    None for a row that shows a bias.
    """

    of: tuple[str, ...]
    quantity: str
    unit: str
    measured: float | None
    put_in: float | None
    simulated: float
    closes: bool | None

    @property
    def error(self) -> float:
        """Relative deviation of ``simulated``."""
        reference = self.put_in if self.put_in is not None else self.measured
        return self.simulated / reference - 1.0 if reference else math.nan


def check_twin(test: str) -> None:
    """Raise CommandError for a test that has no rig."""
    if test not in RIGS:
        like = f"; its like is {LIKE[test]}" if test in LIKE else ""
        raise CommandError(f"--simulate: {test} has no rig{like}; allowed: {', '.join(RIGS)}")
