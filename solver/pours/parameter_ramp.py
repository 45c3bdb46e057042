"""Changing the stiffness of a resting pile without blowing it up.

A stiffer contact at the same overlap holds more energy. The new constants are therefore approached over at least
``RAMP_TIME`` (the contact law says which of them; friction acts at once), tangential springs keep their displacement
(their force scales with k_t), the time step is recomputed first, and the energy that the change puts in is summed and
shown.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from solver.laws import ContactLaw

Array = npt.NDArray[np.float64]

RAMP_TIME = 0.02
"""Duration of a change of stiffness [s]; at least 10 ms."""
RAMP_STEPS = 100
"""Number of steps in which the constants are changed."""


@dataclass(frozen=True)
class Ramp:
    """From one law table (kinds, kinds, columns) to another, starting at ``start`` [s]; geometric in the stiffness."""

    law: type[ContactLaw]
    before: Array
    after: Array
    start: float

    def table(self, time: float) -> Array:
        """Law table at ``time`` [s]: stiffness E*(t) = E₀ (E₁/E₀)^s with s = (t − start)/RAMP_TIME in 0…1."""
        s = min(1.0, max(0.0, (time - self.start) / RAMP_TIME))
        table = self.after.copy()
        for column in map(self.law.columns.index, self.law.ramped):
            old, new = self.before[..., column], self.after[..., column]
            ramped = (old > 0.0) & (new > 0.0)
            table[..., column][ramped] = old[ramped] * (new[ramped] / old[ramped]) ** s
        return table

    def over(self, time: float) -> bool:
        """True once ``table`` has reached ``after``."""
        return time >= self.start + RAMP_TIME


def spring_ratio(law: type[ContactLaw], before: Array, after: Array) -> Array:
    """Factor (kinds, kinds) by which tangential forces scale when k_t changes at the same displacement."""
    old, new = (table[..., law.columns.index(law.spring_column)] for table in (before, after))
    return np.divide(new, old, out=np.ones_like(old), where=old > 0.0)
