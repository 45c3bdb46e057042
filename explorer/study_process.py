"""A calibration in the background: the command line's ``calibrate --headless`` (see `explorer.command_process`)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

from explorer.command_process import (
    PROGRAM,
    BackgroundError,
    CommandProcess,
    CommandStatus,
    new_folder,
    newest_unfinished,
)

PROFILES = ("quick", "standard", "full")
ENDINGS = {0: "report", 3: "above the error limit; report"}
"""Exit codes of ``calibrate`` after a complete chain."""


class StudyProcess(Protocol):
    """What the page needs of a study that runs somewhere."""

    def start(self, profile: str) -> None:
        """Start a new study. Raises BackgroundError where one runs already or the profile is unknown."""

    def cancel(self) -> None:
        """Stop the study that runs; finished runs are kept."""

    def resume(self) -> None:
        """Go on with the study started last, also before this page. Raises BackgroundError where there is none."""

    def status(self) -> CommandStatus:
        """State, progress and partial results."""


class CalibrationProcess:
    """``explorer calibrate`` as a child process.

    Args:
        study_file: the study.
        folder: output folders are made in here, one per start: ``<study>-<profile>-<date>-<time>``.
        store: file of the store of runs; None for the default store.
        program: how the command line is called.
    """

    def __init__(
        self, study_file: Path, folder: Path, store: Path | None = None, program: Sequence[str] = PROGRAM
    ) -> None:
        self._study_file, self._folder, self._store = study_file, folder, store
        self._process = CommandProcess("study", ENDINGS, program)
        self._profile = ""
        self.cancel, self.close, self.status = self._process.cancel, self._process.close, self._process.status

    def start(self, profile: str) -> None:
        """Start a new calibration with ``profile``."""
        if profile not in PROFILES:
            raise BackgroundError(f"profile: {profile!r} is not one of {', '.join(PROFILES)}")
        self._process.refuse_while_running()
        self._profile = profile
        out = new_folder(self._folder, self._stem(profile))
        self._process.start(out, self._arguments(out))

    def resume(self) -> None:
        """Go on where the last calibration was stopped, be it one of an earlier session of the page.

        Runs that are in the store are not repeated.
        """
        self._process.refuse_while_running()
        out = self._process.out
        if out is None:
            stems = {self._stem(profile): profile for profile in PROFILES}
            found = newest_unfinished(self._folder, tuple(stems), "result.json")
            if found is None:
                raise BackgroundError("no study has been stopped before its end; there is nothing to resume")
            out, self._profile = found[0], stems[found[1]]
        self._process.resume(out, self._arguments(out))

    def _stem(self, profile: str) -> str:
        return f"{self._study_file.stem}-{profile}"

    def _arguments(self, out: Path) -> list[str]:
        """The command line that is run, as a person would type it."""
        store = () if self._store is None else ("--store", str(self._store))
        study = ("--study", str(self._study_file), "--profile", self._profile)
        return ["calibrate", "--headless", *study, "--out", str(out), *store]
