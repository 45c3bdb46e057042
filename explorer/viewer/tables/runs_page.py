"""The runs of a study's response surface in a table, and why one of them is left out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from doe.studies.exclusion import ExcludedRun
from doe.studies.study_result import StudyResult
from explorer.errors import CommandError
from explorer.outcomes import outcome_text
from explorer.study.runs import observed_of
from explorer.units import number, observable_label, unit_of_parameter
from explorer.viewer.actions import Post
from explorer.viewer.tables.table_server import LOST, REPLY, TablePage, done_by

TITLE = "Runs of the response surface"
HOW = (
    "A run with a reason in the blue column is left out: the board then says what the study would have answered "
    "without it. The result itself stays as it is. A click on a head sorts, the sign in it filters."
)
SAVED = "Saved: the board shows the answer without the runs that have a reason."
NO_RESULT = "No finished study is shown under Calibrate."
REASON = "reason"
LONGEST_REASON = 200


@dataclass(frozen=True)
class RunsInHand:
    """The finished study that is shown (None: there is none), what is left out of it, and who takes other runs."""

    result: Callable[[], StudyResult | None]
    excluded: Callable[[], Sequence[ExcludedRun]]
    take: Callable[[StudyResult, Sequence[ExcludedRun]], None]


def runs_page(in_hand: RunsInHand, post: Post) -> TablePage:
    """The page on which runs are left out."""
    return TablePage("runs", TITLE, lambda: _build(in_hand, post))


def _build(in_hand: RunsInHand, post: Post) -> None:
    from nicegui import ui

    result = in_hand.result()
    if result is None:
        ui.label(NO_RESULT).props("role=alert")
        return
    ui.label(f"{TITLE}: {result.study.title}").classes("text-h6").props("role=heading aria-level=1")
    ui.label(HOW)
    try:
        rows = run_rows(result, in_hand.excluded())
    except CommandError as error:
        ui.label(str(error)).props("role=alert")
        return
    columns = [
        {"headerName": head, "field": name, "sortable": True, "filter": "agTextColumnFilter", "minWidth": 95, "flex": 1}
        | {"wrapHeaderText": True, "autoHeaderHeight": True}
        for name, head in _heads(result).items()
    ]
    columns.append(
        {"headerName": "Left out because", "field": REASON, "editable": True, "cellDataType": "text", "flex": 1}
        | {"minWidth": 200, "sortable": True, "filter": "agTextColumnFilter"}
        | {"cellStyle": {"background": "rgba(31,110,165,0.08)"}}
    )
    grid = ui.aggrid({"columnDefs": columns, "rowData": rows, "stopEditingWhenCellsLoseFocus": True}).style(
        "height: calc(100vh - 12rem)"
    )
    told = ui.label("").props("role=status")

    async def save() -> None:
        try:
            excluded = excluded_runs(result, await grid.get_client_data(timeout=REPLY))
        except (CommandError, TimeoutError) as error:
            told.text = str(error) or LOST
            return
        told.text = await done_by(post, lambda: in_hand.take(result, excluded)) or SAVED

    ui.button("Save", on_click=save).props("no-caps")


def _heads(result: StudyResult) -> dict[str, str]:
    """Field of a row → head of its column."""
    factors = {}
    for factor in result.surface.factors:
        symbol = unit_of_parameter(factor.path).symbol
        factors[factor.name] = f"{factor.name} [{symbol}]" if symbol else factor.name
    observables = {name: observable_label(name) for name in result.surface.observables}
    return {"setting": "Setting"} | factors | {"seed": "Seed", "outcome": "Outcome"} | observables


def run_rows(result: StudyResult, excluded: Sequence[ExcludedRun]) -> list[dict[str, str]]:
    """Every run of the surface; ``id``: its place among them."""
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
    """The runs with a reason, of the rows that a browser ``sent``. Raises CommandError for rows of another study."""
    runs = [run for row in result.surface.runs for run in row]
    found = {str(row.get("id")): row.get(REASON) for row in sent if isinstance(row, Mapping)}
    if set(found) != {str(k) for k in range(len(runs))}:
        raise CommandError("these are not the runs of the study; open the table again")
    excluded = []
    for k, run in enumerate(runs):
        reason = " ".join(str(found[str(k)] or "").split())
        if len(reason) > LONGEST_REASON:
            raise CommandError(
                f"{run.title}, seed {run.seed}: {len(reason)} characters; allowed: up to {LONGEST_REASON}"
            )
        if reason:
            excluded.append(ExcludedRun(run.label, run.experiment, run.seed, reason))
    return excluded
