"""What a person can do to an existing pile: tap or shake the plate, or pull one body.

The plate follows a displacement u(t) [m] that begins and ends at zero, in pieces of constant velocity whose ends lie
on u. A pull is a constant force on one body's centre of mass. Both act at moments that do not depend on launches.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from solver.params import ParameterError

PLATE = "plate"
"""The surface that is tapped and shaken."""
PIECES = 32
"""Pieces of a tap, and of one period of a shake."""

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Tap:
    """A vertical pulse, up and down again: u(t) = amplitude · sin²(π t/duration), z upwards.

    Its largest velocity is π · amplitude/duration, its largest acceleration 2 π² · amplitude/duration².
    """

    amplitude: float
    """[m]"""
    duration: float
    """[s]"""

    def __post_init__(self) -> None:
        _check("tap: amplitude", self.amplitude, "m", 1e-6, 0.02)
        _check("tap: duration", self.duration, "s", 1e-3, 1.0)

    @property
    def piece(self) -> float:
        """Duration of a piece [s]."""
        return self.duration / PIECES

    @property
    def largest_velocity(self) -> float:
        """[m/s]"""
        return math.pi * self.amplitude / self.duration

    @property
    def largest_acceleration(self) -> float:
        """[m/s²]"""
        return 2.0 * math.pi**2 * self.amplitude / self.duration**2

    def displacement(self, time: float) -> Vector:
        """Displacement of the plate [m], ``time`` [s] after the beginning."""
        return 0.0, 0.0, self.amplitude * math.sin(math.pi * time / self.duration) ** 2

    def __str__(self) -> str:
        return f"the plate is tapped: up by {1e3 * self.amplitude:g} mm and back within {1e3 * self.duration:g} ms"


@dataclass(frozen=True)
class Shake:
    """``periods`` whole periods along x: u(t) = amplitude · sin(2 π frequency t).

    The largest velocity, at the beginning and the end too, is 2 π · frequency · amplitude; the largest acceleration
    (2 π · frequency)² · amplitude.
    """

    amplitude: float
    """[m]"""
    frequency: float
    """[1/s]"""
    periods: int = 10

    def __post_init__(self) -> None:
        _check("shake: amplitude", self.amplitude, "m", 1e-6, 0.02)
        _check("shake: frequency", self.frequency, "Hz", 0.5, 200.0)
        _check("shake: periods", self.periods, "", 1, 1000)

    @property
    def duration(self) -> float:
        """[s]"""
        return self.periods / self.frequency

    @property
    def piece(self) -> float:
        """Duration of a piece [s]."""
        return 1.0 / self.frequency / PIECES

    @property
    def largest_velocity(self) -> float:
        """[m/s]"""
        return 2.0 * math.pi * self.frequency * self.amplitude

    @property
    def largest_acceleration(self) -> float:
        """[m/s²]"""
        return (2.0 * math.pi * self.frequency) ** 2 * self.amplitude

    def displacement(self, time: float) -> Vector:
        """Displacement of the plate [m], ``time`` [s] after the beginning."""
        # Whole periods are subtracted first, so that the plate ends exactly where it began.
        phase = math.fmod(time * self.frequency, 1.0) if time < self.duration else 0.0
        return self.amplitude * math.sin(2.0 * math.pi * phase), 0.0, 0.0

    def __str__(self) -> str:
        return (
            f"the plate is shaken along x: ± {1e3 * self.amplitude:g} mm at {self.frequency:g} Hz, "
            f"{self.periods} periods"
        )


@dataclass(frozen=True)
class Pull:
    """A force on the centre of mass of one body for as long as it is held.

    ``body``: by its order of entry, from 0; in words it is counted from 1.
    """

    body: int
    force: Vector
    """[N]"""

    def __post_init__(self) -> None:
        for component in self.force:
            _check("pull: force", component, "N", -10.0, 10.0)

    def __str__(self) -> str:
        x, y, z = (1e3 * component for component in self.force)
        return f"body no. {self.body + 1} is pulled with ({x:.3g}, {y:.3g}, {z:.3g}) mN"


PlateMotion = Tap | Shake


def _check(what: str, number: float, unit: str, low: float, high: float) -> None:
    if not (math.isfinite(number) and low <= number <= high):
        raise ParameterError(f"{what}: {number!r} is outside {low:g} … {high:g} {unit}".rstrip())
