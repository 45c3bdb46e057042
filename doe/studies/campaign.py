"""The whole chain of a study, pilot → reach → screening → … → verification (`doe.stages`).

It includes the stages that other packages add. While a stage runs, :class:`PartialStages` gives the result that it
would have if it ended now: its own analysis, applied to the runs finished so far.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

from doe.errors import StatisticsError, StudyStopped
from doe.run_records import Run, Runner, Setting
from doe.stages import stages_of
from doe.stages.stage import Bias, Chain
from doe.studies.profile import Profile
from doe.studies.study import Study
from doe.studies.study_result import AllStages, StageResult, Stages

Analysis = Callable[[Runner], StageResult | None]
"""A stage as a function of the runner that makes its runs."""
OnPartial = Callable[[str, StageResult], None]
"""Called with (stage, its result so far)."""

LEAST_INTERVAL = 3.0
"""Least number of seconds between two partial results."""
SHARE = 0.02
"""Largest share of the time that partial analyses may take."""


@dataclass(frozen=True)
class Campaign:
    """A completed chain: the result of every stage, and the time in seconds that each took."""

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
    """Run every stage; as each ends, ``on_stage`` is called with (stage, its findings in one line).

    ``on_begin`` is called with (stage, its analysis as a function of a runner) before a stage, ``on_result`` with
    (stage, its result or None) after it.

    Raises StudyStopped if the results of the runs of a stage cannot be analysed.
    """
    seconds: dict[str, float] = {}
    counted, found = CountingRunner(runner), Stages()
    for stage in stages_of(study):
        sized = profile if found.pilot is None else found.pilot.profile
        work = partial(stage.run, Chain(study, sized, estimator_bias, found))
        started = time.perf_counter()
        on_begin(stage.name, work)
        try:
            result = work(counted)
        except StatisticsError as error:
            seen = ", ".join(f"{number} {outcome}" for outcome, number in counted.outcomes.items())
            raise StudyStopped(stage.name, f"{error} (the last runs: {seen})", counted.runs) from error
        seconds[stage.name] = time.perf_counter() - started
        found = found.with_result(stage.name, result)
        on_result(stage.name, result)
        on_stage(stage.name, result.line if result is not None else "not declared in this study")
    return Campaign(AllStages(**vars(found)), seconds)


class CountingRunner:
    """A runner that counts the runs that another runner returns, including failed ones."""

    def __init__(self, runner: Runner) -> None:
        self._runner, self.runs = runner, 0
        self.outcomes: Counter[str] = Counter()
        """Outcome → number of runs, of the last call."""

    def run(self, stage: str, settings: Sequence[Setting]) -> list[list[Run]]:
        """See :class:`doe.run_records.Runner`."""
        rows = self._runner.run(stage, settings)
        self.runs += sum(len(runs) for runs in rows)
        self.outcomes = Counter(run.outcome for runs in rows for run in runs)
        return rows


class PartialStages:
    """Follows a campaign and reports, as runs end, the result of the stage so far, once one can be computed."""

    def __init__(self, on_partial: OnPartial, clock: Callable[[], float] = time.perf_counter) -> None:
        self._on_partial, self._clock = on_partial, clock
        self._stage = ""
        self._analysis: Analysis | None = None
        self._runs: list[Run] = []
        self._due = 0.0

    def begin(self, stage: str, analysis: Analysis) -> None:
        """A stage begins; ``analysis`` gives its result from any runner."""
        self._stage, self._analysis, self._runs = stage, analysis, []

    def add(self, stage: str, run: Run) -> None:
        """A run of ``stage`` has ended."""
        if stage != self._stage or self._analysis is None:
            return
        self._runs.append(run)
        began = self._clock()
        # Runs from the store arrive all at once; they are analysed when the next run is really made.
        if run.reused or began < self._due:
            return
        try:
            result = self._analysis(KnownRuns(self._runs))
        except StatisticsError:  # too few runs to say anything yet
            result = None
        if result is not None:
            self._on_partial(stage, result)
        now = self._clock()
        self._due = now + max(LEAST_INTERVAL if result is not None else 0.0, (now - began) / SHARE)


class KnownRuns:
    """A runner that makes no runs: it returns those that have already ended."""

    def __init__(self, runs: Sequence[Run]) -> None:
        self._runs = sorted(runs, key=lambda run: (run.replicate, run.attempt))

    def run(self, stage: str, settings: Sequence[Setting]) -> list[list[Run]]:
        """See :class:`doe.run_records.Runner`; the runs of a setting are found by its label."""
        return [[run for run in self._runs if run.label == setting.label] for setting in settings]
