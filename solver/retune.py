"""Changing the stiffness of a resting pile without blowing it up.

A stiffer contact at the same overlap holds more energy. The new constants are therefore approached over at least
``RAMP_TIME``, tangential springs keep their displacement (their force scales with G*), the time step is recomputed
first, and the energy that the change put in is added up and shown.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

RAMP_TIME = 0.02
"""Duration of a change of stiffness [s]; at least 10 ms."""
RAMP_STEPS = 100
"""Number of steps in which the constants are changed."""

STIFFNESS = (0, 1, 3, 4)
"""Columns of the law table that are ramped: E*, G* and the dampings ∝ √E*, √G*; friction acts at once."""


@dataclass(frozen=True)
class Ramp:
    """From one law table (kinds, kinds, 5) to another, starting at ``start`` [s]; geometric in the stiffness."""

    before: Array
    after: Array
    start: float

    def table(self, time: float) -> Array:
        """Law table at ``time`` [s]: stiffness E*(t) = E₀ (E₁/E₀)^s with s = (t − start)/RAMP_TIME in 0…1."""
        s = min(1.0, max(0.0, (time - self.start) / RAMP_TIME))
        table = self.after.copy()
        for column in STIFFNESS:
            old, new = self.before[..., column], self.after[..., column]
            ramped = (old > 0.0) & (new > 0.0)
            table[..., column][ramped] = old[ramped] * (new[ramped] / old[ramped]) ** s
        return table

    def over(self, time: float) -> bool:
        """True once ``table`` has reached ``after``."""
        return time >= self.start + RAMP_TIME


def spring_ratio(before: Array, after: Array) -> Array:
    """Factor (kinds, kinds) by which tangential forces scale when G* changes at the same displacement."""
    old, new = before[..., 1], after[..., 1]
    return np.divide(new, old, out=np.ones_like(old), where=old > 0.0)
