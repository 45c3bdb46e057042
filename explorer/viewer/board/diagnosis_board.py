"""The board of a diagnosis: one screen that says what is missing and how certain that is, with before and after."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from explorer.background.command_process import CommandStatus
from explorer.diagnosis.result import DiagnosisResult
from explorer.project.steps import Room
from explorer.report.content import Banner, Table
from explorer.report.diagnosis.answer import banner, follow_up_text
from explorer.report.diagnosis.charts import diagnosis_plots, likely, map_chart
from explorer.report.diagnosis.wording import chance, feature_label, feature_value, spelled
from explorer.report.study_charts import Plot
from explorer.viewer.board.board import Board, BoardAct, BoardTable, made_charts
from explorer.viewer.board.study_board import stages_of, working

SIDE_BY_SIDE, POUR_CORRECTED, CALIBRATE_CORRECTED = "show_piles", "pour_corrected", "calibrate_corrected"
ASK_FURTHER = "ask_further"
"""Commands of a board's buttons."""
FURTHER_ACT = BoardAct("What else is missing?", {"do": ASK_FURTHER})
SIDE_BY_SIDE_ACT = BoardAct("Show side by side", {"do": SIDE_BY_SIDE})
CORRECTED_ACTS = (
    BoardAct("Pour the corrected model", {"do": POUR_CORRECTED}),
    BoardAct("Calibrate the corrected model", {"do": CALIBRATE_CORRECTED}, Room.CALIBRATE),
)


def diagnosis_board(
    result: DiagnosisResult | None, status: CommandStatus | None, report: str = "", on_page: bool = True
) -> Board:
    """The board of ``result``; ``status`` of the process at work, None if there is none.

    ``on_page``: whether it is part of a page whose buttons do what comes next, rather than alone.
    """
    alive = status is not None and status.alive
    subtitle = working(status) if status is not None and alive else ""
    if result is None:
        return Board("", subtitle, stages=stages_of(status))
    plots = diagnosis_plots(result)
    first = {title: plot for title, plot in plots.items() if title.startswith("Pile")}
    maps = {
        f"Where the pile is off, {one.condition}": Plot(
            partial(map_chart, one), "Measured minus model over the plate; lines: measured height.", 0.55
        )
        for one in sorted(result.maps, key=lambda one: one.role != "holdout")
    }
    rest = {title: plot for title, plot in plots.items() if title not in first}
    return Board(
        title=result.data.title or result.data.folder,
        subtitle=subtitle,
        banner=_pressed(result) if on_page else banner(result),
        acts=(
            SIDE_BY_SIDE_ACT,
            *(CORRECTED_ACTS if result.added else ()),
            *((FURTHER_ACT,) if result.handed_on() else ()),
        ),
        stages=stages_of(status) if alive else (),
        charts=made_charts(first | maps | rest),
        tables=(_answers(result), _errors(result)),
        report=report,
    )


def _pressed(result: DiagnosisResult) -> Banner:
    """The verdict; if there are buttons below it, they give what comes next, instead of commands."""
    shown = banner(result)
    if result.kind == "ambiguous" and result.next_experiment:
        return replace(shown, then="Pour and measure that, fill it in under Follow-up, above, and answer with it.")
    further = ["What else is missing beside it?"] if result.handed_on() else []
    check = [f"{follow_up_text(result)} Fill that in under Follow-up, above."] if result.next_experiment else []
    if result.added:
        return replace(shown, then=" ".join(["Pour the corrected model, and calibrate it.", *further, *check]))
    return replace(shown, then=f"Use the calibrated model. {check[0]}") if check else shown


def _answers(result: DiagnosisResult) -> BoardTable:
    rows = tuple((spelled(answer), chance(p)) for answer, p in likely(result))
    return BoardTable("Answers", Table(("Answer", "Probability"), rows), folded=False)


def _errors(result: DiagnosisResult) -> BoardTable:
    errors, words = result.error.told()
    rows = tuple(
        (
            feature_label(row.observable),
            *(feature_value(result, row.observable, one) for one in (row.before, row.after, row.noise_floor)),
        )
        for row in errors
    )
    table = Table(("Observable", "Before", "After", "Noise floor"), rows)
    return BoardTable(f"Error on {words} data", table, folded=False)
