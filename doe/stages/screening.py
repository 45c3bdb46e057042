"""Screening: which factors affect the response, in the design that the study names, and which are calibrated."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from doe.analysis.screening import Screening, Selected, analyse_screening, select_factors
from doe.designs import ChosenDesign
from doe.errors import StatisticsError
from doe.record import Record
from doe.run_records import FloatArray, Run, Runner, Setting, no_pile_shares, responses
from doe.stages.stage import Chain, Stage, ended
from doe.studies.factors import MIN_BODIES, bodies_touched
from doe.studies.profile import Profile
from doe.studies.study import CALIBRATED, Factor, Study
from doe.target import experiment_of, observed_text


@dataclass(frozen=True)
class NotTestable(Record):
    """A factor that affects too few bodies to be tested."""

    factor: str
    path: str
    bodies: float
    statement: str


@dataclass(frozen=True, kw_only=True)
class ScreeningResult(Record):
    """Runs and analysis of a design for main effects.

    ``analysis`` is that of ``response`` (the estimator chosen by the pilot), ``target_analysis`` that of the target's
    own observable, and ``no_pile_analysis`` that of the share of runs without a pile (None if no run failed).
    """

    response: str
    columns: tuple[str, ...]
    factors: tuple[Factor, ...]
    design: FloatArray
    settings: tuple[Setting, ...] = ()
    runs: tuple[tuple[Run, ...], ...]
    analysis: Screening
    target_analysis: Screening
    no_pile_share: FloatArray
    no_pile_analysis: Screening | None
    further_analyses: dict[str, Screening] = field(default_factory=dict)
    """Analyses of the further targets: observable → analysis."""
    not_testable: tuple[NotTestable, ...]
    selected: tuple[Selected, ...]

    @property
    def line(self) -> str:
        """The findings of a screening in one line."""
        found = self.analysis.significant()
        text = f"significant: {', '.join(found) if found else 'none'}"
        error = self.analysis.deciding_error
        # The factors are tested simultaneously (Holm), so the smallest detectable effect is simultaneous as well.
        if error is not None and math.isfinite(error.smallest_detectable_effect_bonferroni):
            size = observed_text(self.response, error.smallest_detectable_effect_bonferroni)
            text += f"; smallest effect seen, all factors at once, {size}"
        lost = self.no_pile_analysis.significant() if self.no_pile_analysis is not None else ()
        if lost:
            text += f"; the share of valid pours depends on {', '.join(lost)}"
        if self.not_testable:
            text += f"; not testable: {', '.join(entry.factor for entry in self.not_testable)}"
        if self.selected:
            text += "; going on: " + ", ".join(f"{s.name} ({s.reason})" for s in self.selected)
        return text


def screening(study: Study, profile: Profile, runner: Runner, response: str) -> ScreeningResult:
    """Run and analyse the screening design over the factors of the study, and select the factors to calibrate."""
    untestable = not_testable(study, study.factors)
    result = main_effects(
        "screening",
        study,
        study.factors,
        study.screening_design,
        profile.screening_replicates,
        runner,
        response,
        [entry.factor for entry in untestable],
        [target.observable for target in study.targets[1:]],
    )
    estimated = {effect.name for effect in result.analysis.effects if not effect.is_dummy}
    exclude = [entry.factor for entry in untestable]
    fallback = [name for name in study.fallback if name in estimated]
    selected = select_factors(result.analysis, CALIBRATED, fallback, exclude, further=result.further_analyses)
    return dataclasses.replace(result, selected=selected)


def assumptions(study: Study, profile: Profile, runner: Runner, response: str) -> ScreeningResult | None:
    """Run and analyse the design over the assumptions: what the study's source does not state; None without any."""
    if not study.assumptions:
        return None
    design, replicates = study.assumption_design, profile.assumption_replicates
    return main_effects("assumptions", study, study.assumptions, design, replicates, runner, response)


def main_effects(
    stage: str,
    study: Study,
    factors: Sequence[Factor],
    chosen: ChosenDesign,
    replicates: int,
    runner: Runner,
    response: str,
    spare: Sequence[str] = (),
    further: Sequence[str] = (),
) -> ScreeningResult:
    """Run the rows of a design and analyse the response, the target and the share of runs without a pile.

    Columns of the table without a factor are dummies. ``spare``: factors that may be given up, see :func:`analysed`.
    ``further``: observables that are also analysed, in whichever experiment they are read.
    """
    wanted = {"", *map(experiment_of, further)}
    experiments = tuple(name for name in study.all_experiments if name in wanted)
    points = chosen.points(len(factors))
    dummies = [f"dummy {k + 1}" for k in range(points.unused.shape[1])]
    names = [factor.name for factor in factors] + dummies
    design = np.hstack([points.coded, points.unused]) if dummies else points.coded
    settings = [
        Setting(
            f"row {k + 1}",
            {factor.path: factor.level(float(level)) for factor, level in zip(factors, row, strict=True)},
            replicates,
            experiments,
        )
        for k, row in enumerate(points.coded)
    ]
    rows = runner.run(stage, settings)
    lost = no_pile_shares(rows)
    return ScreeningResult(
        response=response,
        columns=tuple(names),
        factors=tuple(factors),
        design=design,
        settings=tuple(settings),
        runs=tuple(tuple(runs) for runs in rows),
        analysis=analysed(design, names, responses(rows, response), dummies, spare),
        target_analysis=analysed(design, names, responses(rows, study.targets[0].observable), dummies, spare),
        further_analyses={name: analysed(design, names, responses(rows, name), dummies, spare) for name in further},
        no_pile_share=lost,
        no_pile_analysis=analyse_screening(design, names, lost[:, None], dummies) if lost.any() else None,
        not_testable=not_testable(study, factors),
        selected=(),
    )


def analysed(
    design: FloatArray,
    names: Sequence[str],
    values: FloatArray,
    dummies: Sequence[str],
    spare: Sequence[str],
) -> Screening:
    """Return the analysis of a design; if rows without a valid run leave too few equations, ``spare`` become dummies.

    These are factors that are not testable anyway; a note states that they were given up. Raises StatisticsError if
    even that is not enough.
    """
    try:
        return analyse_screening(design, names, values, dummies)
    except StatisticsError:
        if not spare:
            raise
        found = analyse_screening(design, names, values, [*dummies, *spare])
        note = (
            f"Too many rows have no valid pour; {', '.join(spare)} (not testable) were given up to analyse the others."
        )
        return dataclasses.replace(found, notes=(*found.notes, note))


def not_testable(study: Study, factors: Sequence[Factor]) -> tuple[NotTestable, ...]:
    """Return the factors that affect fewer than ``MIN_BODIES`` bodies of the mixture."""
    found = []
    for factor in factors:
        bodies = bodies_touched(study.scene, factor.path)
        if bodies < MIN_BODIES:
            statement = f"not testable: {factor.path} acts on {bodies:.0f} bodies, fewer than {MIN_BODIES}"
            found.append(NotTestable(factor.name, factor.path, bodies, statement))
    return tuple(found)


class ScreeningStage(Stage):
    """Which factors have an effect, and which are calibrated."""

    name = "screening"
    title = "Screening"

    def planned_runs(self, study: Study, profile: Profile) -> int:
        """Runs of every row of the design."""
        rows = len(study.screening_design.points(len(study.factors)).coded)
        return rows * profile.screening_replicates * len(study.all_experiments)

    def run(self, chain: Chain, runner: Runner) -> ScreeningResult:
        """See :func:`screening`; the estimator is the pilot's choice."""
        return screening(chain.study, chain.profile, runner, ended(chain.found.pilot).estimator)


class AssumptionStage(Stage):
    """Which assumptions have an effect."""

    name = "assumptions"
    title = "Assumptions"

    def planned_runs(self, study: Study, profile: Profile) -> int:
        """Runs of every row of the design, if there are any assumptions."""
        if not study.assumptions:
            return 0
        return len(study.assumption_design.points(len(study.assumptions)).coded) * profile.assumption_replicates

    def run(self, chain: Chain, runner: Runner) -> ScreeningResult | None:
        """See :func:`assumptions`; the estimator is the pilot's choice."""
        return assumptions(chain.study, chain.profile, runner, ended(chain.found.pilot).estimator)
