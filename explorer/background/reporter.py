"""What a long command reports while it runs: lines for the user, events for the page and CI, and a log.

There is one stream of events (`explorer.background.events.ProgressEvent`, one JSON object per line): the page reads
it from ``progress.jsonl`` in the output folder, CI from standard output (``--json``). Logging uses the standard
library: the packages log with ``logging.getLogger(__name__)``, and while a command runs, the records are written as
JSON lines to ``log.jsonl`` in the output folder:

    {"time": ISO 8601 UTC, "level": "info", "run_id": text, "logger": module, "message": text, …}

with "stage", "seed", "outcome", "wall_s" and "reused" for a pour, and "traceback" for an error in the program.
"""

from __future__ import annotations

import json
import logging
import secrets
import shlex
import signal
import sys
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from contextvars import ContextVar
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import IO, TYPE_CHECKING, Self

from doe.errors import StudyStopped
from explorer.background.bar import Bar
from explorer.background.events import PROGRESS, Ending, ProgressEvent
from explorer.files.output_file import write_whole
from explorer.scene.text import material_toml
from solver import Job, PourBrokeOff, Record, Scene

if TYPE_CHECKING:
    from doe.pour_runner import Pours

LOG = "log.jsonl"
"""File in the output folder of the command."""
PACKAGES = ("explorer", "doe", "solver")
LEVELS = ("debug", "info", "warning", "error")
EVERY = 20.0
MOST_SCENES = 10
"""Scenes of diverged pours that one command writes at most: if many diverge, they have one reason in common."""

_log = logging.getLogger(__name__)
_run_id: ContextVar[str] = ContextVar("run_id", default="")


class Reporter:
    """Reports one run of a command to all its readers; a context manager that reports the end, however it comes.

    Args:
        command: name of the command.
        say: takes a line for the user.
        events: where every event is written as a line of JSON; None for only the output folder.
        bar: where a bar is shown, if that is a terminal; standard output by default.
        every: seconds between two lines of progress if there is no terminal.
        clock: present time [s].
    """

    def __init__(
        self,
        command: str,
        say: Callable[[str], None],
        events: IO[str] | None = None,
        bar: IO[str] | None = None,
        every: float = EVERY,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self.command, self.say, self._events, self._clock = command, say, events, clock
        self.run_id = f"{datetime.now(UTC):%Y%m%dT%H%M%SZ}-{secrets.token_hex(3)}"
        """Of this run: a command that continues where another one stopped has its own."""
        self.result: Path | None = None
        """The file that the command has written, once it exists."""
        self._started, self._said = clock(), 0.0
        self._out: Path | None = None
        self._last = ProgressEvent(stage="", done=0, planned=0)
        self._diverged: list[int] = []  # seeds, in the order in which they were reported
        self._scenes: dict[int, Path] = {}
        self._place_of_bar, self._every = bar or sys.stdout, every
        self._bar: Bar | None = None
        self._stack = ExitStack()

    def __enter__(self) -> Self:
        token = _run_id.set(self.run_id)
        self._stack.callback(_run_id.reset, token)
        self._stack.enter_context(logged(ToPerson(self.say), "warning"))
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        with self._stack:
            if self._bar is not None:
                self._bar.close()
            self._end(error)

    @property
    def elapsed(self) -> float:
        """Seconds since the start."""
        return self._clock() - self._started

    def begin(self, out: Path | None = None, resumed: bool = False) -> None:
        """The command is at work in the folder ``out``: events and log are appended to the files there."""
        self._out = out
        if out is not None:
            _end_line(out / PROGRESS)
            handler = LogFile(out / LOG, encoding="utf-8")
            self._stack.callback(handler.close)
            self._stack.enter_context(logged(handler, "info"))
        self._bar = Bar(self._place_of_bar) if self._place_of_bar.isatty() else None
        _log.info("%s: %s", self.command, "resumed" if resumed else "started")

    def tell(self, event: ProgressEvent, state: str, finding: str | None = None) -> None:
        """Report ``event``; in words by ``finding`` if given, else by ``state``, which is not shown every time."""
        scene = None if event.run is None else self._scenes.get(event.run.seed)
        self._write(replace(event, scene=scene))
        self._note(self._last)
        if finding is not None:
            self.say(f"[{self.elapsed:6.0f} s] {finding}")
        self.show(state, event.done, event.planned, said=finding is not None)

    def show(self, state: str, done: float, planned: float, said: bool = False) -> None:
        """Show the user the progress: ``state`` in a bar, or now and then as a line; no event."""
        if self._bar is not None:
            self._bar.show(state, done, planned)
        elif not said and self.elapsed - self._said > self._every:
            self._said = self.elapsed
            self.say(f"[{self.elapsed:6.0f} s] {state}")

    def watched(self, pours: Pours) -> Pours:
        """``pours``; the scene of one that diverges or breaks off is written into the output folder and reported."""

        def run(queue: deque[Job], room: Sequence[Scene]) -> Iterable[tuple[Job, Record]]:
            try:
                for job, record in pours(queue, room):
                    if record.outcome.unstable:
                        self.diverged(job.scene, job.seed, record, self._out)
                    yield job, record
            except PourBrokeOff as error:
                self._leave(error.job.scene, error.job.seed, " ".join(str(error).split()), self._out)
                raise

        return run

    def diverged(
        self, scene: Scene, seed: int, record: Record, folder: Path | None, appears_as: Path | None = None
    ) -> None:
        """Write ``scene`` into ``folder``, if given, and say how to pour it again with ``seed``.

        ``appears_as``: name of the folder when the command has ended.
        """
        what = f"the pour with seed {seed} diverged: {str(record.outcome).replace('_', ' ')}, {record.message}"
        self._leave(scene, seed, what, folder, appears_as)

    def _leave(self, scene: Scene, seed: int, what: str, folder: Path | None, appears_as: Path | None = None) -> None:
        if len(self._diverged) >= MOST_SCENES:
            return
        # Two scenes may diverge with one seed.
        before = self._diverged.count(seed)
        self._diverged.append(seed)
        last = "; further ones are not reported" if len(self._diverged) == MOST_SCENES else ""
        if folder is None:
            self.say(f"{what}; to reproduce it, run `explorer simulate` with this scene and --seed {seed}{last}")
            return
        name = f"diverged_{seed}{f'_{before + 1}' if before else ''}.toml"
        path = (appears_as or folder) / name
        again = f"explorer simulate {shlex.quote(str(path))} --seed {seed}"
        heading = f"{what[0].upper()}{what[1:]}. To reproduce it:\n{again}"
        write_whole(folder / name, material_toml(scene, heading))
        self._scenes[seed] = path
        self.say(f"{what}; to reproduce it: {again}{last}")

    def _write(self, event: ProgressEvent) -> None:
        now = datetime.now(UTC).isoformat(timespec="milliseconds")
        self._last = replace(event, run_id=self.run_id, command=self.command, at=now, time=self.elapsed)
        line = json.dumps(self._last.to_dict()) + "\n"
        if self._out is not None:
            with (self._out / PROGRESS).open("a", encoding="utf-8") as file:
                file.write(line)
        if self._events is not None:
            self._events.write(line)
            self._events.flush()

    def _note(self, event: ProgressEvent) -> None:
        """Log an event."""
        run = event.run
        if run is not None:
            said = f"{run.stage}: {run.label}, seed {run.seed}: {run.outcome}"
            fields = {"stage": run.stage, "seed": run.seed, "outcome": run.outcome, "wall_s": run.wall_s}
            again = f" (try {run.attempt + 1})" if run.attempt else ""
            _log.log(
                logging.INFO if run.valid else logging.WARNING,
                f"{said}{again}{f', {run.message}' if run.message else ''}",
                extra={"fields": fields | {"reused": run.reused}},
            )
        elif event.line is not None:
            _log.info("%s: %s", event.stage, event.line, extra={"fields": {"stage": event.stage}})

    def _end(self, error: BaseException | None) -> None:
        outcome: Ending = "finished"
        told: str | None = None
        if error is not None:
            outcome = "interrupted" if isinstance(error, KeyboardInterrupt) else "failed"
            told = " ".join(str(error).split()) or type(error).__name__
        last = replace(self._last, event="end", eta_s=None, line=None, run=None, scene=None)
        # On a full disk, or with no reader left, the first error is the one to report.
        with suppress(OSError) if error is not None else nullcontext():
            result = self.result if error is None else None
            self._write(replace(last, outcome=outcome, result=result, error=told))
        # A traceback only for an error in the program, not in its input or in the outcome of runs.
        program = None if isinstance(error, ValueError | KeyboardInterrupt | StudyStopped) else error
        _log.log(
            logging.INFO if error is None else logging.ERROR,
            "%s: %s after %.1f s%s",
            self.command,
            outcome,
            self.elapsed,
            f": {told}" if told else "",
            exc_info=program,
        )


def _end_line(file: Path) -> None:
    """End the last line of ``file``: a command may have been killed in the middle of it."""
    if file.is_file() and not (told := file.read_bytes()).endswith(b"\n") and told:
        with file.open("a", encoding="utf-8") as stream:
            stream.write("\n")


def end_as_by_ctrl_c() -> None:
    """Let SIGTERM, with which the page cancels a command and CI ends one, end it as Ctrl-C does.

    The end is then reported, the store is closed, and finished pours are kept.
    """
    signal.signal(signal.SIGTERM, signal.default_int_handler)


def reporter_of(command: str, json: bool) -> Reporter:
    """The reporter of a command line; with ``json``, events go to standard output and lines to standard error."""

    def say(line: str) -> None:
        # Looked up for each line: while a bar is shown, another stream is in its place that prints above the bar.
        print(line, file=sys.stderr if json else sys.stdout, flush=True)

    return Reporter(command, say, sys.stdout if json else None, sys.stderr if json else sys.stdout)


class ToPerson(logging.Handler):
    """Says what the user has to know, such as the loss of a worker; the reporter itself says what events report."""

    def __init__(self, say: Callable[[str], None]) -> None:
        super().__init__()
        self._say = say

    def emit(self, record: logging.LogRecord) -> None:
        """Say the message."""
        if record.name != __name__:
            self._say(record.getMessage())


class LogFile(logging.FileHandler):
    """A log that never stops a pour: what cannot be written, for example on a full disk, is left out."""

    def handleError(self, record: logging.LogRecord) -> None:
        """Ignore the error."""


class JsonLines(logging.Formatter):
    """A record as a line of JSON, with its ``fields`` beside the message."""

    def format(self, record: logging.LogRecord) -> str:
        """The line."""
        entry = {
            "time": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname.lower(),
            "run_id": _run_id.get(),
            "logger": record.name,
            "message": record.getMessage(),
            **getattr(record, "fields", {}),
        }
        if record.exc_info:
            entry["traceback"] = self.formatException(record.exc_info)
        return json.dumps(entry)


@contextmanager
def logged(handler: logging.Handler, level: str) -> Iterator[None]:
    """Have ``handler`` take what this program's packages log at ``level`` or above."""
    handler.setFormatter(JsonLines())
    handler.setLevel(level.upper())
    loggers = [logging.getLogger(name) for name in PACKAGES]
    before = [logger.level for logger in loggers]
    for logger in loggers:
        logger.addHandler(handler)
        logger.setLevel(min(handler.level, logger.level or handler.level))
    try:
        yield
    finally:
        for logger, level_before in zip(loggers, before, strict=True):
            logger.removeHandler(handler)
            logger.setLevel(level_before)
