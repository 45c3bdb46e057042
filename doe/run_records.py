"""Settings and their runs: one row of a design, what came of it, and tables of an observable over them.

Nothing here pours, so that what only reads results loads no solver.
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
    """One row of a design: what is changed against the study's scene, and how often it is run."""

    label: str
    values: dict[str, float | str]
    replicates: int
    experiments: tuple[str, ...] = ("",)
    """Names of those of the study's experiments that are run; "" is its own rig."""


@dataclass(frozen=True)
class Run(Record):
    """One run of a setting. ``attempt`` counts the replacements of this replicate."""

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
    """The one that was run; its name and "/" stand before those of its observables."""

    @property
    def title(self) -> str:
        """The setting, and the experiment where that is not the study's own."""
        return f"{self.label}, {self.experiment}" if self.experiment else self.label

    @property
    def valid(self) -> bool:
        """True if what was read off the run counts: the pile came to rest, or the rig ran for its time."""
        return Outcome(self.outcome).valid


class Runner(Protocol):
    """Anything that can run settings: the pours, or a formula in a test."""

    def run(self, stage: str, settings: Sequence[Setting]) -> list[list[Run]]:
        """All runs of every setting, failed ones included, in the order of the settings."""
        ...


def responses(rows: Sequence[Sequence[Run]], observable: str) -> FloatArray:
    """Matrix (settings, replicates) of an observable; NaN where a replicate has no valid run."""
    width = max((run.replicate + 1 for runs in rows for run in runs), default=0)
    table = np.full((len(rows), width), np.nan)
    for k, runs in enumerate(rows):
        for run in runs:
            found = run.observables.get(observable)
            if run.valid and found is not None:
                table[k, run.replicate] = found
    return table


def sample_of(runs: Iterable[Run], observable: str) -> Sample:
    """Summary of an observable over the valid runs in which it could be measured; NaN where there are none."""
    values = valid_values(runs, observable)
    return Sample.of(values) if values else Sample(math.nan, math.nan, 0)


def valid_values(runs: Iterable[Run], observable: str) -> list[float]:
    """An observable over the valid runs in which it could be measured."""
    found = (run.observables.get(observable) for run in runs if run.valid)
    return [value for value in found if value is not None]


def no_pile_shares(rows: Sequence[Sequence[Run]]) -> FloatArray:
    """Share of the runs of each setting that did not give a pile, replacements included, shape (settings,)."""
    return np.array([np.mean([not run.valid for run in runs]) if runs else np.nan for runs in rows])
