"""What is true of one made-up laboratory, drawn by its seed: parameters within their measured uncertainty, and what
acts that the declared model lacks."""

from dataclasses import dataclass

import numpy as np

from doe.diagnose.emulator import Emulator
from doe.diagnose.plan import amplitudes
from doe.diagnose.signatures import projected, shift_of

REPLICATES = 6
STRENGTHS = (4.0, 6.0, 10.0)
"""Projected, whitened shift of the summaries in standard errors of a data set."""


@dataclass(frozen=True)
class Truth:
    """``kind``: null, effect, pair or outside. ``effects``: library effects with amplitudes in natural units.

    ``outside``: name of an effect of ``tests/blind/outside.py``. ``strength`` is NaN where it is not defined.
    """

    seed: int
    kind: str
    theta: tuple[float, ...]
    effects: tuple[tuple[str, tuple[float, ...]], ...] = ()
    outside: str = ""
    strength: float = float("nan")

    @property
    def label(self) -> str:
        """The name a right answer gives, or that of the outside effect."""
        return "+".join(name for name, _ in self.effects) or self.outside or "none"


def draw_theta(declared, rng):
    """Parameters drawn from their independent measurement, within their ranges."""
    return tuple(
        float(np.clip(rng.normal(p.mean, p.sd), p.low, p.high)) if p.mean is not None else rng.uniform(p.low, p.high)
        for p in declared.parameters
    )


def amplitude_for(emulator: Emulator, frame, effect: int, theta, strength: float, direction):
    """Coded amplitudes along ``direction`` at which effect ``effect`` shifts by ``strength`` σ, None if out of bounds.

    Bisection on the share of the bound; the shift is taken to grow along it.
    """

    def shift(share):
        return float(np.linalg.norm(projected(frame, shift_of(emulator, effect, theta, share * direction))))

    if shift(1.0) < strength:
        return None
    low, high = 0.0, 1.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if shift(middle) < strength else (low, middle)
    return high * direction


def direction_of(effect, rng):
    """Coded direction in which an effect's amplitudes are let grow: a sign, or an angle in the plane."""
    choices = [np.array(one) / effect.scale for one in amplitudes(effect)]
    one = choices[int(rng.integers(len(choices)))]
    return one / np.abs(one).max()
