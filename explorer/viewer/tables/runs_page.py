"""The runs of a study's response surface in a table, with the reason for each run that is left out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from doe.studies.exclusion import ExcludedRun
from doe.studies.study_result import StudyResult
from explorer.outcomes import outcome_text
from explorer.study.run_scene import observed_of
from explorer.units import number, observable_label, unit_of_parameter
from explorer.viewer.actions import Action, Post
from explorer.viewer.tables.grid import (
    WRITTEN,
    column,
    entered_text,
    rows_in_order,
    table_heading,
    table_to_edit,
    with_unit,
)
from explorer.viewer.tables.table_server import TablePage

TITLE = "Runs of the response surface"
HOW = (
    "A run with a reason in the blue column is left out: the board then says what the study would have answered "
    "without it. The result itself stays as it is. A click on a head sorts, the sign in it filters."
)
SAVED = "Saved: the board shows the answer without the runs that have a reason."
NO_RESULT = "No finished study is shown under Calibrate."
REASON = "reason"


@dataclass(frozen=True)
class RunsInHand:
    """The finished study that is shown, if any, and the runs left out of it; ``take`` receives a new list of those."""

    result: Callable[[], StudyResult | None]
    excluded: Callable[[], Sequence[ExcludedRun]]
    take: Callable[[StudyResult, Sequence[ExcludedRun]], None]


def runs_page(in_hand: RunsInHand, post: Post) -> TablePage:
    """The page for leaving runs out."""
    return TablePage("runs", TITLE, lambda: _build(in_hand, post))


def _build(in_hand: RunsInHand, post: Post) -> None:
    from nicegui import ui

    result = in_hand.result()
    if result is None:
        ui.label(NO_RESULT).props("role=alert")
        return
    columns = [column(head, name, minWidth=95) for name, head in _heads(result).items()]
    columns.append(column("Left out because", REASON, minWidth=200, **WRITTEN))

    def entered(sent: Sequence[object]) -> tuple[Action, str]:
        excluded = excluded_runs(result, sent)
        return lambda: in_hand.take(result, excluded), SAVED

    table_heading(f"{TITLE}: {result.study.title}", HOW)
    table_to_edit(columns, run_rows(result, in_hand.excluded()), entered, post)


def _heads(result: StudyResult) -> dict[str, str]:
    """Field of a row → header of its column."""
    factors = {one.name: with_unit(one.name, unit_of_parameter(one.path).symbol) for one in result.surface.factors}
    observables = {name: observable_label(name) for name in result.surface.observables}
    return {"setting": "Setting"} | factors | {"seed": "Seed", "outcome": "Outcome"} | observables


def run_rows(result: StudyResult, excluded: Sequence[ExcludedRun]) -> list[dict[str, str]]:
    """Every run of the surface; ``id`` is the number of the run."""
    surface = result.surface
    rows: list[dict[str, str]] = []
    for runs, point in zip(surface.runs, surface.natural, strict=True):
        levels = {
            factor.name: number(unit_of_parameter(factor.path).of(float(level)))
            for factor, level in zip(surface.factors, point, strict=True)
        }
        for run in runs:
            told = {"setting": run.title, "seed": str(run.seed), "outcome": outcome_text(run.outcome)}
            read = {name: observed_of(run, name) for name in surface.observables}
            why = next((one.reason for one in excluded if one.is_of(run)), "")
            rows.append({"id": str(len(rows)), REASON: why} | told | levels | read)
    return rows


def excluded_runs(result: StudyResult, sent: Sequence[object]) -> list[ExcludedRun]:
    """The runs with a reason among the rows that a browser ``sent``. Raises CommandError for another study's rows."""
    runs = [run for row in result.surface.runs for run in row]
    excluded = []
    for run, row in zip(runs, rows_in_order(sent, len(runs), "the runs of the study"), strict=True):
        reason = entered_text(row.get(REASON), f"{run.title}, seed {run.seed}")
        if reason:
            excluded.append(ExcludedRun.of(run, reason))
    return excluded
