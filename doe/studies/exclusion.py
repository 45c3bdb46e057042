"""Runs of a finished study that somebody leaves out, each for a reason, and the optimum of the runs that are left.

The response surface is fitted anew to what is left of its runs; which factors it has and where it stands was decided
by runs of other stages, and stays. The verification was made at the optimum of all runs.
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
"""Of a study whose file names none; results of older versions do not say."""


@dataclass(frozen=True)
class ExcludedRun:
    """One run of the response surface that is left out: its setting, its experiment ("": the study's own), its seed."""

    label: str
    experiment: str
    seed: int
    reason: str

    def is_of(self, run: Run) -> bool:
        """Whether it is this run."""
        return (self.label, self.experiment, self.seed) == (run.label, run.experiment, run.seed)


def optimum_without(result: StudyResult, excluded: Sequence[ExcludedRun]) -> OptimumResult:
    """The optimum by the runs of the surface that are not ``excluded``.

    Raises StatisticsError where too few runs are left for the model.
    """
    surface, seed = result.surface, result.study.seed
    rows = [[run for run in runs if not any(one.is_of(run) for one in excluded)] for runs in surface.runs]
    models = tuple(
        fit_surface(np.asarray(surface.design), responses(rows, name), surface.region) for name in surface.observables
    )
    return optimum_of(models, surface.factors, result.study.targets, USUAL_SEED if seed is None else seed)
