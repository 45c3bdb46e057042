"""What `explorer measure` finds: a reading per picture, and the simulated piles beside them."""

from __future__ import annotations

from dataclasses import dataclass

from explorer.photograph.simulated import SimulatedPiles
from solver.photograph import PhotographedPile, Refusal


@dataclass(frozen=True, eq=False)
class Measured:
    """What came out, in the order of the pictures."""

    readings: tuple[PhotographedPile | Refusal, ...]
    simulated: SimulatedPiles | None

    @property
    def piles(self) -> tuple[PhotographedPile, ...]:
        """Of the pictures that show one."""
        return tuple(reading for reading in self.readings if isinstance(reading, PhotographedPile))

    @property
    def refusals(self) -> tuple[Refusal, ...]:
        """Of the others."""
        return tuple(reading for reading in self.readings if isinstance(reading, Refusal))
