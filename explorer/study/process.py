"""Calibrations in the background: the command line's ``calibrate --headless``, run by
`explorer.background.command_process`.

One runs at a time; others wait (`explorer.background.orders`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from doe.studies.study import TRIES, Study, load_study, with_profile
from explorer.background.command_process import PROGRAM, BackgroundError, CommandProcess, PourPlace
from explorer.background.events import given_up
from explorer.background.orders import BackgroundOrders, OrderedCommands
from explorer.background.output_folder import new_folder, newest_unfinished
from explorer.files.output_file import write_whole
from explorer.photograph.target import FOLDER, PhotographedTarget, load_target
from explorer.study.edit import StudyEdits, edited_study

ENDINGS = {0: "report", 3: "above the error limit; report"}
"""Exit codes of ``calibrate`` after a complete chain."""
RESULT, PARTIAL = "result.json", "partial.json"
NO_EDITS = StudyEdits()
CHANGED = "_changed.toml"
"""End of the file name of a changed study in its output folder."""


class StudyProcess(BackgroundOrders, Protocol):
    """What the page needs of studies that run somewhere."""

    @property
    def study_file(self) -> Path:
        """File of the unchanged study."""

    @property
    def present(self) -> QueuedStudy | None:
        """The study that was started last; None if it was one of an earlier session of the page."""

    def start(self, profile: str, edits: StudyEdits = NO_EDITS, file: Path | None = None) -> None:
        """Start a new study, from ``file`` if given, else from ``study_file``.

        Raises a ValueError if one is running already or the order cannot be carried out.
        """

    def queue(self, profile: str, edits: StudyEdits = NO_EDITS) -> None:
        """Start it after those already queued; at once if none runs and none waits."""

    def resume(self) -> None:
        """Continue the study stopped last, even in an earlier session. Raises BackgroundError if there is none."""

    def resumable(self) -> bool:
        """Whether :meth:`resume` has something to continue."""

    def retry(self) -> None:
        """Run it again with more seeds for replicates without a valid run. Raises BackgroundError if there is none."""


@dataclass(frozen=True)
class QueuedStudy:
    """One study that was asked for."""

    stem: str
    """Stem of its study file's name."""
    profile: str
    edits: StudyEdits
    text: str
    """Content of its own study file; empty for the page's unchanged file."""
    photographed: PhotographedTarget | None
    """Photographs in place of the study's own target."""
    study: Study


class CalibrationProcess(OrderedCommands[QueuedStudy]):
    """``explorer calibrate`` as a child process.

    Args:
        study_file: the study.
        folder: where output folders are made, one per start: ``<study>-<profile>-<date>-<time>``.
        store: file of the store of runs; None for the default store.
        program: how the command line is called.
        target: folder of photographs; while it holds any, they are the target of every study that is ordered.
        place: where studies that are started or resumed from then on do their pours; None for this machine.
    """

    def __init__(
        self,
        study_file: Path,
        folder: Path,
        store: Path | None = None,
        program: Sequence[str] = PROGRAM,
        target: Path | None = None,
        place: PourPlace | None = None,
    ) -> None:
        super().__init__(CommandProcess("study", ENDINGS, program), folder, RESULT, "studies")
        self.study_file, self._store, self._target = study_file, store, target
        self._place = place or PourPlace()
        self._profile, self._tries = "", TRIES
        self.present: QueuedStudy | None = None
        """The study that was started last; None if it was one of an earlier session of the page."""

    def start(self, profile: str, edits: StudyEdits = NO_EDITS, file: Path | None = None) -> None:
        """Start a new calibration with ``profile``.

        If ``file`` is another study's, a copy is kept in the output folder, and the photographs are not its target.
        """
        order = self._order(profile, edits, file)
        self._process.refuse_while_running()
        self._begin(order)

    def queue(self, profile: str, edits: StudyEdits = NO_EDITS) -> None:
        """Start it when those queued before it have ended."""
        self._add(self._order(profile, edits))

    def resume(self) -> None:
        """Continue the calibration that was stopped last, even one of an earlier session of the page.

        Runs that are in the store are not repeated.
        """
        self._process.refuse_while_running()
        found = self._stopped()
        if found is None:
            raise BackgroundError("no study has been stopped before its end; there is nothing to resume")
        out, profile = found
        if out != self._process.out:
            self._profile, self._tries, self.present = profile, TRIES, None
        self._go_on_in(out, self._arguments(out))

    def resumable(self) -> bool:
        """Whether one was stopped before its end, in this session of the page or before."""
        try:
            return self._stopped() is not None
        except ValueError:  # the study's file cannot be read, which is reported when a study is started
            return False

    def retry(self) -> None:
        """Run the last calibration again, with more seeds for replicates without a valid run."""
        self._process.refuse_while_running()
        out, last = self._process.out, self._process.status()
        if out is None or (last.state != "failed" and not given_up(last.tried, self._tries)):
            raise BackgroundError("nothing to try again: every replicate of the last study has a valid run")
        self._tries += TRIES
        self._go_on_in(out, self._arguments(out))

    def _order(self, profile: str, edits: StudyEdits, other: Path | None = None) -> QueuedStudy:
        file = other or self.study_file
        text, study = edited_study(file, edits) if edits or other else ("", load_study(str(file)))
        with_profile(study, profile)
        photographed = None if self._target is None or other else load_target(self._target)
        if photographed is not None:
            photographed.of_study(study.targets)
        return QueuedStudy(file.stem, profile, edits, text, photographed, study)

    def _begin(self, order: QueuedStudy) -> None:
        self._profile, self._tries = order.profile, TRIES
        out = new_folder(self._folder, f"{order.stem}-{order.profile}")
        if order.text:
            out.mkdir()
            write_whole(out / f"{order.stem}{CHANGED}", order.text)
        if order.photographed is not None:
            order.photographed.copied(out / FOLDER)
        self._start(out, self._arguments(out))
        self.present = order

    def _in_words(self, order: QueuedStudy) -> str:
        """Its profile, and whether the study was changed."""
        return f"{order.profile}{', changed' if order.text else ''}"

    def _stopped(self) -> tuple[Path, str] | None:
        """Folder and profile of the last study if it was stopped before its end, else those of :meth:`_unfinished`."""
        out = self._process.out
        return (out, self._profile) if out is not None and not (out / RESULT).exists() else self._unfinished()

    def _unfinished(self) -> tuple[Path, str] | None:
        """Folder and profile of the newest study of the page's file that was stopped before its end."""
        profiles = load_study(str(self.study_file)).profiles
        stems = {f"{self.study_file.stem}-{profile}": profile for profile in profiles}
        found = newest_unfinished(self._folder, tuple(stems), RESULT)
        return None if found is None else (found[0], stems[found[1]])

    def _arguments(self, out: Path) -> list[str]:
        """The command line that is run, as a person would type it."""
        store = () if self._store is None else ("--store", str(self._store))
        own = next(out.glob(f"*{CHANGED}"), self.study_file)
        study = ["--study", str(own), "--profile", self._profile]
        study += ["--target", str(out / FOLDER)] if (out / FOLDER).is_dir() else []
        tries = () if self._tries == TRIES else ("--tries", str(self._tries))
        return ["calibrate", "--headless", *study, "--out", str(out), *store, *tries, *self._place.arguments]
