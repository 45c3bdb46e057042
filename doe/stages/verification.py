"""Verification: fresh pours at the optimum, compared with every target."""

from __future__ import annotations

import math
from dataclasses import dataclass

from doe.analysis.power import smallest_effect
from doe.analysis.verification import Verification, verify
from doe.record import Record
from doe.run_records import Run, Runner, Setting, no_pile_shares, responses
from doe.stages.stage import Chain, Stage, ended
from doe.studies.profile import Profile
from doe.studies.study import Study
from doe.target import Target, observed_text


@dataclass(frozen=True, kw_only=True)
class VerificationResult(Record):
    """Fresh runs at ``values`` [SI] and the test of each target."""

    values: dict[str, float]
    settings: tuple[Setting, ...] = ()
    runs: tuple[Run, ...]
    no_pile_share: float
    targets: tuple[Target, ...]
    tests: tuple[Verification, ...]
    smallest_difference: tuple[float, ...]
    """Per target: the difference from the measured mean that would have been detected with power 0.8 (Welch)."""

    @property
    def line(self) -> str:
        """The findings of the verification in one line."""
        several = len(self.targets) > 1
        line = " ".join(
            f"{f'{target.observable}: ' if several else ''}{test.statement}"
            + ("" if target.mean == 0.0 else f" Relative error {test.relative_error_percent:.2f} %.")
            for target, test in zip(self.targets, self.tests, strict=True)
        )
        for target, found in zip(self.targets, self.tests, strict=True):
            if target.before_mean is not None:
                name = target.observable
                errors = [abs(mean - target.mean) for mean in (target.before_mean, found.simulated.mean)]
                before, after = (observed_text(name, error) for error in errors)
                line += f" {name} off by {before} before and {after} after."
        return line


def verification(study: Study, profile: Profile, runner: Runner, values: dict[str, float]) -> VerificationResult:
    """Run the optimum with seeds that no other stage has used, and compare the runs with the measurement."""
    settings = (Setting("optimum", dict(values), profile.verification_runs, study.all_experiments),)
    rows = runner.run("verification", settings)
    tests = tuple(verify(responses(rows, t.observable)[0], t.mean, t.sd, t.n, margin=t.margin) for t in study.targets)
    return VerificationResult(
        values=values,
        settings=settings,
        runs=tuple(rows[0]),
        no_pile_share=float(no_pile_shares(rows)[0]),
        targets=study.targets,
        tests=tests,
        smallest_difference=tuple(_smallest_difference(test) for test in tests),
    )


def _smallest_difference(test: Verification) -> float:
    simulated, measured = test.simulated, test.target
    parts = [(s.sd**2 / s.n, s.n) for s in (simulated, measured) if s.n > 1 and math.isfinite(s.sd)]
    if not parts or simulated.n < 2:
        return math.nan
    variance = sum(part for part, _ in parts)
    df = variance**2 / sum(part**2 / (n - 1) for part, n in parts) if variance > 0 else math.inf
    return smallest_effect(math.sqrt(variance), df) if variance > 0 else 0.0


class VerificationStage(Stage):
    """Fresh pours at the optimum."""

    name = "verification"
    title = "Verification"

    def planned_runs(self, study: Study, profile: Profile) -> int:
        """Runs as set in the profile, in every experiment."""
        return profile.verification_runs * len(study.all_experiments)

    def run(self, chain: Chain, runner: Runner) -> VerificationResult:
        """See :func:`verification`."""
        return verification(chain.study, chain.profile, runner, ended(chain.found.optimum).values)
