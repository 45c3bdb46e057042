"""A diagnosis in the background: the command line's ``diagnose`` (see `explorer.background.command_process`)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

from explorer.background.command_process import (
    PROGRAM,
    BackgroundError,
    CommandProcess,
    CommandStatus,
    finished,
    new_folder,
    newest_unfinished,
)
from solver.assets import measurement_folder

RESULT = "diagnosis.json"


class DiagnosisProcess(Protocol):
    """What the page needs of a diagnosis that runs somewhere. ``data``: folder of measured data, or a shipped name."""

    def start(self, data: str) -> None:
        """Start a new diagnosis. Raises a ValueError where one runs already, or there are no such data."""

    def cancel(self) -> None:
        """Stop the diagnosis that runs; finished pours are kept."""

    def pause(self) -> None:
        """Let the diagnosis that runs stand still."""

    def go_on(self) -> None:
        """Let it go on."""

    def resume(self, data: str) -> None:
        """Go on with the newest one of ``data`` that was stopped. Raises a ValueError where there is none."""

    def status(self) -> CommandStatus:
        """State, progress and what the parts have found."""

    @property
    def out(self) -> Path | None:
        """Output folder of the diagnosis started last, None before the first."""

    def finished(self) -> tuple[Path, ...]:
        """Output folders of finished diagnoses, newest first."""


class DiagnoseProcess:
    """``explorer diagnose`` as a child process.

    Args:
        folder: output folders are made in here, one per start: ``<data>-<date>-<time>``.
        store: file of the store of runs; None for the default store.
        program: how the command line is called.
    """

    def __init__(self, folder: Path, store: Path | None = None, program: Sequence[str] = PROGRAM) -> None:
        self._folder, self._store = folder, store
        self._process = CommandProcess("diagnosis", {0: "report"}, program)
        self.cancel, self.close, self.status = self._process.cancel, self._process.close, self._process.status
        self.pause, self.go_on = self._process.pause, self._process.go_on

    def start(self, data: str) -> None:
        """Start a new diagnosis of ``data``."""
        measured = _checked(data)
        self._process.refuse_while_running()
        out = new_folder(self._folder, measured.name)
        self._process.start(out, self._arguments(measured, out))

    def resume(self, data: str) -> None:
        """Go on with the newest diagnosis of ``data`` that was stopped, be it one of an earlier session of the page."""
        measured = _checked(data)
        self._process.refuse_while_running()
        found = newest_unfinished(self._folder, (measured.name,), RESULT)
        if found is None:
            raise BackgroundError(f"no diagnosis of {measured.name} has been stopped before its end")
        self._process.resume(found[0], self._arguments(measured, found[0]))

    @property
    def out(self) -> Path | None:
        """Output folder of the diagnosis started last."""
        return self._process.out

    def finished(self) -> tuple[Path, ...]:
        """Output folders of finished diagnoses, of any data, newest first."""
        return finished(self._folder, RESULT)

    def _arguments(self, measured: Path, out: Path) -> list[str]:
        """The command line that is run, as a person would type it."""
        store = () if self._store is None else ("--store", str(self._store))
        return ["diagnose", str(measured), "--out", str(out), "--apply", *store]


def _checked(data: str) -> Path:
    if not data.strip():
        raise BackgroundError("choose measured data, or name their folder")
    return measurement_folder(data.strip()).absolute()
