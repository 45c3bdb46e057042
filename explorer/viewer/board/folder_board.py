"""The board of an output folder, whatever kind of result it holds, read again when that has changed."""

from __future__ import annotations

from collections.abc import Hashable
from pathlib import Path

from doe.record import RecordError
from doe.studies.study_result import study_from
from explorer.background.output_folder import ResultFile
from explorer.diagnosis.process import RESULT as DIAGNOSIS
from explorer.diagnosis.result import DiagnosisResult
from explorer.errors import CommandError
from explorer.study.process import PARTIAL
from explorer.study.process import RESULT as STUDY
from explorer.viewer.board.board import Board
from explorer.viewer.board.diagnosis_board import diagnosis_board
from explorer.viewer.board.study_board import study_board


class FolderBoard:
    """The board of ``folder``. Raises CommandError where it holds neither a study nor a diagnosis."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._study, self._diagnosis = ResultFile(STUDY, PARTIAL), ResultFile(DIAGNOSIS)
        if self._study.read(folder) is None and self._diagnosis.read(folder) is None:
            raise CommandError(f"{folder}: holds no {STUDY}, {PARTIAL} or {DIAGNOSIS}")

    def version(self) -> Hashable:
        """Changes whenever a result does."""
        for file in (self._study, self._diagnosis):
            file.read(self._folder)
        return self._study.version, self._diagnosis.version

    def board(self, report: str = "") -> Board:
        """What there is now. Raises CommandError, in one line, for a result of another version."""
        study, diagnosis = self._study.read(self._folder), self._diagnosis.read(self._folder)
        try:
            if diagnosis is not None:
                return diagnosis_board(DiagnosisResult.from_dict(diagnosis), None, report)
            return study_board(None if study is None else study_from(study), None, report)
        except RecordError as error:
            raise CommandError(f"{self._folder}: {error}") from None
