"""Settings and their runs: one row of a design, its results, and tables of an observable over settings and replicates.

Nothing here pours, so that code that only reads results does not load the solver.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from doe.analysis.t_tests import Sample
from doe.record import Record
from solver import Outcome

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Setting(Record):
    """One row of a design: the values that differ from the study's scene, and the number of replicates."""

    label: str
    values: dict[str, float | str]
    replicates: int
    experiments: tuple[str, ...] = ("",)
    """Names of the study's experiments that are run; "" is the study's own rig."""


@dataclass(frozen=True)
class Run(Record):
    """One run of a setting. ``attempt``: number of failed runs that it replaces."""

    label: str
    replicate: int
    attempt: int
    seed: int
    outcome: str
    message: str
    observables: dict[str, float | None]
    wall_s: float
    key: str
    reused: bool = False
    """True if it was found in the store."""
    experiment: str = ""
    """Name of the experiment that was run; its name and "/" precede the names of its observables."""

    @property
    def title(self) -> str:
        """The label of the setting, and the experiment if it is not the study's own rig."""
        return f"{self.label}, {self.experiment}" if self.experiment else self.label

    @property
    def valid(self) -> bool:
        """True if the readings of the run count: the pile came to rest, or the rig ran for its full time."""
        return Outcome(self.outcome).valid


class Runner(Protocol):
    """Anything that can run settings: pours, or a formula in a test."""

    def run(self, stage: str, settings: Sequence[Setting]) -> list[list[Run]]:
        """Return all runs of every setting, failed ones included, in the order of the settings."""
        ...


def responses(rows: Sequence[Sequence[Run]], observable: str) -> FloatArray:
    """Return the matrix (settings, replicates) of an observable; NaN where a replicate has no valid run."""
    width = max((run.replicate + 1 for runs in rows for run in runs), default=0)
    table = np.full((len(rows), width), np.nan)
    for k, runs in enumerate(rows):
        for run in runs:
            found = run.observables.get(observable)
            if run.valid and found is not None:
                table[k, run.replicate] = found
    return table


def sample_of(runs: Iterable[Run], observable: str) -> Sample:
    """Return the summary of an observable over the valid runs in which it was measured; NaN where there are none."""
    values = valid_values(runs, observable)
    return Sample.of(values) if values else Sample(math.nan, math.nan, 0)


def valid_values(runs: Iterable[Run], observable: str) -> list[float]:
    """Return the values of an observable over the valid runs in which it was measured."""
    found = (run.observables.get(observable) for run in runs if run.valid)
    return [value for value in found if value is not None]


def no_pile_shares(rows: Sequence[Sequence[Run]]) -> FloatArray:
    """Return the share of runs of each setting that gave no pile, replacements included, shape (settings,)."""
    return np.array([np.mean([not run.valid for run in runs]) if runs else np.nan for runs in rows])
