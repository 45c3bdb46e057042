"""The whole chain: pilot → screening → assumptions → scan → ascent → surface → optimum → verification."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

from doe.errors import StatisticsError, StudyStopped
from doe.partial import Analysis
from doe.profile import Profile
from doe.runs import Run, Runner, Setting
from doe.stages.ascent import ascent
from doe.stages.pilot import Bias, pilot
from doe.stages.scan import scan
from doe.stages.screening import assumptions, screening
from doe.stages.surface import optimum, surface
from doe.stages.verification import verification
from doe.study import Study
from doe.study_result import AllStages, StageResult

Found = TypeVar("Found", bound=StageResult | None)


@dataclass(frozen=True)
class Campaign:
    """A chain that ran to its end: the result of every stage, and the seconds that each took."""

    stages: AllStages
    seconds: dict[str, float]


def run_campaign(
    study: Study,
    profile: Profile,
    runner: Runner,
    estimator_bias: Bias,
    on_stage: Callable[[str, str], None] = lambda stage, line: None,
    on_begin: Callable[[str, Analysis], None] = lambda stage, analysis: None,
    on_result: Callable[[str, StageResult | None], None] = lambda stage, result: None,
) -> Campaign:
    """Run every stage; ``on_stage`` is called with (stage, one line of what it found) as each ends.

    ``on_begin`` is called with (stage, its analysis as a function of a runner) before a stage, ``on_result`` with
    (stage, its result or None) after it.

    Raises StudyStopped where what the runs of a stage gave cannot be analysed.
    """
    seconds: dict[str, float] = {}
    counted = CountingRunner(runner)

    def timed(stage: str, work: Callable[[Runner], Found]) -> Found:
        started = time.perf_counter()
        on_begin(stage, work)
        try:
            result = work(counted)
        except StatisticsError as error:
            seen = ", ".join(f"{number} {outcome}" for outcome, number in counted.outcomes.items())
            raise StudyStopped(stage, f"{error} (the last runs: {seen})", counted.runs) from error
        seconds[stage] = time.perf_counter() - started
        on_result(stage, result)
        on_stage(stage, result.line if result is not None else "not declared in this study")
        return result

    piloted = timed("pilot", lambda by: pilot(study, profile, by, estimator_bias))
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
    stages = AllStages(
        pilot=piloted,
        screening=screened,
        assumptions=assumed,
        scan=scanned,
        ascent=walked,
        surface=fitted,
        optimum=chosen,
        verification=verified,
    )
    return Campaign(stages, seconds)


class CountingRunner:
    """A runner that counts the runs that it was given, failed ones included."""

    def __init__(self, runner: Runner) -> None:
        self._runner, self.runs = runner, 0
        self.outcomes: Counter[str] = Counter()
        """Outcome → number of the stage that ran last."""

    def run(self, stage: str, settings: Sequence[Setting]) -> list[list[Run]]:
        """See :class:`doe.runs.Runner`."""
        rows = self._runner.run(stage, settings)
        self.runs += sum(len(runs) for runs in rows)
        self.outcomes = Counter(run.outcome for runs in rows for run in runs)
        return rows
