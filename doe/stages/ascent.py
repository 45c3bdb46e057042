"""Steepest ascent: a walk along the fitted effects until the response passes the target."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from doe.analysis.pilot import Noise
from doe.analysis.power import smallest_effect
from doe.analysis.screening import SIGNIFICANT
from doe.analysis.steepest_ascent import (
    LEAST_SHARE,
    AscentFactor,
    AscentPath,
    Bracket,
    Region,
    ascent_path,
    bracket,
    region_around,
)
from doe.record import Record
from doe.run_records import FloatArray, Run, Runner, Setting, responses
from doe.stages.screening import ScreeningResult
from doe.stages.stage import Chain, Stage, ended
from doe.studies.profile import Profile
from doe.studies.study import Factor, Study


@dataclass(frozen=True, kw_only=True)
class AscentResult(Record):
    """The path, what it gave in the target's observable, and the region of the next design.

    ``means``, ``sd``, ``standard_error``: shape (steps,), NaN where no run is valid or only one.
    """

    factors: tuple[Factor, ...]
    path: AscentPath
    observable: str
    means: FloatArray
    sd: FloatArray
    standard_error: FloatArray
    relative_error_percent: FloatArray
    settings: tuple[Setting, ...] = ()
    runs: tuple[tuple[Run, ...], ...]
    bracket: Bracket
    region: Region
    smallest_difference: float
    """Difference between two steps that would have been seen with power 0.8."""
    notes: tuple[str, ...]

    @property
    def line(self) -> str:
        """One line of what the ascent found."""
        return f"{', '.join(f'{mean:.1f}' for mean in self.means)}. {self.bracket.statement}"


def ascent(study: Study, profile: Profile, runner: Runner, screened: ScreeningResult, noise: Noise) -> AscentResult:
    """Walk the selected factors from the low end of the response to the high end.

    Direction, steps and prediction come from the effects on the target's own observable, whichever estimator selected
    the factors: the walk has to arrive at the measured value. ``noise`` of that observable is the pilot's, which
    knows the spread of one run better than the few runs of a step. In a study of several experiments the region is the
    whole of the ranges: the walk knows the first target only.
    """
    target = study.targets[0]
    by_name = {factor.name: factor for factor in study.factors}
    effects = {effect.name: effect.effect for effect in screened.target_analysis.effects}
    factors = tuple(by_name[chosen.name] for chosen in screened.selected)
    walk = [AscentFactor(f.name, float(f.low), float(f.high), effects[f.name]) for f in factors]
    path = ascent_path(walk, screened.target_analysis.mean, steps=profile.ascent_steps)
    # Where the solutions of several experiments cross may be far from where the walk passes the first target's.
    share = 0.5 if study.experiments else LEAST_SHARE
    settings = [
        Setting(
            f"step {k + 1}",
            {f.path: float(v) for f, v in zip(factors, step, strict=True)},
            profile.ascent_replicates,
        )
        for k, step in enumerate(path.natural)
    ]
    rows = runner.run("ascent", settings)
    table = responses(rows, target.observable)
    n = (~np.isnan(table)).sum(axis=1)
    means = np.array([row[~np.isnan(row)].mean() if k else math.nan for row, k in zip(table, n, strict=True)])
    sd = np.array([row[~np.isnan(row)].std(ddof=1) if k > 1 else math.nan for row, k in zip(table, n, strict=True)])
    error = noise.sigma / np.sqrt(np.maximum(n, 1))
    found = bracket(means, target.mean, standard_errors=error)
    return AscentResult(
        factors=factors,
        path=path,
        observable=target.observable,
        means=means,
        sd=sd,
        standard_error=error,
        relative_error_percent=100 * np.abs(means - target.mean) / abs(target.mean),
        settings=tuple(settings),
        runs=tuple(tuple(runs) for runs in rows),
        bracket=found,
        region=region_around(path, found, share),
        smallest_difference=smallest_effect(noise.sigma * math.sqrt(2.0 / profile.ascent_replicates), noise.runs - 1),
        notes=_notes(screened),
    )


def _notes(screened: ScreeningResult) -> tuple[str, ...]:
    """Which of the directions are those of noise."""
    in_target = screened.target_analysis.significant()
    notes = []
    for chosen in screened.selected:
        if not chosen.reason.startswith(SIGNIFICANT):
            notes.append(f"{chosen.name} is {chosen.reason}; its direction is that of an effect within noise.")
        elif chosen.name not in in_target:
            reason = f"{SIGNIFICANT} in {screened.response}" if chosen.reason == SIGNIFICANT else chosen.reason
            notes.append(
                f"{chosen.name} is {reason} but not in the target's own observable, from which the direction is taken."
            )
    return tuple(notes)


class AscentStage(Stage):
    """The walk to the target."""

    name = "ascent"
    title = "Steepest ascent"

    def planned_runs(self, study: Study, profile: Profile) -> int:
        """Every step."""
        return profile.ascent_steps * profile.ascent_replicates

    def run(self, chain: Chain, runner: Runner) -> AscentResult:
        """See :func:`ascent`."""
        noise = ended(chain.found.pilot).noise[chain.study.targets[0].observable]
        return ascent(chain.study, chain.profile, runner, ended(chain.found.screening), noise)
