"""``partial.json``: what a study that still runs has found so far (`doe.studies.study_result.PartialStudy`).

Stages that have ended are there as in ``result.json``; ``partial`` names the stage that runs, whose own key, if there,
holds its analysis of the runs so far, and ``line`` says it in words. The file is gone once ``result.json`` is written.
"""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

from doe.studies.study_result import PartialStudy, StageResult, StudyDescription
from explorer.files.whole_file import write_whole
from explorer.study.process import PARTIAL


class PartialResult:
    """The file in the output folder of one study."""

    def __init__(self, folder: Path, study: StudyDescription) -> None:
        self._file, self._found = folder / PARTIAL, PartialStudy(study=study)
        self.remove()

    def show(self, stage: str, result: StageResult) -> None:
        """``result`` is what ``stage`` found so far."""
        # A mean that no run has given yet is no finding.
        line = "" if re.search(r"\bnan\b", result.line) else result.line
        self._write(replace(self._found.with_result(stage, result), partial=stage, line=line))

    def keep(self, stage: str, result: StageResult | None) -> None:
        """``stage`` has ended with ``result``, None where the study has no such stage."""
        self._found = self._found.with_result(stage, result)
        self._write(self._found)

    def remove(self) -> None:
        """Take the file away."""
        self._file.unlink(missing_ok=True)

    def _write(self, content: PartialStudy) -> None:
        write_whole(self._file, json.dumps(content.to_dict(), ensure_ascii=False, allow_nan=False) + "\n")
