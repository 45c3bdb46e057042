"""What a virtual twin returns, and which tests have one; nothing here loads the solver."""

from __future__ import annotations

import math
from dataclasses import dataclass

from doe.record import Record
from explorer.errors import CommandError

CLOSES = 0.01
"""Largest relative deviation of a round trip that closes."""
RIGS = {
    "inclined_plane": "inclined_plane",
    "drop": "drop_plate_45",
    "compression": "compression",
    "shear": "compression",
}
"""Rig of each test that has a twin."""


@dataclass(frozen=True)
class TwinRow(Record):
    """One quantity of one twin, SI; None where there is none.

    error: simulated over what was put in, less one; over what was measured where nothing was put in. closes: whether
    the round trip does, None for a row that shows a bias.
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
        raise CommandError(f"--simulate: {test} has no rig; allowed: {', '.join(RIGS)}")
