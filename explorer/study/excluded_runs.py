"""Runs that the user leaves out of the surface of a finished study, kept beside its result with the reasons."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path

from doe.studies.exclusion import ExcludedRun
from doe.studies.study_result import StudyResult
from doe.table_file import read_table
from explorer.errors import CommandError
from explorer.files.output_file import write_whole

FILE = "excluded_runs.csv"
HEADER = ["label", "experiment", "seed", "key", "reason"]
WITHOUT_KEY = ["label", "experiment", "seed", "reason"]
"""Of older versions."""
MOST_BYTES = 1_000_000


def load_excluded(folder: Path) -> tuple[ExcludedRun, ...]:
    """The runs left out of the study in ``folder``; empty if none. Raises CommandError for a file in another form."""
    file = folder / FILE
    if not file.is_file():
        return ()
    (_, header), *rows = read_table(file, MOST_BYTES, CommandError).rows or ((0, []),)
    if header == WITHOUT_KEY:
        header, rows = HEADER, [(line, [*cells[:3], "", *cells[3:]]) for line, cells in rows]
    if header != HEADER:
        raise CommandError(f"{file}: the header is not {','.join(HEADER)}")
    excluded = []
    for line, cells in rows:
        if len(cells) != len(HEADER) or not cells[2].isdecimal() or not cells[4]:
            raise CommandError(
                f"{file}, line {line}: allowed: a setting, its experiment or an empty cell, a seed, the key of a pour, "
                "a reason"
            )
        excluded.append(ExcludedRun(cells[0], cells[1], int(cells[2]), cells[3], cells[4]))
    return tuple(excluded)


def keep_excluded(folder: Path, result: StudyResult, excluded: Sequence[ExcludedRun]) -> None:
    """Keep the runs left out of ``result``, the study in ``folder``, in place of those kept before.

    Raises CommandError, with nothing changed, for a run that the surface does not have.
    """
    runs = [run for row in result.surface.runs for run in row]
    for one in excluded:
        if not any(one.is_of(run) for run in runs):
            raise CommandError(f"{one.label}, seed {one.seed}: no run of the response surface")
    text = io.StringIO()
    rows = [[one.label, one.experiment, one.seed, one.key, one.reason] for one in excluded]
    csv.writer(text, lineterminator="\n").writerows([HEADER, *rows])
    write_whole(folder / FILE, text.getvalue())
