"""A calibration in a process of its own, at lower priority, so that the live pour stays smooth.

What runs is the command line's ``calibrate --headless``. It writes ``progress.jsonl`` into its output folder,
one object per event, which is all that is read here:

    {"time": seconds, "stage": text, "done": runs, "planned": runs, "eta_s": seconds or null, "line": text or null}
"""

from __future__ import annotations

import fcntl
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Any, Literal, Protocol

from explorer.errors import CommandError

StudyState = Literal["idle", "running", "cancelled", "finished", "failed"]

PROFILES = ("quick", "standard", "full")
NICENESS = 10
CANCEL_WAIT = 5.0
"""Seconds that a cancelled calibration has to write what it has, before it is ended for good."""
DONE_ABOVE_LIMIT = 3
"""Exit code of ``calibrate``: the chain is complete, the error is above the limit that was asked for."""


@dataclass(frozen=True)
class StudyStatus:
    """How far a study is. ``lines`` are partial results, one per finished stage."""

    state: StudyState
    stage: str = ""
    done: int = 0
    planned: int = 0
    eta_s: float | None = None
    lines: tuple[str, ...] = ()
    message: str = ""


class StudyProcess(Protocol):
    """What the page needs of a study that runs somewhere."""

    def start(self, profile: str) -> None:
        """Start a new study. Raises StudyError where one runs already or the profile is unknown."""

    def cancel(self) -> None:
        """Stop the study that runs; finished runs are kept."""

    def resume(self) -> None:
        """Go on with the study that was started last, also before this page. Raises StudyError where there is none."""

    def status(self) -> StudyStatus:
        """State, progress and partial results."""


class StudyError(CommandError):
    """A study that cannot be started or resumed; one line, fit for a user."""


class CalibrationProcess:
    """``explorer calibrate`` as a child process.

    Args:
        study_file: the study.
        folder: output folders are made in here, one per start: ``<study>-<profile>-<date>-<time>``.
        store: file of the store of runs; None for the default store.
        program: how the command line is called.
    """

    def __init__(
        self,
        study_file: Path,
        folder: Path,
        store: Path | None = None,
        program: Sequence[str] = (sys.executable, "-m", "explorer"),
    ) -> None:
        self._study_file, self._folder, self._store, self._program = study_file, folder, store, tuple(program)
        self._process: subprocess.Popen[bytes] | None = None
        self._out: Path | None = None
        self._profile = ""
        self._cancelled_at: float | None = None
        self._read = 0
        self._status = StudyStatus("idle")

    def start(self, profile: str) -> None:
        """Start a new calibration with ``profile``."""
        if profile not in PROFILES:
            raise StudyError(f"profile: {profile!r} is not one of {', '.join(PROFILES)}")
        self._refuse_while_running()
        self._out = self._new_folder(profile)
        self._profile, self._read = profile, 0
        self._status = StudyStatus("idle")
        self._launch()

    def resume(self) -> None:
        """Go on where the last calibration was stopped, be it one of an earlier session of the page.

        Runs that are in the store are not repeated.
        """
        self._refuse_while_running()
        if self._out is None:
            self._out, self._profile = self._unfinished()
        # A resumed study tells every stage again, so what it said before it was stopped is dropped.
        progress = self._out / "progress.jsonl"
        self._read = progress.stat().st_size if progress.is_file() else 0
        self._status = StudyStatus("idle")
        self._launch("--resume")

    def cancel(self) -> None:
        """Ask the calibration to stop; :meth:`status` ends it for good if it has not after ``CANCEL_WAIT``."""
        if self._process is not None and self._process.poll() is None:
            self._process.terminate()
            self._cancelled_at = time.monotonic()
            self._status = replace(self._status, message="stopping")

    def close(self) -> None:
        """Cancel what runs and wait for its end."""
        self.cancel()
        while self.status().state == "running":
            time.sleep(0.05)

    def status(self) -> StudyStatus:
        """State, progress and partial results, as far as the calibration has written them."""
        if self._process is None:
            return self._status
        code = self._process.poll()
        # Read after asking: what a process that is over wrote last is in the file by now.
        self._take_progress()
        if code is not None:
            self._process = None
            self._status = replace(self._status, eta_s=None, **self._ending(code))
        elif self._cancelled_at is not None and time.monotonic() > self._cancelled_at + CANCEL_WAIT:
            os.killpg(self._process.pid, signal.SIGKILL)
        return self._status

    def command(self, *options: str) -> list[str]:
        """The command line that is run, as a person would type it."""
        store = () if self._store is None else ("--store", str(self._store))
        study = ("--study", str(self._study_file), "--profile", self._profile)
        return [*self._program, "calibrate", "--headless", *study, "--out", str(self._out), *store, *options]

    def _launch(self, *options: str) -> None:
        nice = shutil.which("nice")
        lower = [nice, "-n", str(NICENESS)] if nice else []
        with self._log().open("ab") as log:
            # The child inherits the lock with the open file, and holds it to its end, whatever becomes of the page.
            try:
                fcntl.flock(log, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise StudyError(f"{self._out}: runs already, started from another page") from None
            # A session of its own: Ctrl-C for the page must not cut a run in two, cancel() ends it in order.
            self._process = subprocess.Popen(
                [*lower, *self.command(*options)],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        self._cancelled_at = None
        self._status = replace(self._status, state="running", message="")

    def _refuse_while_running(self) -> None:
        if self.status().state == "running":
            raise StudyError("a study is running already; cancel it first")

    def _new_folder(self, profile: str) -> Path:
        self._folder.mkdir(parents=True, exist_ok=True)
        stem = f"{self._study_file.stem}-{profile}-{time.strftime('%Y%m%d-%H%M%S')}"
        names = [stem, *(f"{stem}-{k}" for k in range(2, 100))]
        return next(self._folder / name for name in names if not (self._folder / name).exists())

    def _unfinished(self) -> tuple[Path, str]:
        """Newest folder of this study that holds no result, and its profile."""
        name = re.compile(rf"{re.escape(self._study_file.stem)}-({'|'.join(PROFILES)})-(\d{{8}}-\d{{6}}(-\d+)?)")
        named = [(match, one) for one in self._folder.glob("*/") if (match := name.fullmatch(one.name))]
        stopped = [(match[2], match[1], one) for match, one in named if not (one / "result.json").exists()]
        if not stopped:
            raise StudyError("no study has been stopped before its end; there is nothing to resume")
        _, profile, folder = max(stopped)
        return folder, profile

    def _log(self) -> Path:
        # Beside the output folder: that one has to be empty for a new study.
        return Path(f"{self._out}.log")

    def _ending(self, code: int) -> dict[str, Any]:
        if self._cancelled_at is not None and code != 0:
            return {"state": "cancelled", "message": "finished runs are kept; resume goes on from there"}
        if code == 0:
            return {"state": "finished", "message": f"report: {self._out}/report.html"}
        if code == DONE_ABOVE_LIMIT:
            return {"state": "finished", "message": f"above the error limit; report: {self._out}/report.html"}
        return {"state": "failed", "message": f"calibrate ended with exit code {code}: {self._last_words()}"}

    def _last_words(self) -> str:
        lines = self._log().read_text(encoding="utf-8", errors="replace").strip().splitlines()
        return lines[-1][:300] if lines else f"no output; see {self._log()}"

    def _take_progress(self) -> None:
        if self._out is None or not (file := self._out / "progress.jsonl").is_file():
            return
        if file.stat().st_size < self._read:  # a resumed study begins the file anew
            self._read = 0
        with file.open("rb") as stream:
            stream.seek(self._read)
            for line in _whole_lines(stream):
                self._read += len(line)
                self._status = advanced(self._status, line)


def advanced(status: StudyStatus, line: bytes) -> StudyStatus:
    """``status`` after one line of ``progress.jsonl``; a line that is no such object leaves it as it is."""
    try:
        event = json.loads(line)
        eta = event["eta_s"]
        stage, done, planned = str(event["stage"]), int(event["done"]), int(event["planned"])
        eta_s = None if eta is None else float(eta)
        result = event["line"]
    except (ValueError, KeyError, TypeError):
        return status
    lines = status.lines if result is None else (*status.lines, str(result))
    return replace(status, stage=stage, done=done, planned=planned, eta_s=eta_s, lines=lines)


def _whole_lines(stream: IO[bytes]) -> list[bytes]:
    """Lines that end in a newline; the writer may be in the middle of the last one."""
    return [line for line in stream if line.endswith(b"\n")]
