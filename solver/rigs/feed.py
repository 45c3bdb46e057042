"""Where bodies enter a rig: the opening above which they are placed, entirely within its outline.

``reach`` is ``insertion.region_radius`` throughout: it narrows the opening, so that a feed can be a thin stream.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from solver.params import ParameterError

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class RoundFeed:
    """A round opening of ``radius`` [m] about the z axis at height ``floor`` [m], open to the sky."""

    floor: float
    radius: float
    ceiling: float = math.inf
    """Nothing of a body may stick out above this height [m]."""

    @property
    def half_width(self) -> float:
        """Largest |x| or |y| [m]."""
        return self.radius

    def draw(self, reach: float, rng: np.random.Generator) -> tuple[float, float]:
        """A place (x, y) [m], uniform over the disc of radius ``reach``."""
        angle, spread = rng.uniform(0.0, 2.0 * np.pi), np.sqrt(rng.uniform())
        radius = reach * spread
        return radius * np.cos(angle), radius * np.sin(angle)

    def holds(self, centres: Array, radii: Array, reach: float) -> bool:
        """True if spheres at ``centres`` (n, 3) with ``radii`` (n,) [m] lie within ``reach`` of the axis."""
        return bool((np.hypot(centres[:, 0], centres[:, 1]) + radii).max() <= reach)

    def check(self, reach: float, longest_body: float) -> None:
        """Refuse a feed that is wider than the opening or into which a body of ``longest_body`` [m] does not fit."""
        if reach > self.radius:
            raise ParameterError(
                f"insertion.region_radius: {reach:g} m is wider than the feed opening; allowed: up to {self.radius:g} m"
            )
        _refuse_narrow(reach, longest_body)


@dataclass(frozen=True)
class BoxFeed:
    """A rectangular opening |x| ≤ ``half_x``, |y| ≤ ``half_y`` [m] at height ``floor`` [m]."""

    floor: float
    half_x: float
    half_y: float
    ceiling: float = math.inf
    """Nothing of a body may stick out above this height [m]."""

    @property
    def half_width(self) -> float:
        """Largest |x| or |y| [m]."""
        return max(self.half_x, self.half_y)

    def draw(self, reach: float, rng: np.random.Generator) -> tuple[float, float]:
        """A place (x, y) [m], uniform over the part of the opening with |x|, |y| ≤ ``reach``."""
        x, y = min(self.half_x, reach), min(self.half_y, reach)
        return float(rng.uniform(-x, x)), float(rng.uniform(-y, y))

    def holds(self, centres: Array, radii: Array, reach: float) -> bool:
        """True if spheres at ``centres`` (n, 3) with ``radii`` (n,) [m] lie in that part of the opening."""
        x, y = min(self.half_x, reach), min(self.half_y, reach)
        outer = np.abs(centres[:, :2]) + radii[:, None]
        return bool(outer[:, 0].max() <= x and outer[:, 1].max() <= y)

    def check(self, reach: float, longest_body: float) -> None:
        """Refuse an opening or a feed into which a body of ``longest_body`` [m] does not fit."""
        room = min(2.0 * self.half_x, 2.0 * self.half_y, self.ceiling - self.floor)
        if room <= longest_body:
            raise ParameterError(
                f"rig: the feed opening is {room:g} m at its narrowest, too narrow for a body of {longest_body:g} m; "
                f"allowed: more than {longest_body:g} m"
            )
        _refuse_narrow(reach, longest_body)


Feed = RoundFeed | BoxFeed


def _refuse_narrow(reach: float, longest_body: float) -> None:
    if 2.0 * reach <= longest_body:
        raise ParameterError(
            f"insertion.region_radius: {reach:g} m is too narrow for a body of {longest_body:g} m; "
            f"allowed: more than {longest_body / 2.0:g} m"
        )
