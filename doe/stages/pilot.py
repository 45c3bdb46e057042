"""Pilot: how noisy is one pour at the reference setting, which estimator shows a change best, how many runs follow."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from doe.errors import StatisticsError
from doe.pilot import BIAS_LIMIT_DEG, EqualVariance, Noise, Resolution, equal_variance, replicate_noise, resolution
from doe.power import main_effect_efficiency
from doe.profile import Profile
from doe.record import Record
from doe.runs import FloatArray, Run, Runner, Setting, responses
from doe.separation import EstimatorChoice, choose_estimator
from doe.stages.sizing import StageSize, sized
from doe.stages.stage import Bias, Chain, Stage
from doe.study import Study
from doe.target import is_angle


@dataclass(frozen=True, kw_only=True)
class PilotResult(Record):
    """Noise per estimator, the choice among them, and the sizes of the stages that follow.

    ``estimator`` serves the screening; ``equal_variance`` compares the spread of the target's observable at the
    reference setting and under the declared changes (None where that cannot be tested).
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
        """One line of what the pilot found."""
        target, noise = next(iter(self.noise.items()))
        return (
            f"{target} {noise.mean:.1f} ± {noise.sigma:.1f} over {noise.runs} seeds "
            f"(σ 95 % {noise.low:.1f} … {noise.high:.1f}); estimator for screening: {self.estimator}"
        )


def pilot(study: Study, profile: Profile, runner: Runner, bias: Bias) -> PilotResult:
    """Run the reference setting and the declared changes, choose the estimator and size the study."""
    settings = [Setting("reference", {}, profile.pilot_runs)]
    settings += [Setting(name, values, profile.change_runs) for name, values in study.changes.items()]
    rows = runner.run("pilot", settings)
    target = study.targets[0].observable
    tables = {
        setting.label: {e: responses([runs], e)[0] for e in study.estimators}
        for setting, runs in zip(settings, rows, strict=True)
    }
    noise = {e: replicate_noise(values) for e, values in tables["reference"].items()}
    notes: list[str] = []
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


def _choice(
    tables: Mapping[str, Mapping[str, FloatArray]], target: str, bias: Bias, notes: list[str]
) -> EstimatorChoice | None:
    """The choice among the estimators of the target's kind (an angle, or not); None where none can be made."""
    candidates = [e for e in tables["reference"] if is_angle(e) == is_angle(target)]
    groups = {name: {e: table[e] for e in candidates} for name, table in tables.items()}
    centre = groups.pop("reference")
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


class PilotStage(Stage):
    """Noise, estimator and sizes."""

    name = "pilot"
    title = "Pilot"

    def planned_runs(self, study: Study, profile: Profile) -> int:
        """The reference setting, and the declared changes."""
        return profile.pilot_runs + profile.change_runs * len(study.changes)

    def run(self, chain: Chain, runner: Runner) -> PilotResult:
        """See :func:`pilot`."""
        return pilot(chain.study, chain.profile, runner, chain.bias)
