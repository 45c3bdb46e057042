"""Recordings of a live session: a file per pour or a viewer, fed with the frames and statuses that the page shows."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import count
from pathlib import Path

from explorer.files.output_file import check_new_file
from explorer.live.frames import Frame
from explorer.live.messages import SessionState, Status
from explorer.outcomes import outcome_text
from explorer.recordings.blueprint import motion_curves
from explorer.recordings.pour_log import PourLog
from explorer.recordings.recording import FRAME_INTERVAL, RecordedPour, RunningViewer
from explorer.scene.source import differences
from solver.scenes.scene import Scene

Condition = tuple[Scene, str, bool]
"""Parameters in force, what is being done to the pile, and whether anything was done to it before."""
BETWEEN = 0.04
"""Simulated time [s] by which the first status after a change may come later in one run than in another."""


class SessionRecorder:
    """Records into the file ``to``; the k-th pour of the session (a restart begins one) into ``<stem>_<k>.rrd``.

    A name that is taken is passed over. ``pours`` names the files. Into a running viewer every pour is a recording of
    its own there, and no file is kept.

    A pour that is brought back repeats what has been recorded, so nothing is added until it is past that. Where it has
    other parameters than were recorded for its time, or is disturbed otherwise, it is another pour, with a file of its
    own from there on.

    Raises :class:`explorer.errors.CommandError` at once if a file ``to`` cannot be a new recording.
    """

    def __init__(self, to: Path | RunningViewer) -> None:
        if isinstance(to, Path):
            check_new_file(to, suffix=".rrd")
        self._to = to
        self._pours: list[RecordedPour] = []
        self._log: PourLog | None = None
        self._last: Status | None = None
        self._newest: tuple[Frame, Status] | None = None
        self._frame_due = self._until = self._logged = -math.inf
        self._conditions: list[tuple[float, Condition]] = []

    @property
    def pours(self) -> tuple[RecordedPour, ...]:
        """What has been recorded so far, a file per pour, in the order of their beginnings."""
        return tuple(self._pours)

    def take(self, frame: Frame, status: Status) -> None:
        """Log what is new in ``frame`` and ``status``; two of different pours are left for the next call."""
        if frame.generation != status.generation:
            return
        if self._last is None or self._log is None or self._last.generation != status.generation:
            self._log, self._last = self._begin(status), status
            self._log.event(frame.time, f"phase: {status.phase}")
        if frame.time < self._until:
            recorded = self._recorded_about(status.time)
            if condition_of(status) in recorded:
                return
            how = "disturbed otherwise" if status.scene in [one for one, *_ in recorded] else "with other parameters"
            back_at = f"brought back to {frame.time:.3f} s, and on {how}"
            self._log, self._last = self._begin(status), status
            self._log.event(frame.time, back_at)
        elif status.time < self._last.time:
            return  # of a pour that was brought back a moment ago, unlike the frame
        self._until = frame.time
        if condition_of(status) != self._conditions[-1][1]:
            self._conditions.append((status.time, condition_of(status)))
        log, last = self._log, self._last
        for text in news(last, status):
            log.event(frame.time, text)
        ended = status.state == SessionState.ENDED
        just_ended = ended and last.state != SessionState.ENDED
        self._newest = (frame, status)
        if just_ended or frame.time >= self._frame_due:
            self._frame_due = frame.time + FRAME_INTERVAL
            self._log_newest()
        if just_ended:
            log.outcome(frame.time, outcome_text(status.outcome, status.message), status.observables)
        self._last = status

    def close(self) -> None:
        """End the last file, with the newest frame in it."""
        if self._log is not None:
            self._log_newest()
            self._log.close()
            self._log = None

    def _log_newest(self) -> None:
        """Log the newest frame, unless it has been."""
        if self._log is None or self._newest is None or self._newest[0].time <= self._logged:
            return
        frame, status = self._newest
        curves = {name: observed.value for name, observed in status.observables.items()}
        curves |= motion_curves(status.entered_mass, status.discharged_mass, status.kinetic_energy, status.contacts)
        self._log.frame(frame.time, frame, curves, gate_shut=status.gate_shut, surfaces=frame.surfaces)
        self._logged = frame.time
        if self._pours and frame.inside.any():
            self._pours[-1] = self._pours[-1].with_frame(frame.time)

    def _recorded_about(self, time: float) -> list[Condition]:
        """What was in force within ``BETWEEN`` of ``time`` [s] in what has been recorded."""
        ends = [since for since, _ in self._conditions[1:]] + [math.inf]
        return [
            condition
            for (since, condition), end in zip(self._conditions, ends, strict=True)
            if since <= time + BETWEEN and time - BETWEEN <= end
        ]

    def _begin(self, status: Status) -> PourLog:
        self.close()
        self._newest = None
        self._frame_due = self._until = self._logged = -math.inf
        self._conditions = [(status.time, condition_of(status))]
        if isinstance(self._to, RunningViewer):
            return PourLog(self._to, status.scene, status.seed)
        path = self._to if not self._pours else self._next_path(self._to)
        log = PourLog(path, status.scene, status.seed)
        self._pours.append(RecordedPour(path))
        return log

    def _next_path(self, first: Path) -> Path:
        """The next name of a file that is not there yet."""
        names = (first.with_stem(f"{first.stem}_{k}") for k in count(len(self._pours) + 1))
        return next(path for path in names if not path.exists())


def condition_of(status: Status) -> Condition:
    """What has to be the same where a pour that was brought back repeats what has been recorded."""
    return status.scene, status.disturbance, status.disturbed


def news(before: Status, now: Status) -> Iterator[str]:
    """What happened between two statuses of one pour: phases, and parameters that were changed."""
    if now.phase != before.phase:
        yield f"phase: {now.phase}"
    if now.scene != before.scene:
        yield from map(str, differences(before.scene, now.scene))
