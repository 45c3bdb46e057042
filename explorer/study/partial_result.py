"""``partial.json``: what a study that still runs has found so far, in the form of ``result.json``.

Stages that have ended are there as in ``result.json``; ``partial`` names the stage that runs, whose own key, if there,
holds its analysis of the runs so far, and ``line`` says it in words. The file is gone once ``result.json`` is written.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from doe.record import plain
from doe.stages.lines import LINES
from explorer.files.whole_file import write_whole
from explorer.study.process import PARTIAL


class PartialResult:
    """The file in the output folder of one study; ``study`` is the key of that name."""

    def __init__(self, folder: Path, study: Mapping[str, Any]) -> None:
        self._file, self._found = folder / PARTIAL, {"study": plain(study)}
        self.remove()

    def show(self, stage: str, result: Any) -> None:
        """``result`` is what ``stage`` found so far."""
        line = LINES[stage](result)
        # A mean that no run has given yet is no finding.
        line = "" if re.search(r"\bnan\b", line) else line
        self._write(self._found | {stage: plain(result), "partial": stage, "line": line})

    def keep(self, stage: str, result: Any) -> None:
        """``stage`` has ended with ``result``, None where the study has no such stage."""
        self._found[stage] = plain(result)
        self._write(self._found | {"partial": None, "line": ""})

    def remove(self) -> None:
        """Take the file away."""
        self._file.unlink(missing_ok=True)

    def _write(self, content: dict[str, Any]) -> None:
        write_whole(self._file, json.dumps(content, ensure_ascii=False, allow_nan=False) + "\n")
