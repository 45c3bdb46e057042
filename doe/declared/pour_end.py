"""How a pour outside a study's settings ended, as it is told to whoever listens; light to load."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from solver import Outcome


@dataclass(frozen=True)
class Ended:
    """How one pour ended. ``label``: point and condition.

    A failed pour is not repeated with another seed: the other points suffice for the emulator.
    """

    label: str
    seed: int
    outcome: Outcome
    message: str
    replicate: int = 0
    attempt: int = 0
    wall_s: float = 0.0
    """Wall time of the pour [s]."""
    reused: bool = False
    """Always false here: pours found in the store are not reported."""

    @property
    def title(self) -> str:
        """Its name in lists."""
        return self.label

    @property
    def valid(self) -> bool:
        """Whether the run came to its end."""
        return self.outcome.valid


OnPour = Callable[[str, int, Ended], None]
"""Called with (what is being run, number of pours left, how this pour ended)."""
