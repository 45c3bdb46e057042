"""Reach: can any setting of the factors bring an angle of repose near the target? Checked before much is poured.

Friction and rolling friction raise an angle of repose, restitution lowers it. Therefore two corners of the ranges are
poured: one with every such factor at the end that lowers the angle, one with every such factor at the end that raises
it, the others at their reference. The study stops if the target ± 2 standard errors lies beyond the nearer corner's
mean

    by more than the whole range between the two corners, and by more than 3 standard errors of that mean.

This rough check is designed to err on the side of going on. The range between the corners is not a bound if a factor
acts in another direction than assumed here, or if factors interact; that is why the target must be off by a whole
further range.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from doe.analysis.pilot import Noise
from doe.analysis.t_tests import Sample
from doe.errors import StatisticsError
from doe.record import Record
from doe.run_records import Run, Runner, Setting, sample_of
from doe.stages.stage import Chain, Stage, ended
from doe.studies.factors import is_off
from doe.studies.profile import Profile
from doe.studies.study import Factor, Study
from doe.target import Target, observed_text

DIRECTIONS = {"static_friction": 1, "rolling_friction": 1, "restitution": -1}
"""Last part of a parameter's path → the sign of its effect on an angle of repose."""
ROLLING = "effect.rolling_resistance.rolling_friction"
CORNERS = ("lowest angle", "greatest angle")


@dataclass(frozen=True, kw_only=True)
class ReachResult(Record):
    """The observable at the corners expected to give the lowest and the greatest angle, compared with the target.

    ``standard_errors`` are those of the means, from the runs' own spread or the pilot's, whichever is larger.
    ``beyond``: by how much the target ± 2 standard errors lies beyond the nearer mean; negative between the two; NaN if
    a corner has no valid run.
    """

    factors: tuple[str, ...]
    """Names of the factors whose direction is known."""
    observable: str
    corners: tuple[Sample, Sample]
    standard_errors: tuple[float, float]
    target: float
    target_standard_error: float
    beyond: float
    settings: tuple[Setting, ...] = ()
    runs: tuple[tuple[Run, ...], ...]

    @property
    def within(self) -> bool:
        """Whether the study may continue."""
        low, high = (corner.mean for corner in self.corners)
        nearer = self.standard_errors[0 if abs(low - self.target) < abs(high - self.target) else 1]
        return not (self.beyond > abs(high - low) and self.beyond > 3.0 * nearer)

    @property
    def between(self) -> str:
        """The means at the corners, e.g. "2.1° … 12.0°"."""
        return " … ".join(observed_text(self.observable, mean) for mean in sorted(one.mean for one in self.corners))

    @property
    def line(self) -> str:
        """The findings at the corners in one line."""
        goal = observed_text(self.observable, self.target)
        if math.isnan(self.beyond):
            return f"a corner of the factors has no valid pour, so what they reach is not told; target {goal}"
        past = f", {observed_text(self.observable, self.beyond)} beyond them" if self.beyond > 0.0 else ", within"
        return f"{self.between} between the corners of {len(self.factors)} factors; target {goal}{past}"


def reach(study: Study, profile: Profile, runner: Runner, noise: Noise) -> ReachResult | None:
    """Pour the two corners; None if the target is not an angle of repose, no direction is known, or no runs are wanted.

    ``noise``: that of the target's observable in the pilot. Raises StatisticsError if the target is out of reach.
    """
    target, known = study.targets[0], of_known_direction(study)
    if not asked(study, profile):
        return None
    settings = [
        Setting(
            name,
            {factor.path: factor.level(sign * DIRECTIONS[_kind(factor)]) for factor in known},
            profile.reach_runs,
        )
        for name, sign in zip(CORNERS, (-1, 1), strict=True)
    ]
    rows = runner.run("reach", settings)
    low, high = (sample_of(runs, target.observable) for runs in rows)
    errors = [max(noise.sigma, 0.0 if math.isnan(one.sd) else one.sd) / math.sqrt(max(one.n, 1)) for one in (low, high)]
    ends, slack = (low.mean, high.mean), 2.0 * target.standard_error
    beyond = max(target.mean - slack - max(ends), min(ends) - target.mean - slack)
    found = ReachResult(
        factors=tuple(factor.name for factor in known),
        observable=target.observable,
        corners=(low, high),
        standard_errors=(errors[0], errors[1]),
        target=target.mean,
        target_standard_error=target.standard_error,
        beyond=math.nan if low.n == 0 or high.n == 0 else beyond,
        settings=tuple(settings),
        runs=tuple(tuple(runs) for runs in rows),
    )
    if not found.within:
        raise StatisticsError(_hopeless(found, target, study))
    return found


def asked(study: Study, profile: Profile) -> bool:
    """Return whether the corners are poured in this study."""
    of_a_pile = study.targets[0].observable.startswith("angle_of_repose")
    return of_a_pile and profile.reach_runs > 0 and bool(of_known_direction(study))


def of_known_direction(study: Study) -> tuple[Factor, ...]:
    """Return the factors whose effect on an angle of repose has a known sign."""
    return tuple(factor for factor in study.factors if _kind(factor) in DIRECTIONS)


def _kind(factor: Factor) -> str:
    return factor.path.rpartition(".")[2]


def _hopeless(found: ReachResult, target: Target, study: Study) -> str:
    goal, spread = observed_text(target.observable, target.mean), 2.0 * target.standard_error
    margin = f" ± {observed_text(target.observable, spread)}" if spread else ""
    cause = "a parameter that no factor varies"
    if target.mean > max(one.mean for one in found.corners):
        cause = "a missing effect"
        varied = ROLLING in (factor.path for factor in study.factors)
        if not varied and is_off(study.scene, ROLLING):
            cause += " (rolling resistance is none now: add [effect.rolling_resistance] rolling_friction = 0.1)"
    return (
        f"out of reach: {found.between} over the ranges of {', '.join(found.factors)} against {goal}{margin}; likely "
        f"{cause}, the rig, or the shapes; `explorer calibrate --beyond-reach`, or reach_runs = 0 in the profile, goes "
        "on nevertheless"
    )


class ReachStage(Stage):
    """The two corners of the factors."""

    name = "reach"
    title = "Reach"

    def planned_runs(self, study: Study, profile: Profile) -> int:
        """Runs at both corners, if they are poured."""
        return len(CORNERS) * profile.reach_runs if asked(study, profile) else 0

    def run(self, chain: Chain, runner: Runner) -> ReachResult | None:
        """See :func:`reach`."""
        return reach(
            chain.study, chain.profile, runner, ended(chain.found.pilot).noise[chain.study.targets[0].observable]
        )
