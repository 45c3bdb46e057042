"""An earlier answer that a diagnosis goes on from: the effects that its model has by it, and the data joined since."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from doe.declared.given import Given, with_given
from doe.diagnose.diagnosis import joined
from doe.measurement.measurement import Measurement
from explorer.background.output_folder import read_result
from explorer.diagnosis.next_folder import read_next
from explorer.diagnosis.result import DiagnosisResult
from explorer.errors import CommandError


@dataclass(frozen=True)
class Earlier:
    """``given``: effects with their amplitudes; ``follow_ups``: what was measured for the answers before."""

    given: Given
    follow_ups: tuple[Measurement, ...] = ()

    def carried_into(self, measurement: Measurement) -> Measurement:
        """``measurement`` with the follow-ups among its fitted conditions, and the effects in its model."""
        for one in self.follow_ups:
            measurement = joined(measurement, one)
        return with_given(measurement, self.given)


NOTHING_BEFORE = Earlier({})


def earlier_answer(folder: Path) -> Earlier:
    """What the finished diagnosis in ``folder`` hands on, with the follow-ups of those that it goes on from itself.

    Raises CommandError, in one line, where there is none, or no effect in it is as probable as a name has to be.
    """
    result = _read(folder)
    given = result.handed_on()
    if not given:
        raise CommandError(
            f"--given {folder}: {result.verdict}; allowed: a diagnosis in which an effect has {result.threshold:.0%}"
        )
    follow_ups: list[Measurement] = []
    while True:
        if result.order.follow_up:
            follow_ups.insert(0, read_next(Path(result.order.follow_up)).measurement)
        if not result.order.given:
            return Earlier(given, tuple(follow_ups))
        result = _read(Path(result.order.given))


def _read(folder: Path) -> DiagnosisResult:
    result = read_result(DiagnosisResult, folder, DiagnosisResult.NAME)
    if result is None:
        raise CommandError(f"--given {folder}: holds no {DiagnosisResult.NAME}; allowed: a finished diagnosis")
    return result
