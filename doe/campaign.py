"""The whole chain: pilot → screening → assumptions → scan → ascent → surface → optimum → verification."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from doe.errors import StatisticsError, StudyStopped
from doe.partial import Analysis
from doe.profile import Profile
from doe.record import Record, plain
from doe.runner import Run, Runner, Setting
from doe.stages.ascent import AscentResult, ascent
from doe.stages.lines import LINES
from doe.stages.pilot import Bias, PilotResult, pilot
from doe.stages.scan import ScanResult, scan
from doe.stages.screening import ScreeningResult, assumptions, screening
from doe.stages.surface import OptimumResult, SurfaceResult, optimum, surface
from doe.stages.verification import VerificationResult, verification
from doe.study import Study

SCHEMA = 1
STAGES = ("pilot", "screening", "assumptions", "scan", "ascent", "surface", "optimum", "verification")


@dataclass(frozen=True)
class CampaignResult(Record):
    """Everything that a study found; ``to_dict`` is the body of ``result.json``."""

    pilot: PilotResult
    screening: ScreeningResult
    assumptions: ScreeningResult | None
    scan: ScanResult | None
    ascent: AscentResult
    surface: SurfaceResult
    optimum: OptimumResult
    verification: VerificationResult
    stage_seconds: dict[str, float]

    def all_runs(self) -> list[tuple[str, Run]]:
        """(stage, run) of every run, failed ones included."""
        found: list[tuple[str, Run]] = []
        for stage in ("pilot", "screening", "assumptions", "scan", "ascent", "surface"):
            result = getattr(self, stage)
            if result is not None:
                found += [(stage, run) for runs in result.runs for run in runs]
        return found + [("verification", run) for run in self.verification.runs]


def run_campaign(
    study: Study,
    profile: Profile,
    runner: Runner,
    estimator_bias: Bias,
    on_stage: Callable[[str, str], None] = lambda stage, line: None,
    on_begin: Callable[[str, Analysis], None] = lambda stage, analysis: None,
    on_result: Callable[[str, Any], None] = lambda stage, result: None,
) -> CampaignResult:
    """Run every stage; ``on_stage`` is called with (stage, one line of what it found) as each ends.

    ``on_begin`` is called with (stage, its analysis as a function of a runner) before a stage, ``on_result`` with
    (stage, its result or None) after it.

    Raises StudyStopped where what the runs of a stage gave cannot be analysed.
    """
    seconds: dict[str, float] = {}
    counted = CountingRunner(runner)

    def timed(stage: str, work: Analysis) -> Any:
        started = time.perf_counter()
        on_begin(stage, work)
        try:
            result = work(counted)
        except StatisticsError as error:
            seen = ", ".join(f"{number} {outcome}" for outcome, number in counted.outcomes.items())
            raise StudyStopped(stage, f"{error} (the last runs: {seen})", counted.runs) from error
        seconds[stage] = time.perf_counter() - started
        on_result(stage, result)
        on_stage(stage, LINES[stage](result) if result is not None else "not declared in this study")
        return result

    piloted: PilotResult = timed("pilot", lambda by: pilot(study, profile, by, estimator_bias))
    sized = piloted.profile
    response = piloted.estimator
    screened = timed("screening", lambda by: screening(study, sized, by, response))
    assumed = timed("assumptions", lambda by: assumptions(study, sized, by, response))
    noise = piloted.noise[study.targets[0].observable]
    scanned = timed("scan", lambda by: scan(study, sized, by, noise))
    walked = timed("ascent", lambda by: ascent(study, sized, by, screened, noise))
    fitted = timed("surface", lambda by: surface(study, sized, by, walked.factors, walked.region))
    chosen = timed("optimum", lambda _: optimum(study, fitted))
    verified = timed("verification", lambda by: verification(study, sized, by, chosen.values))
    return CampaignResult(piloted, screened, assumed, scanned, walked, fitted, chosen, verified, stage_seconds=seconds)


class CountingRunner:
    """A runner that counts the runs that it was given, failed ones included."""

    def __init__(self, runner: Runner) -> None:
        self._runner, self.runs = runner, 0
        self.outcomes: Counter[str] = Counter()
        """Outcome → number of the stage that ran last."""

    def run(self, stage: str, settings: Sequence[Setting]) -> list[list[Run]]:
        """See :class:`doe.runner.Runner`."""
        rows = self._runner.run(stage, settings)
        self.runs += sum(len(runs) for runs in rows)
        self.outcomes = Counter(run.outcome for runs in rows for run in runs)
        return rows


def summary_of_runs(result: CampaignResult) -> dict[str, Any]:
    """Counts of runs by stage and outcome, and the list of all runs, for ``result.json``."""
    runs = result.all_runs()
    outcomes: dict[str, int] = {}
    stages: dict[str, int] = {}
    for stage, run in runs:
        outcomes[run.outcome] = outcomes.get(run.outcome, 0) + 1
        stages[stage] = stages.get(stage, 0) + 1
    valid = sum(run.valid for _, run in runs)
    listed = [
        {"stage": stage, "label": run.label, "seed": run.seed, "outcome": run.outcome, "key": run.key}
        for stage, run in runs
    ]
    return {
        "total": len(runs),
        "valid": valid,
        "by_outcome": outcomes,
        "by_stage": stages,
        "list": plain(listed),
    }
