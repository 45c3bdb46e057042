"""Contents of a measured data set as frozen dataclasses: parameters with ranges, conditions with observations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np
import numpy.typing as npt

from doe.measurement.bodies import MeasuredBody
from doe.measurement.scans import UpperSurface
from doe.record import Record
from solver import Scene

Array = npt.NDArray[np.float64]
Role = Literal["fit", "holdout"]


@dataclass(frozen=True)
class MeasuredParameter(Record):
    """A parameter that calibration may move within ``low`` … ``high``, and its independently measured value; SI."""

    path: str
    low: float
    high: float
    mean: float | None
    sd: float | None
    unit: str = "1"


@dataclass(frozen=True, eq=False)
class Observation(Record):
    """One observable of one condition, SI."""

    observable: str
    unit: str
    x: Array | None
    """Places of a curve, ascending, shape (k,); None for a scalar."""
    values: Array
    """One row per replicate, shape (r,) or (r, k); NaN where nothing was measured."""
    uncertainty: float | None
    """Standard deviation of one value where replicates cannot give it."""
    origin: Literal["table", "piles", "photographs", "profile"] = "table"
    """Source of the values: the table, the scanned or photographed piles, or the surface profile in the table."""


@dataclass(frozen=True, eq=False)
class Condition:
    """One set-up, poured ``replicates`` times. ``scene`` reproduces it in a simulation."""

    name: str
    role: Role
    scene: Scene
    replicates: int
    observations: tuple[Observation, ...]
    mean_of: int = 1
    """Number of pours of which each listed value is the mean; more than one where only means were published."""
    surfaces: Mapping[int, UpperSurface] = field(default_factory=dict)
    """Upper surfaces of the piles by replicate, counted from 1."""
    turned: bool = False
    """Whether the rig stood turned by 180° on its bench. Positions are those in the rig's own frame."""

    @property
    def offered(self) -> dict[str, Observation]:
        """Observations by the name of their observable."""
        return {observation.observable: observation for observation in self.observations}


@dataclass(frozen=True)
class CrossCheck(Record):
    """An observable that the file states and that was also computed here from raw data."""

    condition: str
    observable: str
    unit: str
    ours: float
    """Mean over replicates (and places of a curve)."""
    theirs: float
    rms: float
    """Root of the mean squared difference of single values."""


@dataclass(frozen=True, eq=False)
class Measurement:
    """A measured data set, read and checked."""

    folder: Path
    title: str
    scene: Scene
    """The declared base model in its own rig; each condition holds its own."""
    parameters: tuple[MeasuredParameter, ...]
    conditions: tuple[Condition, ...]
    ignored: tuple[str, ...]
    """Contents of the folder that are not used, each with the reason."""
    notes: tuple[str, ...] = ()
    """Changes made while reading, such as a clipped range."""
    cross_check: tuple[CrossCheck, ...] = ()
    bodies: tuple[MeasuredBody, ...] = ()
    """Measurements of single bodies."""

    @property
    def fit(self) -> tuple[Condition, ...]:
        """Conditions that may be fitted."""
        return tuple(condition for condition in self.conditions if condition.role == "fit")

    @property
    def holdout(self) -> tuple[Condition, ...]:
        """Conditions that are only predicted."""
        return tuple(condition for condition in self.conditions if condition.role == "holdout")
