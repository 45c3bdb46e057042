"""Recordings of pours that run in this process, one file per pour; of a study, those of its verification.

They are fed from ``run_pours(on_sample=…)``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from itertools import count
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

from explorer.errors import CommandError
from explorer.files.output_file import check_new_file
from explorer.outcomes import outcome_text
from explorer.recordings.blueprint import motion_curves
from explorer.recordings.pour_log import PourLog
from explorer.recordings.recording import FRAME_INTERVAL, RecordedPour
from solver import Outcome, Record
from solver.observables import observe
from solver.observables.pile import angle_of_repose
from solver.observables.reading import PileReading
from solver.pours.record_builder import lying, member_spheres, pile_of

if TYPE_CHECKING:
    from solver.pours.pour import Pour

ANGLE_INTERVAL = 0.1
"""Simulated time [s] between readings of the angle."""
RECORDED_STAGE = "verification"


def recorder_of(path: Path, seeds: Sequence[int]) -> PourRecorder:
    """Recorder into ``path`` for one seed, ``<stem>_<seed>.rrd`` for several; refuses files that exist."""
    several = len(seeds) > 1
    paths = [path.with_name(f"{path.stem}_{seed}{path.suffix}") if several else path for seed in seeds]
    for one in paths:
        check_new_file(one, suffix=".rrd")
    return PourRecorder(paths)


class PourRecorder:
    """Logs pour k into ``paths[k]``. A context manager: at its end, files of unfinished pours are closed."""

    def __init__(self, paths: Sequence[Path]) -> None:
        self._paths = paths
        self._open: dict[int, FollowedPour] = {}
        self._pours: dict[int, RecordedPour] = {}

    @property
    def pours(self) -> tuple[RecordedPour, ...]:
        """What has been recorded so far, in the order of the pours."""
        return tuple(self._pours[k] for k in sorted(self._pours))

    def sample(self, k: int, pour: Pour) -> None:
        """Log the present state of pour ``k`` if a frame is due (always when it has ended)."""
        if k not in self._open:
            self._open[k] = FollowedPour(PourLog(self._paths[k], pour.declared, pour.seed))
            self._pours[k] = RecordedPour(self._paths[k])
        if self._open[k].sample(pour):
            self._pours[k] = self._pours[k].with_frame(pour.time)

    def finish(self, k: int, record: Record) -> None:
        """Log the outcome of pour ``k`` and close its file. One that was interrupted at its very end has none."""
        followed = self._open.pop(k, None)
        if followed is None:
            return
        with followed.log:
            followed.finish(record)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with ExitStack() as stack:
            for followed in self._open.values():
                stack.enter_context(followed.log)
        self._open.clear()


class FollowedPour:
    """The log of one pour and what was logged last."""

    def __init__(self, log: PourLog) -> None:
        self.log = log
        self.time = 0.0
        self._frame_due = self._angle_due = -math.inf
        self._phase = ""

    def sample(self, pour: Pour) -> bool:
        """Log the present state if it is due; whether a frame with a body was logged."""
        self.time = pour.time
        if pour.phase != self._phase:
            self._phase = pour.phase
            self.log.event(pour.time, f"phase: {pour.phase}", step=pour.steps)
        ended = pour.outcome != Outcome.RUNNING
        if not ended and pour.time < self._frame_due:
            return False
        # Half a sample early is in time: samples do not fall on multiples of the interval exactly.
        slack = 0.5 * pour.scene.numerics.sample_interval
        self._frame_due = pour.time + FRAME_INTERVAL - slack
        finite = pour.outcome != Outcome.NON_FINITE
        curves = dict(_curves(pour.samples[-1]))
        if finite and (ended or pour.time >= self._angle_due):
            self._angle_due = pour.time + ANGLE_INTERVAL - slack
            curves["angle_of_repose_deg"] = _angle_deg(pour)
        # The last finite state stays on the screen when a run has diverged.
        if not finite:
            return False
        bodies, surfaces = pour.bodies(), pour.surface_poses()
        self.log.frame(pour.time, bodies, curves, step=pour.steps, gate_shut=pour.gate_shut, surfaces=surfaces)
        return bool(bodies.inside.any())

    def finish(self, record: Record) -> None:
        """Log the outcome and what was read off the pile."""
        text = outcome_text(record.outcome, record.message)
        self.log.outcome(self.time, text, observe(record), step=record.steps)


def _curves(sample: Mapping[str, float]) -> Mapping[str, float]:
    return motion_curves(sample["entered"], sample["discharged"], sample["kinetic"], sample["touching"])


def _angle_deg(pour: Pour) -> float:
    bodies = pour.bodies()
    pile = pile_of(bodies, member_spheres(pour.scene, bodies), lying(pour.container, bodies))
    return angle_of_repose(PileReading(pile)).value


def _aside(path: Path) -> Path:
    """A name beside ``path`` that nobody has."""
    return next(one for n in count(1) if not (one := path.with_stem(f"{path.stem}_before_{n}")).exists())


def check_recordings(folder: Path, resume: bool) -> None:
    """Refuse a ``folder`` with recordings of a verification, unless the study is gone on with."""
    if not resume and (found := sorted(folder.glob(f"{RECORDED_STAGE}_*.rrd"))):
        raise CommandError(f"--record {folder}: holds {found[0].name} already; name a folder without such recordings")


class StudyRecorder:
    """Observer of a study's pours that records those of the verification into ``folder``.

    A file of the same name, as that of a pour that was cut off and is made anew, stays beside it with ``_before_1`` in
    its name: it may be of another study.
    """

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._folder = folder
        self._stack = ExitStack()
        self._recorders: dict[int, PourRecorder] = {}

    def sample(self, stage: str, seed: int, pour: Pour) -> None:
        """Log the present state of a pour."""
        if stage != RECORDED_STAGE:
            return
        if seed not in self._recorders:
            path = self._folder / f"{RECORDED_STAGE}_{seed}.rrd"
            if path.exists():
                path.rename(_aside(path))
            self._recorders[seed] = self._stack.enter_context(recorder_of(path, [seed]))
        self._recorders[seed].sample(0, pour)

    def finish(self, stage: str, seed: int, record: Record) -> None:
        """Log the outcome of a pour and close its file."""
        if stage == RECORDED_STAGE:
            self._recorders[seed].finish(0, record)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()
