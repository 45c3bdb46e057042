"""A command-line command in a process of its own.

It has lower priority, so that the live pour stays smooth. The command writes ``progress.jsonl`` into its output folder,
one `explorer.background.events.ProgressEvent` per line; nothing else of it is read here.
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
"""Seconds that a cancelled command has to write what it has, before it is killed."""
LOCK_WAIT = 1.0
"""Seconds for which the workers of one of our own commands may keep its folder locked after it has ended."""
PROGRAM = (sys.executable, "-m", "explorer")
"""How the command line is called."""


@dataclass(frozen=True)
class CommandStatus:
    """How far a command has got. ``lines``: partial results, one per finished stage; ``tried``: as in `with_run`."""

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
        """True while the command's process exists, running or paused."""
        return self.state in ("running", "paused")


class BackgroundError(CommandError):
    """A command that cannot be started or resumed; one line, fit for a user."""


HERE = "this machine"


class PourPlace:
    """Where commands started from now on pour: on this machine, or on the workers of a Dask scheduler.

    Whoever names the scheduler can make this machine run what that scheduler sends, because Dask's messages hold code.
    Therefore the person who starts the server gives the address, and a browser can only choose between it and this
    machine.
    """

    def __init__(self, scheduler: str = "") -> None:
        self.offered = (scheduler, HERE) if scheduler else (HERE,)
        """The places to choose from."""
        self.chosen = self.offered[0]

    def choose(self, name: str) -> None:
        """Pour at ``name`` from the next command on. Raises BackgroundError if it is not offered."""
        if name not in self.offered:
            raise BackgroundError(f"pour on: {name!r} is not one of {', '.join(self.offered)}")
        self.chosen = name

    @property
    def arguments(self) -> tuple[str, ...]:
        """Command-line arguments for this place."""
        return () if self.chosen == HERE else ("--scheduler", self.chosen)


class CommandProcess:
    """One command at a time as a child process.

    Args:
        what: what one run is called, such as "study".
        endings: exit code of a finished command → text before the path of the report.
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
        """Start the command ``arguments``, whose new output folder is ``out``. Raises BackgroundError."""
        self.refuse_while_running()
        self._read = 0
        self._launch(out, arguments)

    def resume(self, out: Path, arguments: Sequence[str]) -> None:
        """Continue in ``out``, where a command was stopped. Raises BackgroundError."""
        self.refuse_while_running()
        # A resumed command reports every stage again, so what it reported before it was stopped is dropped.
        progress = out / PROGRESS
        self._read = progress.stat().st_size if progress.is_file() else 0
        self._launch(out, (*arguments, "--resume"))

    def cancel(self) -> None:
        """Ask the command to stop; :meth:`status` kills it if it has not stopped after ``CANCEL_WAIT``."""
        if self._process is not None and self._process.poll() is None:
            self.go_on()
            self._process.terminate()
            self._cancelled_at = time.monotonic()
            self._status = replace(self._status, message="stopping")

    def pause(self) -> None:
        """Suspend the command with its workers; it keeps its memory and frees the cores."""
        if self.status().state == "running" and self._process is not None:
            os.killpg(self._process.pid, signal.SIGSTOP)
            self._waker = _waker(self._process.pid)
            self._status = replace(self._status, state="paused")

    def go_on(self) -> None:
        """Let a paused command continue."""
        if self._status.state == "paused" and self._process is not None:
            os.killpg(self._process.pid, signal.SIGCONT)
            self._dismiss_waker()
            self._status = replace(self._status, state="running")

    def close(self) -> None:
        """Cancel the running command and wait for its end."""
        self.cancel()
        while self.status().alive:
            time.sleep(0.05)

    def status(self) -> CommandStatus:
        """State, progress and partial results, as far as the command has written them."""
        if self._process is None:
            return self._status
        code = self._process.poll()
        # Read after polling: by then the file holds the last lines of a process that has ended.
        self._take_progress()
        if code is not None:
            self._process = None
            self._dismiss_waker()
            self._status = replace(self._status, eta_s=None, **self._ending(code))
        elif self._cancelled_at is not None and time.monotonic() > self._cancelled_at + CANCEL_WAIT:
            os.killpg(self._process.pid, signal.SIGKILL)
        return self._status

    def refuse_while_running(self) -> None:
        """Raise BackgroundError while a command runs."""
        if self.status().alive:
            raise BackgroundError(f"a {self._what} is running already; cancel it first")

    def _launch(self, out: Path, arguments: Sequence[str]) -> None:
        # Workers of one of our own commands that has just ended may hold the lock a moment longer.
        patience = LOCK_WAIT if out == self.out else 0.0
        with _log_of(out).open("ab") as log:
            # The child inherits the lock with the open file and holds it until it ends, whatever happens to the page.
            if not _locked(log, patience):
                raise BackgroundError(f"{out}: another page's command is running there; wait until it ends")
            # A session of its own: Ctrl-C for the page must not interrupt a run; cancel() ends it in an orderly way.
            process = subprocess.Popen(
                lowered((*self._program, *arguments), BACKGROUND),
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        self.out, self._command, self._process = out, arguments[0], process
        session_gives_way(process.pid, BACKGROUND)
        self._cancelled_at = None
        self._status = CommandStatus("running")

    def _dismiss_waker(self) -> None:
        if self._waker is not None:
            self._waker.communicate()
            self._waker = None

    def _ending(self, code: int) -> dict[str, Any]:
        if self._cancelled_at is not None and code != 0:
            return {"state": "cancelled", "message": ""}
        if code in self._endings:
            return {"state": "finished", "message": f"{self._endings[code]}: {self.out}/report.html"}
        how = f"ended with exit code {code}"
        if code < 0:
            how = f"was ended from outside, or for want of memory (signal {-code}); its last line"
        return {"state": "failed", "message": f"{self._command} {how}: {_last_words(self.out)}"}

    def _take_progress(self) -> None:
        if self.out is None or not (file := self.out / PROGRESS).is_file():
            return
        with file.open("rb") as stream:
            stream.seek(self._read)
            for line in _whole_lines(stream):
                self._read += len(line)
                self._status = advanced(self._status, line)


def _log_of(out: Path | None) -> Path:
    # Beside the output folder, which has to be empty for a new command.
    return Path(f"{out}.log")


def _last_words(out: Path | None) -> str:
    log = _log_of(out)
    try:
        lines = log.read_text(encoding="utf-8", errors="replace").strip().splitlines()
    except OSError as error:  # removed, perhaps with its folder
        return f"{log}: {error.strerror or error}"
    return lines[-1][:300] if lines else f"no output; see {log}"


def _waker(group: int) -> subprocess.Popen[bytes]:
    """A process that lets ``group`` continue when its input ends, which happens however this process ends.

    Otherwise a page that is killed would leave behind a paused command that nobody can wake.
    """
    wait = ("sh", "-c", 'read -r nothing; kill -s CONT -- "-$1"', "waker", str(group))
    return subprocess.Popen(wait, stdin=subprocess.PIPE, stderr=subprocess.DEVNULL, start_new_session=True)


def advanced(status: CommandStatus, line: bytes) -> CommandStatus:
    """``status`` after one line of ``progress.jsonl``; a line that is not an event leaves it unchanged."""
    try:
        event = ProgressEvent.from_dict(json.loads(line))
    except ValueError:  # not JSON, or not an event
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
    """Lock ``file`` for this process and its children, waiting at most ``patience`` seconds; True on success."""
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
    """The complete lines: the writer may be in the middle of the last one."""
    return [line for line in stream if line.endswith(b"\n")]
