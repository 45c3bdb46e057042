"""Pilot: the noise of one pour at the reference setting, the choice of the estimator, and the sizes of later stages.

From the noise in the pilot, each stage gets as many pours per row as it needs to detect the same effect. Every stage
has its own rows, its own comparison and the spread of the observable that it reads:

    screening, assumptions   main effect of the stage's design, all of its factors at once (Bonferroni); the estimator
    ascent, scan             difference of two means; the target's observable
    surface                  change from low to high of a linear term of the stage's design; the target's observable
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from doe.analysis.pilot import (
    BIAS_LIMIT_DEG,
    EqualVariance,
    EstimatorChoice,
    Noise,
    Resolution,
    choose_estimator,
    equal_variance,
    replicate_noise,
    resolution,
)
from doe.analysis.power import (
    main_effect_efficiency,
    replicates_for_difference,
    replicates_for_linear_effect,
    replicates_for_main_effect,
    smallest_difference,
    smallest_linear_effect,
    smallest_main_effect,
)
from doe.designs import ChosenDesign
from doe.errors import StatisticsError
from doe.record import Record
from doe.run_records import FloatArray, Run, Runner, Setting, responses
from doe.stages.stage import Bias, Chain, Stage
from doe.studies.profile import Profile
from doe.studies.study import CALIBRATED, REFERENCE, Study
from doe.target import experiment_of, is_angle, observed_text


@dataclass(frozen=True)
class StageSize(Record):
    """Replicates per row of a stage: ``needed`` for the effect ``wanted``, ``taken``, and the effect ``resolved``.

    ``wanted`` and ``resolved`` are in the unit of the observable, with power 0.8 at level 0.05.
    """

    stage: str
    wanted: float
    needed: int
    taken: int
    resolved: float

    @property
    def statement(self) -> str:
        """The effect of the profile's limit in a sentence."""
        return (
            f"{self.stage}: {self.wanted:g}° takes {self.needed} pours per row; the profile allows {self.taken}, which "
            f"resolve {self.resolved:.2f}°."
        )


@dataclass(frozen=True, kw_only=True)
class PilotResult(Record):
    """Noise per estimator, the choice among them, and the sizes of the stages that follow.

    ``estimator`` is the response of the screening; ``equal_variance`` compares the spread of the target's observable at
    the reference setting and under the declared changes (None where that cannot be tested).
    """

    settings: tuple[Setting, ...] = ()
    runs: tuple[tuple[Run, ...], ...]
    noise: dict[str, Noise]
    equal_variance: EqualVariance | None
    estimator: str
    estimator_bias: Bias
    choice: EstimatorChoice | None
    profile: Profile
    sizes: tuple[StageSize, ...]
    resolutions: tuple[Resolution, ...]
    notes: tuple[str, ...]

    @property
    def line(self) -> str:
        """The findings of the pilot in one line."""
        target, noise = next(iter(self.noise.items()))
        mean, sigma, low, high = (
            observed_text(target, value) for value in (noise.mean, noise.sigma, noise.low, noise.high)
        )
        return (
            f"{target} {mean} ± {sigma} over {noise.runs} seeds (σ 95 % {low} … {high}); estimator for screening: "
            f"{self.estimator}"
        )


class PilotStage(Stage):
    """Noise, estimator and sizes."""

    name = "pilot"
    title = "Pilot"

    def planned_runs(self, study: Study, profile: Profile) -> int:
        """Runs at the reference setting and at the declared changes."""
        return profile.pilot_runs * len(study.all_experiments) + profile.change_runs * len(study.changes)

    def run(self, chain: Chain, runner: Runner) -> PilotResult:
        """See :func:`pilot`."""
        return pilot(chain.study, chain.profile, runner, chain.bias)


def pilot(study: Study, profile: Profile, runner: Runner, bias: Bias) -> PilotResult:
    """Run the reference setting and the declared changes, choose the estimator and size the study."""
    settings = [Setting(REFERENCE, {}, profile.pilot_runs, study.all_experiments)]
    settings += [Setting(name, values, profile.change_runs) for name, values in study.changes.items()]
    rows = runner.run("pilot", settings)
    target = study.targets[0].observable
    tables = {
        setting.label: {e: responses([runs], e)[0] for e in study.estimators if experiment_of(e) in setting.experiments}
        for setting, runs in zip(settings, rows, strict=True)
    }
    notes: list[str] = []
    noise = _noise(tables[REFERENCE], [target.observable for target in study.targets], notes)
    tables = {label: {e: table[e] for e in table if e in noise} for label, table in tables.items()}
    choice = _choice(tables, target, bias, notes) if study.changes else None
    estimator = target if choice is None else choice.chosen
    spread = _equal_variance({name: table[target] for name, table in tables.items()}, notes)
    after, sizes = sized(study, profile, noise[estimator].sigma, noise[target].sigma)
    notes += [size.statement for size in sizes if size.taken < size.needed]
    screened = study.screening_design.points(len(study.factors)).coded
    count, efficiency = len(screened), main_effect_efficiency(screened)
    return PilotResult(
        settings=tuple(settings),
        runs=tuple(tuple(runs) for runs in rows),
        noise=noise,
        equal_variance=spread,
        estimator=estimator,
        estimator_bias=bias,
        choice=choice,
        profile=after,
        sizes=sizes,
        resolutions=tuple(
            resolution(noise[target].sigma, n, count, len(study.factors), efficiency) for n in (1, 2, 3, 5, 10, 20)
        ),
        notes=tuple(notes),
    )


def sized(
    study: Study, profile: Profile, screening_sigma: float, target_sigma: float
) -> tuple[Profile, tuple[StageSize, ...]]:
    """Return the profile with the replicates that ``resolution_deg`` requires, and the size of each stage.

    ``screening_sigma`` and ``target_sigma``: spread of one pour in the screening's estimator and in the target's
    observable [°]. Without ``resolution_deg`` the profile stays unchanged.
    """
    wanted = profile.resolution_deg
    if wanted is None:
        return profile, ()
    sizes, counts = [], {}
    for rule in _rules(study, screening_sigma, target_sigma):
        # If all pours agree, there is nothing to resolve; two are still needed to show that they agree.
        needed = rule.needed(wanted, rule.sigma) if rule.sigma > 0 else 2
        taken = min(needed, profile.max_replicates)
        sizes.append(StageSize(rule.stage, wanted, needed, taken, rule.resolved(rule.sigma, taken)))
        counts[rule.key] = taken
    return replace(profile, **counts), tuple(sizes)  # type: ignore[arg-type]


def _noise(table: Mapping[str, FloatArray], needed: Sequence[str], notes: list[str]) -> dict[str, Noise]:
    """The noise of every estimator that could be read in two pours; any other is noted, or refused if it is needed."""
    found = {}
    for estimator, values in table.items():
        try:
            found[estimator] = replicate_noise(values)
        except StatisticsError as error:
            if estimator in needed:
                raise StatisticsError(f"{estimator}: {error}") from None
            notes.append(f"{estimator} is no candidate for the screening: at the reference setting {error}.")
    return found


def _choice(
    tables: Mapping[str, Mapping[str, FloatArray]], target: str, bias: Bias, notes: list[str]
) -> EstimatorChoice | None:
    """The choice among the estimators of the target's kind (an angle, or not); None if no choice can be made."""
    candidates = [e for e in tables[REFERENCE] if is_angle(e) == is_angle(target) and not experiment_of(e)]
    groups = {name: {e: table[e] for e in candidates} for name, table in tables.items()}
    centre = groups.pop(REFERENCE)
    readings = {e: [mean for mean, _ in found] for e, found in bias.items()}
    try:
        return choose_estimator(centre, groups, default=target, bias=readings, bias_limit=BIAS_LIMIT_DEG)
    except StatisticsError as error:
        notes.append(f"No estimator could be chosen ({error}); the target's own is used.")
        return None


def _equal_variance(groups: Mapping[str, FloatArray], notes: list[str]) -> EqualVariance | None:
    """Brown–Forsythe over the settings of the pilot; a difference is noted."""
    try:
        found = equal_variance(groups)
    except StatisticsError:
        return None
    if found.p < 0.05:
        notes.append(
            f"The spread differs between the settings of the pilot (Brown–Forsythe p = {found.p:.3g}); the σ at the "
            "reference setting is no more than a summary elsewhere."
        )
    return found


@dataclass(frozen=True)
class _Rule:
    """How one stage is sized: replicates needed for an effect, and the effect that a number of replicates resolves."""

    stage: str
    key: str
    sigma: float
    needed: Callable[[float, float], int]
    resolved: Callable[[float, int], float]


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
