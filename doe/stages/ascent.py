"""Steepest ascent: a walk along the fitted effects to bracket the target, or to come nearest to several targets."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from doe.analysis.pilot import Noise
from doe.analysis.power import smallest_effect
from doe.analysis.screening import SIGNIFICANT
from doe.analysis.steepest_ascent import (
    LEAST_SHARE,
    Approach,
    AscentFactor,
    AscentPath,
    Bracket,
    FirstOrder,
    Region,
    approach,
    ascent_path,
    bracket,
    joint_path,
    region_around,
)
from doe.analysis.verification import relative_error_percent
from doe.record import Record
from doe.run_records import FloatArray, Run, Runner, Setting, responses
from doe.stages.screening import ScreeningResult
from doe.stages.stage import Chain, Stage, ended
from doe.studies.profile import Profile
from doe.studies.study import Factor, Study
from doe.target import Target, observed_text

WHOLE = 0.5
"""Half-width, as a share of a factor's range, of a region that covers the whole range."""
LEAST_SPREAD = 1e-6
"""Least standard error of a target, relative to its own size or that of its response."""


@dataclass(frozen=True, kw_only=True)
class TargetWalk(Record):
    """Results of a walk in the observable of one target; arrays of shape (steps,), NaN without enough valid runs."""

    observable: str
    predicted: FloatArray
    """Predicted by the first-order model of the screening."""
    means: FloatArray
    sd: FloatArray
    standard_error: FloatArray
    relative_error_percent: FloatArray
    smallest_difference: float
    """Difference between two steps that would have been seen with power 0.8."""


@dataclass(frozen=True, kw_only=True)
class AscentResult(Record):
    """The path, its results in the observable of the first target, and the region of the next design.

    ``means``, ``sd``, ``standard_error``: shape (steps,); ``means`` is NaN where no run is valid, ``sd`` also where
    only one is. With several targets, ``others`` holds the same for the further targets, and ``approach`` states where
    the walk comes nearest to all of them; ``bracket`` always refers to the first target.
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
    others: tuple[TargetWalk, ...] = ()
    approach: Approach | None = None

    @property
    def line(self) -> str:
        """The findings of the ascent in one line."""
        if self.approach is not None:
            return self.approach.words([walk.observable for walk in self.walks])
        return f"{', '.join(observed_text(self.observable, mean) for mean in self.means)}. {self.bracket.statement}"

    @property
    def walks(self) -> tuple[TargetWalk, ...]:
        """Results of the walk per target, in the study's order; results of older versions have only the first."""
        first = TargetWalk(
            observable=self.observable,
            predicted=self.path.predicted,
            means=self.means,
            sd=self.sd,
            standard_error=self.standard_error,
            relative_error_percent=self.relative_error_percent,
            smallest_difference=self.smallest_difference,
        )
        return (first, *self.others)


def ascent(
    study: Study, profile: Profile, runner: Runner, screened: ScreeningResult, noise: Mapping[str, Noise]
) -> AscentResult:
    """Walk the selected factors from the low end of the response to the high end, or towards all targets at once.

    Direction, steps and prediction come from the effects on the targets' own observables, whichever estimator selected
    the factors, because the walk has to arrive at the measured values. ``noise``: observable → noise in the pilot,
    which estimates the spread of one run better than the few runs of a step. With several targets, the region is
    narrowed only if the walk meets all of them and its steps resolve where; otherwise their solutions may cross far
    from the walk.
    """
    by_name = {factor.name: factor for factor in study.factors}
    factors = tuple(by_name[chosen.name] for chosen in screened.selected)
    held = tuple(factor for factor in study.factors if factor not in factors)
    models = [_first_order(screened, factors, held, target, noise[target.observable]) for target in study.targets]
    path = _path(factors, models, profile.ascent_steps)
    settings = [
        Setting(
            f"step {k + 1}",
            {f.path: float(v) for f, v in zip(factors, step, strict=True)},
            profile.ascent_replicates,
            study.all_experiments,
        )
        for k, step in enumerate(path.natural)
    ]
    rows = runner.run("ascent", settings)
    walks = [
        _walk(
            responses(rows, target.observable),
            model.mean + path.coded @ model.effects / 2,
            target,
            noise[target.observable],
            profile,
        )
        for target, model in zip(study.targets, models, strict=True)
    ]
    first, target = walks[0], study.targets[0]
    found = bracket(first.means, target.mean, standard_errors=first.standard_error)
    joint = None if len(walks) == 1 else _approach(walks, study.targets)
    narrow = joint is None or (joint.reached and joint.resolved)
    return AscentResult(
        factors=factors,
        path=path,
        observable=first.observable,
        means=first.means,
        sd=first.sd,
        standard_error=first.standard_error,
        relative_error_percent=first.relative_error_percent,
        settings=tuple(settings),
        runs=tuple(tuple(runs) for runs in rows),
        bracket=found,
        region=region_around(path, joint or found, LEAST_SHARE if narrow else WHOLE),
        smallest_difference=first.smallest_difference,
        notes=_notes(screened, study.targets),
        others=tuple(walks[1:]),
        approach=joint,
    )


def _first_order(
    screened: ScreeningResult, factors: Sequence[Factor], held: Sequence[Factor], target: Target, noise: Noise
) -> FirstOrder:
    """The screening's model of ``target`` over ``factors``; ``held``: the others, which the walk keeps at reference."""
    found = screened.further_analyses.get(target.observable, screened.target_analysis)
    effects = {effect.name: effect.effect for effect in found.effects}
    # The screening's mean is that at the middle of every range; half an effect is as uncertain as the mean.
    known = [one for one in held if math.isfinite(effects.get(one.name, math.nan))]
    away = np.array([one.coded(one.reference) for one in known])
    mean = found.mean + float(away @ np.array([effects[one.name] / 2.0 for one in known]))
    spread = math.hypot(target.standard_error, noise.sigma * math.sqrt((1.0 + float(away @ away)) / found.runs))
    least = max(LEAST_SPREAD * max(abs(target.mean), abs(found.mean)), sys.float_info.min)
    return FirstOrder(
        mean=mean,
        effects=np.array([effects[factor.name] for factor in factors]),
        goal=target.mean,
        spread=max(spread, least),
        weight=target.weight,
    )


def _path(factors: Sequence[Factor], models: Sequence[FirstOrder], steps: int) -> AscentPath:
    if len(models) > 1:
        names, low, high = zip(*((f.name, float(f.low), float(f.high)) for f in factors), strict=True)
        return joint_path(names, low, high, models, steps)
    walk = [
        AscentFactor(f.name, float(f.low), float(f.high), float(effect))
        for f, effect in zip(factors, models[0].effects, strict=True)
    ]
    return ascent_path(walk, models[0].mean, steps=steps)


def _walk(table: FloatArray, predicted: FloatArray, target: Target, noise: Noise, profile: Profile) -> TargetWalk:
    """Results of a walk from the ``table`` of its runs, shape (steps, replicates)."""
    n = (~np.isnan(table)).sum(axis=1)
    means = np.array([row[~np.isnan(row)].mean() if k else math.nan for row, k in zip(table, n, strict=True)])
    return TargetWalk(
        observable=target.observable,
        predicted=predicted,
        means=means,
        sd=np.array([row[~np.isnan(row)].std(ddof=1) if k > 1 else math.nan for row, k in zip(table, n, strict=True)]),
        standard_error=noise.sigma / np.sqrt(np.maximum(n, 1)),
        relative_error_percent=np.array([relative_error_percent(float(mean), target.mean) for mean in means]),
        smallest_difference=smallest_effect(noise.sigma * math.sqrt(2.0 / profile.ascent_replicates), noise.runs - 1),
    )


def _approach(walks: Sequence[TargetWalk], targets: Sequence[Target]) -> Approach:
    """Where the walk comes nearest to ``targets``."""
    goals = np.array([target.mean for target in targets])
    sizes = np.array([[target.standard_error] for target in targets])
    spreads = np.hypot(np.array([walk.standard_error for walk in walks]), sizes)
    return approach(
        [walk.means for walk in walks],
        goals,
        np.maximum(spreads, np.maximum(LEAST_SPREAD * np.abs(goals), sys.float_info.min)[:, None]),
        [target.weight for target in targets],
        [target.margin for target in targets],
    )


def _notes(screened: ScreeningResult, targets: Sequence[Target]) -> tuple[str, ...]:
    """Notes on factors whose direction may be due to noise."""
    own = (screened.target_analysis, *screened.further_analyses.values())
    in_target = {name for analysis in own for name in analysis.significant()}
    whose = "the target's own observable" if len(targets) == 1 else "the observable of any target"
    notes = []
    for chosen in screened.selected:
        if not chosen.reason.startswith(SIGNIFICANT):
            notes.append(f"{chosen.name} is {chosen.reason}; its direction is that of an effect within noise.")
        elif chosen.name not in in_target:
            reason = f"{SIGNIFICANT} in {screened.response}" if chosen.reason == SIGNIFICANT else chosen.reason
            notes.append(f"{chosen.name} is {reason} but not in {whose}, from which the direction is taken.")
    return tuple(notes)


class AscentStage(Stage):
    """The walk to the target."""

    name = "ascent"
    title = "Steepest ascent"

    def planned_runs(self, study: Study, profile: Profile) -> int:
        """Every step, in every experiment."""
        return profile.ascent_steps * profile.ascent_replicates * len(study.all_experiments)

    def run(self, chain: Chain, runner: Runner) -> AscentResult:
        """See :func:`ascent`."""
        noise = ended(chain.found.pilot).noise
        return ascent(chain.study, chain.profile, runner, ended(chain.found.screening), noise)
