"""Recordings of a live session: a file per pour, fed with the frames and statuses that the page shows."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

from explorer.live.frames import Frame
from explorer.live.messages import SessionState, Status
from explorer.logs.blueprint import motion_curves
from explorer.logs.pour_log import PourLog
from explorer.new_file import check_new_file
from explorer.outcomes import outcome_text
from explorer.scene_changes import changes

FRAME_INTERVAL = 0.02
"""Simulated time [s] between frames that are kept."""


class SessionRecorder:
    """Records into ``path``; the k-th pour of the session (a restart begins one) into ``<stem>_<k>.rrd``.

    Raises :class:`explorer.errors.CommandError` at once if ``path`` cannot be a new recording.
    """

    def __init__(self, path: Path) -> None:
        check_new_file(path, suffix=".rrd")
        self._path = path
        self._pours = 0
        self._log: PourLog | None = None
        self._last: Status | None = None
        self._frame_due = -math.inf

    def take(self, frame: Frame, status: Status) -> None:
        """Log what is new in ``frame`` and ``status``; two of different pours are left for the next call."""
        if frame.generation != status.generation:
            return
        if self._last is None or self._log is None or self._last.generation != status.generation:
            self._log, self._last = self._begin(status), status
            self._log.event(frame.time, f"phase: {status.phase}")
        log, last = self._log, self._last
        for text in news(last, status):
            log.event(frame.time, text)
        ended = status.state == SessionState.ENDED
        just_ended = ended and last.state != SessionState.ENDED
        if just_ended or frame.time >= self._frame_due:
            self._frame_due = frame.time + FRAME_INTERVAL
            curves = {name: observed.value for name, observed in status.observables.items()}
            curves |= motion_curves(status.entered_mass, status.discharged_mass, status.kinetic_energy, status.contacts)
            log.frame(frame.time, frame, curves, gate_shut=status.gate_shut, surfaces=frame.surfaces)
        if just_ended:
            log.outcome(frame.time, outcome_text(status.outcome, status.message), status.observables)
        self._last = status

    def close(self) -> None:
        """End the last file."""
        if self._log is not None:
            self._log.close()
            self._log = None

    def _begin(self, status: Status) -> PourLog:
        self.close()
        self._pours += 1
        self._frame_due = -math.inf
        name = self._path.stem if self._pours == 1 else f"{self._path.stem}_{self._pours}"
        return PourLog(self._path.with_name(f"{name}.rrd"), status.scene, status.seed)


def news(before: Status, now: Status) -> Iterator[str]:
    """What happened between two statuses of one pour: phases, and parameters that were changed."""
    if now.phase != before.phase:
        yield f"phase: {now.phase}"
    if now.scene != before.scene:
        yield from changes(before.scene, now.scene)
