"""Sizes of the stages: as many pours per row as the pilot's noise asks for to see one and the same effect.

Every stage has its own rows, its own comparison and the spread of the observable that it reads:

    screening, assumptions   main effect of the stage's design, all of its factors at once (Bonferroni); the estimator
    ascent, scan             difference of two means; the target's observable
    surface                  change from low to high of a linear term of the stage's design; the target's observable
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from doe.designs import ChosenDesign
from doe.power import (
    main_effect_efficiency,
    replicates_for_difference,
    replicates_for_linear_effect,
    replicates_for_main_effect,
    smallest_difference,
    smallest_linear_effect,
    smallest_main_effect,
)
from doe.profile import Profile
from doe.record import Record
from doe.study import CALIBRATED, Study


@dataclass(frozen=True)
class StageSize(Record):
    """Replicates per row of a stage: asked for by ``wanted``, taken, and the effect that those resolve.

    ``wanted`` and ``resolved`` in the unit of the observable, with chance 0.8 at level 0.05.
    """

    stage: str
    wanted: float
    needed: int
    taken: int
    resolved: float

    @property
    def statement(self) -> str:
        """What the profile's limit costs."""
        return (
            f"{self.stage}: {self.wanted:g}° takes {self.needed} pours per row; the profile allows {self.taken}, which "
            f"resolve {self.resolved:.2f}°."
        )


@dataclass(frozen=True)
class _Rule:
    """Size of one stage: replicates for an effect, and the effect that replicates resolve."""

    stage: str
    key: str
    sigma: float
    needed: Callable[[float, float], int]
    resolved: Callable[[float, int], float]


def sized(
    study: Study, profile: Profile, screening_sigma: float, target_sigma: float
) -> tuple[Profile, tuple[StageSize, ...]]:
    """The profile with the replicates that ``resolution_deg`` asks for, and how each was found.

    ``screening_sigma`` and ``target_sigma``: spread of one pour in the screening's estimator and in the target's
    observable [°]. Without ``resolution_deg`` the profile stays as it is.
    """
    wanted = profile.resolution_deg
    if wanted is None:
        return profile, ()
    sizes, counts = [], {}
    for rule in _rules(study, screening_sigma, target_sigma):
        # Pours that all agree leave nothing to resolve; two of them still show that they do.
        needed = rule.needed(wanted, rule.sigma) if rule.sigma > 0 else 2
        taken = min(needed, profile.max_replicates)
        sizes.append(StageSize(rule.stage, wanted, needed, taken, rule.resolved(rule.sigma, taken)))
        counts[rule.key] = taken
    return replace(profile, **counts), tuple(sizes)  # type: ignore[arg-type]


def _rules(study: Study, screening_sigma: float, target_sigma: float) -> list[_Rule]:
    points = study.surface_design.points(CALIBRATED).coded
    screening = _main_effect(
        "screening", "screening_replicates", screening_sigma, study.screening_design, len(study.factors)
    )
    rules = [screening]
    if study.assumptions:
        count = len(study.assumptions)
        rules.append(
            _main_effect("assumptions", "assumption_replicates", screening_sigma, study.assumption_design, count)
        )
    if study.scan_values:
        rules.append(_Rule("scan", "scan_replicates", target_sigma, replicates_for_difference, smallest_difference))
    rules.append(_Rule("ascent", "ascent_replicates", target_sigma, replicates_for_difference, smallest_difference))
    rules.append(
        _Rule(
            "surface",
            "surface_replicates",
            target_sigma,
            lambda effect, sigma: replicates_for_linear_effect(effect, sigma, points),
            lambda sigma, n: smallest_linear_effect(sigma, n, points),
        )
    )
    return rules


def _main_effect(stage: str, key: str, sigma: float, design: ChosenDesign, factors: int) -> _Rule:
    coded = design.points(factors).coded
    rows, efficiency = len(coded), main_effect_efficiency(coded)
    return _Rule(
        stage,
        key,
        sigma,
        lambda effect, sigma: replicates_for_main_effect(
            effect, sigma, rows, comparisons=factors, efficiency=efficiency
        ),
        lambda sigma, n: smallest_main_effect(sigma, n, rows, comparisons=factors, efficiency=efficiency),
    )
