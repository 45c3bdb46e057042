"""The state line above the page: the project, the progress of each of its steps, and what is next."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from doe.record import RecordError
from doe.studies.study import load_study
from doe.studies.study_result import StudyResult
from explorer.background.output_folder import ResultFile
from explorer.diagnosis.process import RESULT as DIAGNOSIS_RESULT
from explorer.diagnosis.result import DiagnosisResult
from explorer.project.project import REPORT
from explorer.project.steps import (
    Finished,
    Room,
    Step,
    command_step,
    material_step,
    measured_step,
    next_step,
    pour_step,
    report_step,
)
from explorer.report.content import Banner
from explorer.report.diagnosis.answer import banner as diagnosis_banner
from explorer.report.sections.answer import banner as study_banner
from explorer.study.process import RESULT as STUDY_RESULT
from explorer.viewer.panel import AROUND, SELDOM, Now, PageContext, Panel


class StateLine(Panel):
    """Collects the state of project, pour and background commands, and sends it to browsers as one small object."""

    name, tab, every = "state_line", AROUND, SELDOM

    def __init__(self, page: PageContext) -> None:
        self._page = page
        try:
            self._targets = load_study(str(page.project.study)).targets
        except ValueError:  # reported when the study is started
            self._targets = ()
        self._study, self._diagnosis = NewestResult(STUDY_RESULT), NewestResult(DIAGNOSIS_RESULT)

    def show(self, now: Now) -> None:
        """Send the progress of the project to the browsers."""
        steps = self._steps(now)
        text, room = next_step(steps)
        self._page.channel.tell(
            "project",
            {
                "name": self._page.project.title,
                "next": text,
                "next_room": room,
                "steps": [
                    {"name": one.name, "state": one.state, "said": one.said, "hint": one.hint, "room": one.room}
                    for one in steps
                ],
            },
        )

    def _steps(self, now: Now) -> tuple[Step, ...]:
        study, diagnosis = self._page.study, self._page.diagnosis
        studied = self._study.of(study.finished()[:1], study_finished)
        diagnosed = self._diagnosis.of(diagnosis.finished()[:1], diagnosis_finished)
        return (
            material_step(now.status.scene),
            measured_step(self._targets, self._page.target.now),
            pour_step(now.status),
            command_step(
                "Calibrate",
                "Which parameters reproduce the measured pile: a study of some hundred pours.",
                Room.CALIBRATE,
                study.status(),
                studied,
            ),
            command_step(
                "Diagnose",
                "Which physical effect the model lacks, judged by measured data.",
                Room.DIAGNOSE,
                diagnosis.status(),
                diagnosed,
            ),
            report_step((studied, diagnosed)),
        )


class NewestResult:
    """Verdict of the newest finished result, read again only if its file has changed."""

    def __init__(self, name: str) -> None:
        self._file = ResultFile(name)
        self._version: Hashable = None
        self._found: Finished | None = None

    def of(self, folders: tuple[Path, ...], read: FinishedReader) -> Finished | None:
        """The verdict of the first of ``folders``; None if there is none that can be read."""
        folder = next(iter(folders), None)
        content = self._file.read(folder)
        if self._file.version != self._version:
            self._version = self._file.version
            try:
                self._found = None if content is None or folder is None else read(content, folder)
            except (RecordError, LookupError, ValueError):  # a result of another version
                self._found = None
        return self._found


FinishedReader = Callable[[Mapping[str, Any], Path], Finished]


def study_finished(content: Mapping[str, Any], folder: Path) -> Finished:
    """What a finished study found."""
    return _finished(study_banner(StudyResult.from_dict(content)), folder)


def diagnosis_finished(content: Mapping[str, Any], folder: Path) -> Finished:
    """What a finished diagnosis found, and on which data: these need not be of the material on the screen."""
    result = DiagnosisResult.from_dict(content)
    found = _finished(diagnosis_banner(result), folder)
    return replace(found, said=f"{result.data.title}: {found.said}")


def _finished(banner: Banner, folder: Path) -> Finished:
    """The verdict of the report, in lower case."""
    said = f"{banner.word.lower()} {banner.of}".strip()
    return Finished(said, banner.word.tone != "bad", (folder / REPORT).is_file())
