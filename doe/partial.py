"""What a stage would find if it ended now: its own analysis, over the runs that have ended so far."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

from doe.errors import StatisticsError
from doe.runs import Run, Runner, Setting
from doe.study_result import StageResult

Analysis = Callable[[Runner], StageResult | None]
"""A stage as a function of who makes its runs."""
OnPartial = Callable[[str, StageResult], None]
"""Called with (stage, its result so far)."""

LEAST_INTERVAL = 3.0
"""Seconds between two partial results."""
SHARE = 0.02
"""Largest share of the time that the analyses may take."""


class KnownRuns:
    """A runner that makes no run: it answers with those that have ended."""

    def __init__(self, runs: Sequence[Run]) -> None:
        self._runs = sorted(runs, key=lambda run: (run.replicate, run.attempt))

    def run(self, stage: str, settings: Sequence[Setting]) -> list[list[Run]]:
        """See :class:`doe.runs.Runner`; the runs of a setting are those with its label."""
        return [[run for run in self._runs if run.label == setting.label] for setting in settings]


class PartialStages:
    """Follows a campaign: after a run, the result of its stage so far, as soon as one can be computed."""

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
        # Runs from the store come all at once; the next one that is really made finds them all.
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
