"""The board of an output folder, whatever kind of result it holds; read again when the result has changed."""

from __future__ import annotations

from collections.abc import Hashable
from pathlib import Path

from doe.record import RecordError
from doe.studies.study_result import study_from
from explorer.background.output_folder import ResultFile
from explorer.diagnosis.process import RESULT as DIAGNOSIS
from explorer.diagnosis.result import DiagnosisResult
from explorer.errors import CommandError
from explorer.project.project import REPORT
from explorer.study.excluded_runs import load_excluded
from explorer.study.process import PARTIAL
from explorer.study.process import RESULT as STUDY
from explorer.viewer.board.board import board_json
from explorer.viewer.board.board_view import published_report
from explorer.viewer.board.diagnosis_board import diagnosis_board
from explorer.viewer.board.study_board import photographed_of, study_board
from explorer.viewer.shell.web_pages import JSON, WebPage, WebPages, folder_id


class FolderBoard:
    """Publishes the board of ``folder`` at ``address``.

    Raises CommandError, in one line, if it holds neither a study nor a diagnosis, or one of another version.
    """

    def __init__(self, folder: Path, pages: WebPages) -> None:
        self._folder, self._pages = folder, pages
        self._study, self._diagnosis = ResultFile(STUDY, PARTIAL), ResultFile(DIAGNOSIS)
        self._shown: Hashable = None
        self.address = f"/study/{folder_id(folder)}.json"
        if self._study.read(folder) is None and self._diagnosis.read(folder) is None:
            raise CommandError(f"{folder}: holds no {STUDY}, {PARTIAL} or {DIAGNOSIS}")
        self.follow()

    def follow(self) -> None:
        """Publish the board again if a result, its report, or its excluded runs have changed."""
        study, diagnosis = self._study.read(self._folder), self._diagnosis.read(self._folder)
        excluded = load_excluded(self._folder)
        shown = (self._study.version, self._diagnosis.version, (self._folder / REPORT).is_file(), excluded)
        if shown == self._shown:
            return
        self._shown = shown
        report = published_report(self._pages, self._folder)
        try:
            if diagnosis is not None:
                board = diagnosis_board(DiagnosisResult.from_dict(diagnosis), None, report, on_page=False)
            else:
                board = study_board(
                    None if study is None else study_from(study),
                    None,
                    report,
                    photographed_of(self._folder),
                    excluded,
                )
        except RecordError as error:
            raise CommandError(f"{self._folder}: {error}") from None
        self._pages.publish(self.address, WebPage(JSON, board_json(board)))
