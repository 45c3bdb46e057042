"""A command of the command line in a process of its own.

It has lower priority, so that the live pour stays smooth. The command writes ``progress.jsonl`` into its output folder,
one `explorer.background.events.ProgressEvent` per line, which is all that is read here.
"""

from __future__ import annotations

import fcntl
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import IO, Any, Literal

from explorer.background.events import PROGRESS, ProgressEvent, StageProgress, TriedRun, with_event, with_run
from explorer.errors import CommandError
from explorer.priority import BACKGROUND, lowered, session_gives_way

CommandState = Literal["idle", "running", "paused", "cancelled", "finished", "failed"]

CANCEL_WAIT = 5.0
"""Seconds that a cancelled command has to write what it has, before it is ended for good."""
LOCK_WAIT = 1.0
"""Seconds that the folder of a command of our own, which has ended, may stay locked by its workers."""
PROGRAM = (sys.executable, "-m", "explorer")
"""How the command line is called."""


@dataclass(frozen=True)
class CommandStatus:
    """How far a command is. ``lines`` are partial results, one per finished stage; ``tried`` as in `with_run`."""

    state: CommandState
    stage: str = ""
    done: int = 0
    planned: int = 0
    eta_s: float | None = None
    lines: tuple[str, ...] = ()
    message: str = ""
    stages: tuple[StageProgress, ...] = ()
    tried: tuple[TriedRun, ...] = ()

    @property
    def alive(self) -> bool:
        """True while the command's process is there, at work or paused."""
        return self.state in ("running", "paused")


class BackgroundError(CommandError):
    """A command that cannot be started or resumed; one line, fit for a user."""


HERE = "this machine"


class PourPlace:
    """Where commands pour that are started from now on: on this machine, or on the workers of a Dask scheduler.

    Whoever may name a scheduler makes this machine run what that scheduler sends: Dask's messages hold code. So the
    address is given by who starts the server, and a browser can only choose between it and this machine.
    """

    def __init__(self, scheduler: str = "") -> None:
        self.offered = (scheduler, HERE) if scheduler else (HERE,)
        """What there is to choose from."""
        self.chosen = self.offered[0]

    def choose(self, name: str) -> None:
        """Pour there from the next command on. Raises BackgroundError for what is not offered."""
        if name not in self.offered:
            raise BackgroundError(f"pour on: {name!r} is not one of {', '.join(self.offered)}")
        self.chosen = name

    @property
    def arguments(self) -> tuple[str, ...]:
        """What a command is told."""
        return () if self.chosen == HERE else ("--scheduler", self.chosen)


class CommandProcess:
    """One command at a time as a child process.

    Args:
        what: what a run of it is called, such as "study".
        endings: exit code of a finished command → what to say before the path of the report.
        program: how the command line is called.
    """

    def __init__(self, what: str, endings: Mapping[int, str], program: Sequence[str] = PROGRAM) -> None:
        self._what, self._endings, self._program = what, dict(endings), tuple(program)
        self._process: subprocess.Popen[bytes] | None = None
        self._command = ""
        self._waker: subprocess.Popen[bytes] | None = None
        self._cancelled_at: float | None = None
        self._read = 0
        self._status = CommandStatus("idle")
        self.out: Path | None = None
        """Output folder of the command that was started last."""

    def start(self, out: Path, arguments: Sequence[str]) -> None:
        """Start a command with the new output folder ``out``; ``arguments`` without it. Raises BackgroundError."""
        self.refuse_while_running()
        self._read = 0
        self._launch(out, arguments)

    def resume(self, out: Path, arguments: Sequence[str]) -> None:
        """Go on in ``out``, where a command was stopped. Raises BackgroundError."""
        self.refuse_while_running()
        # A resumed command tells every stage again, so what it said before it was stopped is dropped.
        progress = out / PROGRESS
        self._read = progress.stat().st_size if progress.is_file() else 0
        self._launch(out, (*arguments, "--resume"))

    def cancel(self) -> None:
        """Ask the command to stop; :meth:`status` ends it for good if it has not after ``CANCEL_WAIT``."""
        if self._process is not None and self._process.poll() is None:
            self.go_on()
            self._process.terminate()
            self._cancelled_at = time.monotonic()
            self._status = replace(self._status, message="stopping")

    def pause(self) -> None:
        """Let the command stand still, workers and all; it keeps its memory and gives the cores free."""
        if self.status().state == "running" and self._process is not None:
            os.killpg(self._process.pid, signal.SIGSTOP)
            self._waker = _waker(self._process.pid)
            self._status = replace(self._status, state="paused")

    def go_on(self) -> None:
        """Let a paused command go on."""
        if self._status.state == "paused" and self._process is not None:
            os.killpg(self._process.pid, signal.SIGCONT)
            if self._waker is not None:
                self._waker.communicate()
            self._status = replace(self._status, state="running")

    def close(self) -> None:
        """Cancel what runs and wait for its end."""
        self.cancel()
        while self.status().alive:
            time.sleep(0.05)

    def status(self) -> CommandStatus:
        """State, progress and partial results, as far as the command has written them."""
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

    def refuse_while_running(self) -> None:
        """Raise BackgroundError while a command runs."""
        if self.status().alive:
            raise BackgroundError(f"a {self._what} is running already; cancel it first")

    def _launch(self, out: Path, arguments: Sequence[str]) -> None:
        # Workers of a command of our own that has just ended may hold the lock for a moment longer.
        patience = LOCK_WAIT if out == self.out else 0.0
        self.out, self._command = out, arguments[0]
        with self._log().open("ab") as log:
            # The child inherits the lock with the open file, and holds it to its end, whatever becomes of the page.
            if not _locked(log, patience):
                raise BackgroundError(f"{out}: another page's command is running there; wait until it ends")
            # A session of its own: Ctrl-C for the page must not cut a run in two, cancel() ends it in order.
            self._process = subprocess.Popen(
                lowered((*self._program, *arguments), BACKGROUND),
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        session_gives_way(self._process.pid, BACKGROUND)
        self._cancelled_at = None
        self._status = CommandStatus("running")

    def _log(self) -> Path:
        # Beside the output folder: that one has to be empty for a new command.
        return Path(f"{self.out}.log")

    def _ending(self, code: int) -> dict[str, Any]:
        if self._cancelled_at is not None and code != 0:
            return {"state": "cancelled", "message": ""}
        if code in self._endings:
            return {"state": "finished", "message": f"{self._endings[code]}: {self.out}/report.html"}
        how = f"ended with exit code {code}"
        if code < 0:
            how = f"was ended from outside, or for want of memory (signal {-code}); its last line"
        return {"state": "failed", "message": f"{self._command} {how}: {self._last_words()}"}

    def _last_words(self) -> str:
        log = self._log()
        try:
            lines = log.read_text(encoding="utf-8", errors="replace").strip().splitlines()
        except OSError as error:  # taken away, perhaps with the folder that it was in
            return f"{log}: {error.strerror or error}"
        return lines[-1][:300] if lines else f"no output; see {log}"

    def _take_progress(self) -> None:
        if self.out is None or not (file := self.out / PROGRESS).is_file():
            return
        with file.open("rb") as stream:
            stream.seek(self._read)
            for line in _whole_lines(stream):
                self._read += len(line)
                self._status = advanced(self._status, line)


def _waker(group: int) -> subprocess.Popen[bytes]:
    """A process that lets the processes of ``group`` go on when its input ends: when this process does, however.

    Otherwise a page that is killed would leave a paused command behind that nobody can wake.
    """
    wait = ("sh", "-c", 'read -r nothing; kill -s CONT -- "-$1"', "waker", str(group))
    return subprocess.Popen(wait, stdin=subprocess.PIPE, stderr=subprocess.DEVNULL, start_new_session=True)


def advanced(status: CommandStatus, line: bytes) -> CommandStatus:
    """``status`` after one line of ``progress.jsonl``; a line that is no such object leaves it as it is."""
    try:
        event = ProgressEvent.from_dict(json.loads(line))
    except ValueError:  # no JSON, or JSON of something else
        return status
    return replace(
        status,
        stage=event.stage,
        done=event.done,
        planned=event.planned,
        eta_s=event.eta_s,
        lines=status.lines if event.line is None else (*status.lines, event.line),
        stages=with_event(status.stages, event),
        tried=with_run(status.tried, event),
    )


def _locked(file: IO[bytes], patience: float) -> bool:
    """Lock ``file`` for this process and its children, waiting for at most ``patience`` seconds; True if it is."""
    end = time.monotonic() + patience
    while True:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() >= end:
                return False
            time.sleep(0.02)
        else:
            return True


def _whole_lines(stream: IO[bytes]) -> list[bytes]:
    """Lines that end in a newline; the writer may be in the middle of the last one."""
    return [line for line in stream if line.endswith(b"\n")]
