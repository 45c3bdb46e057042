"""Screening: which factors move the response, in the 28-run Plackett–Burman design, and which go on."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.designs import plackett_burman
from doe.errors import StatisticsError
from doe.factors import MIN_BODIES, bodies_touched
from doe.profile import Profile
from doe.record import Record
from doe.runs import FloatArray, Run, Runner, Setting, no_pile_shares, responses
from doe.screening import Screening, Selected, analyse_screening, select_factors
from doe.stages.sizing import ASSUMPTION_ROWS, SCREENING_ROWS
from doe.study import CALIBRATED, COLUMNS, Factor, Study
from doe.target import observed_text


@dataclass(frozen=True)
class NotTestable(Record):
    """A factor that touches too few bodies to be tested."""

    factor: str
    path: str
    bodies: float
    statement: str


@dataclass(frozen=True, kw_only=True)
class ScreeningResult(Record):
    """Runs and analysis of a two-level design.

    ``analysis`` is of ``response`` (the estimator that the pilot chose), ``target_analysis`` of the target's own
    observable, ``no_pile_analysis`` of the share of runs without a pile (None if none failed).
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
    not_testable: tuple[NotTestable, ...]
    selected: tuple[Selected, ...]

    @property
    def line(self) -> str:
        """One line of what a screening found."""
        found = self.analysis.significant()
        text = f"significant: {', '.join(found) if found else 'none'}"
        error = self.analysis.deciding_error
        # The factors are judged all at once (Holm); so is the effect that could have been seen.
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
    """Run and analyse the 28-run design over the factors and dummies of the study."""
    design = plackett_burman(SCREENING_ROWS)
    spare = COLUMNS - len(study.factors)
    names = [factor.name for factor in study.factors] + [f"dummy {k + 1}" for k in range(spare)]
    untestable = not_testable(study, study.factors)
    spare_factors = [entry.factor for entry in untestable]
    result = two_level_study(
        "screening", study, study.factors, names, design, profile.screening_replicates, runner, response, spare_factors
    )
    estimated = {effect.name for effect in result.analysis.effects if not effect.is_dummy}
    exclude = [entry.factor for entry in untestable if entry.factor in estimated]
    fallback = [name for name in study.fallback if name in estimated]
    selected = select_factors(result.analysis, CALIBRATED, fallback, exclude)
    return dataclasses.replace(result, selected=selected)


def assumptions(study: Study, profile: Profile, runner: Runner, response: str) -> ScreeningResult | None:
    """The same, in the 12-run design, over what the source of the study does not state; None without any."""
    if not study.assumptions:
        return None
    design = plackett_burman(ASSUMPTION_ROWS)
    names = [a.name for a in study.assumptions] + [f"dummy {k + 1}" for k in range(11 - len(study.assumptions))]
    return two_level_study(
        "assumptions",
        study,
        study.assumptions,
        names,
        design,
        profile.assumption_replicates,
        runner,
        response,
    )


def two_level_study(
    stage: str,
    study: Study,
    factors: Sequence[Factor],
    names: Sequence[str],
    design: npt.NDArray[np.int64],
    replicates: int,
    runner: Runner,
    response: str,
    spare: Sequence[str] = (),
) -> ScreeningResult:
    """Run the rows of a two-level design and analyse response, target and share without a pile.

    ``spare`` names factors that may be given up, see :func:`analysed`.
    """
    settings = [
        Setting(
            f"row {k + 1}",
            {factor.path: factor.level(float(level)) for factor, level in zip(factors, row, strict=False)},
            replicates,
        )
        for k, row in enumerate(design)
    ]
    rows = runner.run(stage, settings)
    dummies = names[len(factors) :]
    lost = no_pile_shares(rows)
    return ScreeningResult(
        response=response,
        columns=tuple(names),
        factors=tuple(factors),
        design=design.astype(float),
        settings=tuple(settings),
        runs=tuple(tuple(runs) for runs in rows),
        analysis=analysed(design, names, responses(rows, response), dummies, spare),
        target_analysis=analysed(design, names, responses(rows, study.targets[0].observable), dummies, spare),
        no_pile_share=lost,
        no_pile_analysis=analyse_screening(design, names, lost[:, None], dummies) if lost.any() else None,
        not_testable=not_testable(study, factors),
        selected=(),
    )


def analysed(
    design: npt.NDArray[np.int64],
    names: Sequence[str],
    values: FloatArray,
    dummies: Sequence[str],
    spare: Sequence[str],
) -> Screening:
    """Analysis of a design; where rows without a valid run leave too few equations, ``spare`` factors become dummies.

    Those are the factors that are not testable anyway; giving them up is said in the notes. Raises StatisticsError
    where even that is not enough.
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
    """Factors that touch fewer than ``MIN_BODIES`` bodies of the mixture."""
    found = []
    for factor in factors:
        bodies = bodies_touched(study.scene, factor.path)
        if bodies < MIN_BODIES:
            statement = f"not testable: {factor.path} acts on {bodies:.0f} bodies, fewer than {MIN_BODIES}"
            found.append(NotTestable(factor.name, factor.path, bodies, statement))
    return tuple(found)
