"""What is declared, what was simulated and what was measured, as the diagnosis takes them.

A condition is one rig set-up; its summaries are the d_c numbers read from one pour. Parameters are calibrated
within [low, high]; an effect is off in the base model, at amplitude zero. Inside the diagnosis a parameter is coded to
[-1, 1] and an amplitude is divided by its larger bound, so that zero stays zero.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from doe.errors import StatisticsError
from doe.record import Record

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]

BASE = -1
"""Index of the base model where runs name their effect."""

CONSTANT_FLOOR = 1e-3
"""Standard deviation, as a share of the larger value, given to a summary that never varies in the runs."""


@dataclass(frozen=True)
class Parameter(Record):
    """A calibrated parameter, natural units: range of measurement, and mean ± sd where it was measured independently.

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

    def coded(self, value: FloatArray | float) -> FloatArray:
        """Return (value - centre)/half-width."""
        return (np.asarray(value, dtype=np.float64) - (self.low + self.high) / 2) * 2 / (self.high - self.low)

    def natural(self, coded: float) -> float:
        """Return centre + coded x half-width."""
        return (self.low + self.high) / 2 + coded * (self.high - self.low) / 2


@dataclass(frozen=True)
class Effect(Record):
    """A candidate effect with one or two amplitudes, each within [low, high] around or above zero (off).

    unseen: shift [standard errors] by the whole range, where that was too small to simulate more of it; else None.
    Raises StatisticsError for another number of amplitudes or a range without zero.
    """

    name: str
    low: tuple[float, ...]
    high: tuple[float, ...]
    unseen: float | None = None

    def __post_init__(self) -> None:
        if len(self.low) != len(self.high) or len(self.low) not in (1, 2):
            raise StatisticsError(f"{self.name}: {len(self.low)} lower, {len(self.high)} upper bounds; allowed: 1 or 2")
        if not all(low <= 0 <= high and low < high for low, high in zip(self.low, self.high, strict=True)):
            raise StatisticsError(f"{self.name}: bounds {self.low} to {self.high} must contain 0, where it is off")

    @property
    def amplitudes(self) -> int:
        """Return the number of amplitudes."""
        return len(self.low)

    @property
    def scale(self) -> FloatArray:
        """Return the larger bound of each amplitude, the unit of its coded value."""
        return np.maximum(np.abs(self.low), np.abs(self.high)).astype(np.float64)


@dataclass(frozen=True)
class Condition(Record):
    """A set-up and the names of the summaries read from each of its pours."""

    name: str
    summaries: tuple[str, ...]


@dataclass(frozen=True)
class Declared(Record):
    """The declared model: calibrated parameters, candidate effects and conditions with their summaries."""

    parameters: tuple[Parameter, ...]
    effects: tuple[Effect, ...]
    conditions: tuple[Condition, ...]

    def coded(self, theta: FloatArray) -> FloatArray:
        """Return parameters in natural units, (..., k), coded."""
        return np.stack([p.coded(theta[..., i]) for i, p in enumerate(self.parameters)], axis=-1)

    @property
    def labels(self) -> tuple[str, ...]:
        """Return "condition: summary" of every summary, in the order of the residual vector."""
        return tuple(f"{c.name}: {s}" for c in self.conditions for s in c.summaries)


@dataclass(frozen=True)
class Runs:
    """Simulated pours. theta: (n, k) natural units. effect: (n,), index of the effect that is on, or BASE.

    amplitude: (n, 2) natural units, the second column zero for effects with one. blocks: per condition (n, d_c), NaN
    where that condition was not simulated; a row with any NaN is left out of that condition.
    """

    theta: FloatArray
    effect: IntArray
    amplitude: FloatArray
    blocks: tuple[FloatArray, ...]

    def __post_init__(self) -> None:
        n = self.theta.shape[0]
        shapes = {self.effect.shape == (n,), self.amplitude.shape == (n, 2), *(b.shape[0] == n for b in self.blocks)}
        if self.theta.ndim != 2 or shapes != {True}:
            raise StatisticsError(
                f"runs: theta {self.theta.shape}, effect {self.effect.shape}, amplitude {self.amplitude.shape} and "
                f"blocks {[b.shape for b in self.blocks]} must agree in their number of rows, amplitude with 2 columns"
            )

    def simulated(self, condition: int) -> BoolArray:
        """Return which rows hold a complete pour of the condition, shape (n,)."""
        return np.asarray(np.isfinite(self.blocks[condition]).all(axis=1))


@dataclass(frozen=True)
class Observed:
    """Measured replicates per condition, (r_c, d_c), and the instrument's systematic sd per summary, (d_c,).

    A replicate with a missing summary is left out; systematic error is not reduced by averaging. mean_of: per condition
    the pours behind each replicate, where only their mean is known; empty stands for one.
    """

    blocks: tuple[FloatArray, ...]
    instrument: tuple[FloatArray, ...]
    mean_of: tuple[int, ...] = ()

    def complete(self, condition: int) -> FloatArray:
        """Return the complete replicates of a condition, shape (r, d_c)."""
        block = self.blocks[condition]
        return np.asarray(block[np.isfinite(block).all(axis=1)])

    def pours(self, condition: int) -> int:
        """Return the number of pours behind each replicate of a condition."""
        return self.mean_of[condition] if self.mean_of else 1


@dataclass(frozen=True)
class Selected:
    """The summaries that can be compared. dropped: constant and equal in runs and data, by label.

    floors: per condition (d_c,), standard deviation of one pour assumed for a summary that is constant in the runs
    but not equal in the data (then named in `floored`); zero elsewhere. kept: per condition the places of the summaries
    that are left.
    """

    declared: Declared
    runs: Runs
    observed: Observed
    dropped: tuple[str, ...]
    floored: tuple[str, ...]
    floors: tuple[FloatArray, ...]
    kept: tuple[IntArray, ...]


def require_agreement(declared: Declared, runs: Runs, observed: Observed) -> None:
    """Raise StatisticsError where runs or data do not have the declared shapes or a condition has too few rows."""
    k, effects = len(declared.parameters), len(declared.effects)
    if runs.theta.shape[1] != k:
        raise StatisticsError(f"runs.theta has {runs.theta.shape[1]} columns; declared are {k} parameters")
    if len(runs.effect) and not BASE <= runs.effect.min() <= runs.effect.max() < effects:
        raise StatisticsError(f"runs.effect holds {runs.effect.max()}; allowed is {BASE} to {effects - 1}")
    sizes = (len(runs.blocks), len(observed.blocks), len(observed.instrument))
    if sizes != (len(declared.conditions),) * 3:
        raise StatisticsError(f"blocks of runs, data, instrument: {sizes}; declared: {len(declared.conditions)}")
    for c, condition in enumerate(declared.conditions):
        d = len(condition.summaries)
        widths = (runs.blocks[c].shape[-1], observed.blocks[c].shape[-1], observed.instrument[c].size)
        if widths != (d, d, d):
            raise StatisticsError(f"{condition.name}: {widths} summaries in runs, data, instrument; declared are {d}")
        if not len(observed.complete(c)):
            raise StatisticsError(
                f"{condition.name}: no measured replicate has all of {', '.join(condition.summaries)}"
            )


def select_summaries(declared: Declared, runs: Runs, observed: Observed) -> Selected:
    """Leave out summaries that say nothing, and give a floor to those that vary in the data only.

    The floor is the replicate standard deviation of the data, or 0.1 % of the larger value where that is zero too.
    Raises StatisticsError when the shapes disagree or a condition keeps no summary.
    """
    require_agreement(declared, runs, observed)
    dropped, floored, kept, floors = [], [], [], []
    for c, condition in enumerate(declared.conditions):
        simulated, measured = runs.blocks[c][runs.simulated(c)], observed.complete(c)
        if not len(simulated):
            raise StatisticsError(f"{condition.name}: no complete pour among the runs")
        constant = np.ptp(simulated, axis=0) <= dust(simulated)
        same = constant & (np.abs(measured - simulated[0]) <= dust(simulated)).all(axis=0)
        spread = measured.std(axis=0, ddof=1) if len(measured) > 1 else np.zeros(measured.shape[1])
        largest = np.maximum(np.abs(measured).max(axis=0), np.abs(simulated[0]))
        floor = np.where(constant, np.where(spread > 0, spread, CONSTANT_FLOOR * largest), 0.0)
        names = [f"{condition.name}: {s}" for s in condition.summaries]
        dropped += [name for name, out in zip(names, same, strict=True) if out]
        floored += [name for name, low in zip(names, constant & ~same, strict=True) if low]
        if same.all():
            raise StatisticsError(f"{condition.name}: every summary is constant and equal in runs and data")
        kept.append(np.flatnonzero(~same))
        floors.append(floor[~same])
    return Selected(
        declared=replace(
            declared,
            conditions=tuple(
                replace(condition, summaries=tuple(condition.summaries[i] for i in keep))
                for condition, keep in zip(declared.conditions, kept, strict=True)
            ),
        ),
        runs=replace(runs, blocks=tuple(b[:, keep] for b, keep in zip(runs.blocks, kept, strict=True))),
        observed=Observed(
            tuple(b[:, keep] for b, keep in zip(observed.blocks, kept, strict=True)),
            tuple(i[keep] for i, keep in zip(observed.instrument, kept, strict=True)),
            observed.mean_of,
        ),
        dropped=tuple(dropped),
        floored=tuple(floored),
        floors=tuple(floors),
        kept=tuple(kept),
    )


def dust(values: FloatArray) -> FloatArray:
    """Return what rounding alone may add, per column."""
    return 8 * math.ulp(1.0) * np.abs(values).max(axis=0)
