"""Runs of a finished study that a user excludes, each for a stated reason, and the optimum of the remaining runs.

The response surface is refitted to its remaining runs; its factors and region were decided by runs of other stages and
stay as they are. The verification was made at the optimum of all runs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from doe.analysis.surface import fit_surface
from doe.run_records import Run, responses
from doe.stages.surface import OptimumResult, optimum_of
from doe.studies.study_result import StudyResult

USUAL_SEED = 1
"""Seed of a study whose file names none; results of older versions do not record it."""


@dataclass(frozen=True)
class ExcludedRun:
    """One excluded run of the response surface: its setting, experiment ("": the study's own rig), seed and reason.

    ``key``: the run's key in the store, which no pour of another scene has; "" in files of older versions.
    """

    label: str
    experiment: str
    seed: int
    key: str
    reason: str

    @staticmethod
    def of(run: Run, reason: str) -> ExcludedRun:
        """Return ``run``, excluded for ``reason``."""
        return ExcludedRun(run.label, run.experiment, run.seed, run.key, reason)

    def is_of(self, run: Run) -> bool:
        """Return whether ``run`` is the excluded one."""
        same = (self.label, self.experiment, self.seed) == (run.label, run.experiment, run.seed)
        return same and self.key in ("", run.key)


def optimum_without(result: StudyResult, excluded: Sequence[ExcludedRun]) -> OptimumResult:
    """Return the optimum by the runs of the surface that are not ``excluded``.

    Raises StatisticsError if too few runs are left for the model.
    """
    surface, seed = result.surface, result.study.seed
    rows = [[run for run in runs if not any(one.is_of(run) for one in excluded)] for runs in surface.runs]
    models = tuple(
        fit_surface(np.asarray(surface.design), responses(rows, name), surface.region) for name in surface.observables
    )
    return optimum_of(models, surface.factors, result.study.targets, USUAL_SEED if seed is None else seed)
