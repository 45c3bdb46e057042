"""The declared model that a diagnosis works with: calibrated parameters, candidate effects, conditions and summaries.

A condition is one rig set-up; its summaries are the d_c numbers read from one pour. Parameters are calibrated within
[low, high] and are expressed as differences from their ``middle`` in units of their ``deviation``. In the base model
every effect is off, at amplitude zero.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.errors import StatisticsError
from doe.measurement.measurement import MeasuredParameter, Measurement
from doe.measurement.summaries import summary_names
from doe.record import Record
from solver import EFFECTS, ParameterError, Scene, parameters, with_values

FloatArray = npt.NDArray[np.float64]

BOX = 3.0
"""Half width of the interval about an independently measured mean in which a parameter is believed to lie [standard
deviations]."""
DRAWN_IN = 0.8


@dataclass(frozen=True)
class CalibratedParameter(Record):
    """A calibrated parameter, natural units: its range, and mean ± sd where it was measured independently.

    Raises StatisticsError unless low < high, and sd > 0 where there is a mean.
    """

    name: str
    low: float
    high: float
    mean: float | None = None
    sd: float | None = None

    def __post_init__(self) -> None:
        if not self.low < self.high:
            raise StatisticsError(f"{self.name}: low = {self.low:g}, high = {self.high:g}; allowed is low < high")
        if (self.mean is None) != (self.sd is None) or (self.sd is not None and not self.sd > 0):
            raise StatisticsError(
                f"{self.name}: mean = {self.mean}, sd = {self.sd}; allowed are both with sd > 0, or none"
            )

    @property
    def middle(self) -> float:
        """The measured mean, or the middle of the range."""
        return self.mean if self.mean is not None else (self.low + self.high) / 2.0

    @property
    def deviation(self) -> float:
        """The measurement's standard deviation, or that of a uniform distribution over the range, its width ÷ √12."""
        return self.sd if self.sd is not None else (self.high - self.low) / math.sqrt(12.0)

    def within(self, value: float) -> float:
        """``value``, clipped to the range."""
        return min(self.high, max(self.low, value))

    def natural(self, theta: float) -> float:
        """The value in natural units at ``theta`` deviations from the middle, clipped to the range."""
        return self.within(self.middle + theta * self.deviation)

    def theta(self, value: float) -> float:
        """The difference of ``value`` [natural units] from the middle, in deviations."""
        return (value - self.middle) / self.deviation


@dataclass(frozen=True)
class CandidateEffect(Record):
    """A candidate effect with one or two amplitudes, each in a range [low, high] that contains zero (off).

    Raises StatisticsError for another number of amplitudes or a range without zero.
    """

    name: str
    low: tuple[float, ...]
    high: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.low) != len(self.high) or len(self.low) not in (1, 2):
            raise StatisticsError(f"{self.name}: {len(self.low)} lower, {len(self.high)} upper bounds; allowed: 1 or 2")
        if not all(low <= 0 <= high and low < high for low, high in zip(self.low, self.high, strict=True)):
            raise StatisticsError(f"{self.name}: bounds {self.low} to {self.high} must contain 0, where it is off")

    @property
    def amplitudes(self) -> int:
        """Number of amplitudes."""
        return len(self.low)


@dataclass(frozen=True)
class DeclaredCondition(Record):
    """A rig set-up, and the names of the summaries read from each of its pours."""

    name: str
    summaries: tuple[str, ...]


@dataclass(frozen=True)
class Declared(Record):
    """The declared model: calibrated parameters, candidate effects and conditions with their summaries."""

    parameters: tuple[CalibratedParameter, ...]
    effects: tuple[CandidateEffect, ...]
    conditions: tuple[DeclaredCondition, ...]

    def natural(self, theta: Sequence[float] | FloatArray) -> tuple[float, ...]:
        """Parameters in natural units at ``theta`` (k,) deviations from their middles."""
        return tuple(p.natural(float(one)) for p, one in zip(self.parameters, theta, strict=True))

    def theta(self, values: Sequence[float]) -> FloatArray:
        """Differences (k,) of parameters ``values`` [natural units] from their middles, in deviations."""
        return np.array([p.theta(one) for p, one in zip(self.parameters, values, strict=True)])


def declare(measurement: Measurement, effects: Sequence[str]) -> Declared:
    """The declared model: parameters, effects with their widest ranges, fitted conditions.

    Not candidates: effects that a scene's contact law cannot carry, and effects whose amplitude is a parameter.
    """
    scenes = [condition.scene for condition in measurement.conditions]
    known = {effect_of(p.path) for p in measurement.parameters}
    effects = [name for name in effects if name not in known and all(scene.contact.carries(name) for scene in scenes)]
    # Every effect has to be possible at both ends of each calibrated amplitude.
    amplitudes = [p for p in measurement.parameters if effect_of(p.path)]
    scenes = [
        with_values(one.scene, {p.path: in_rig_frame(p.path, getattr(p, end), one.turned) for p in amplitudes})
        for one in measurement.conditions
        for end in (("low", "high") if amplitudes else ("low",))
    ]
    return Declared(
        tuple(box_of(p) for p in measurement.parameters),
        tuple(widest(name, scenes) for name in effects),
        tuple(DeclaredCondition(c.name, summary_names(c)) for c in measurement.fit),
    )


def widest(name: str, scenes: Sequence[Scene]) -> CandidateEffect:
    """The effect over the range that the literature supports, narrowed until every scene can be set up with it."""
    kind, known = EFFECTS[name], parameters(scenes[0])
    ends = [known[f"effect.{name}.{field}"] for field in kind.amplitudes]
    low = tuple(max(end.low, -kind.strongest) for end in ends)
    high = tuple(min(end.high, kind.strongest) for end in ends)
    while not all(possible(scene, name, bounds) for scene in scenes for bounds in (low, high)):
        low, high = tuple(DRAWN_IN * x for x in low), tuple(DRAWN_IN * x for x in high)
    return CandidateEffect(name, low, high)


def effect_values(effect: str, amplitude: Sequence[float], turned: bool = False) -> dict[str, float]:
    """Parameter path → value of an effect's amplitudes; ``turned``: for a rig that is turned by 180° on its bench."""
    paths = (f"effect.{effect}.{name}" for name in EFFECTS[effect].amplitudes)
    return {path: in_rig_frame(path, one, turned) for path, one in zip(paths, amplitude, strict=True)}


def in_rig_frame(path: str, amplitude: float, turned: bool) -> float:
    """The value of the parameter ``path`` in the frame of the rig: in a rig that is ``turned`` by 180° on its bench,
    effects that stay with the bench change sign.
    """
    effect = effect_of(path)
    return -amplitude if turned and effect and EFFECTS[effect].on_bench else amplitude


def effect_of(path: str) -> str:
    """The effect that has the parameter ``path`` as an amplitude; "" for any other parameter."""
    kind, _, rest = path.partition(".")
    name, _, field = rest.partition(".")
    return name if kind == "effect" and name in EFFECTS and field in EFFECTS[name].amplitudes else ""


def possible(scene: Scene, name: str, amplitude: tuple[float, ...]) -> bool:
    """Whether ``scene`` can be set up with an effect of ``amplitude``."""
    try:
        with_values(scene, effect_values(name, amplitude))
    except ParameterError:
        return False
    return True


def box_of(measured: MeasuredParameter) -> CalibratedParameter:
    """The range over which a parameter is simulated: as stated, and within ``BOX`` standard deviations of its mean.

    Nobody who trusts the measurement would look outside it.
    """
    if measured.mean is None or measured.sd is None:
        return CalibratedParameter(measured.path, measured.low, measured.high)
    low = max(measured.low, measured.mean - BOX * measured.sd)
    high = min(measured.high, measured.mean + BOX * measured.sd)
    return CalibratedParameter(measured.path, low, high, measured.mean, measured.sd)
