"""The board of a study: its verdict, its stages, all charts so far, the answers and every run."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from doe.errors import StatisticsError
from doe.run_records import Run
from doe.studies.exclusion import ExcludedRun, optimum_without
from doe.studies.study_result import AnyStudy, PartialStudy, StudyResult
from doe.target import experiment_of
from explorer.background.command_process import CommandStatus
from explorer.outcomes import outcome_text
from explorer.photograph.target import FOLDER, PhotographedTarget, load_target
from explorer.report.content import Table
from explorer.report.figures.pours import outlines_caption, pile_outlines
from explorer.report.identified import settings
from explorer.report.sections.answer import banner
from explorer.report.study_charts import Plot, Plots, study_plots
from explorer.study.run_scene import observed_of, stages_with_runs
from explorer.units import enumeration, number, observable_label
from explorer.viewer.board.board import Board, BoardTable, Stage, made_charts
from explorer.viewer.study.process_view import AT_WORK, DONE, TO_COME, time_left

PHOTOGRAPHED = "Photographed pile and poured ones"
RUN_HEADER = ("Stage", "Setting", "Seed", "Outcome", "Value")


def study_board(
    result: AnyStudy | None,
    status: CommandStatus | None,
    report: str = "",
    photographed: PhotographedTarget | None = None,
    excluded: Sequence[ExcludedRun] = (),
) -> Board:
    """The board of ``result``; ``status`` of the process that works on it, None if there is none.

    ``photographed``: the photographs against which it was calibrated; ``excluded``: runs that the user leaves out.
    """
    alive = status is not None and status.alive
    so_far = (result.partial or "", result.line) if isinstance(result, PartialStudy) else ("", "")
    if result is None:
        return Board("", working(status) if status is not None and alive else "", stages=stages_of(status))
    study, finished = result.study, isinstance(result, StudyResult)
    return Board(
        title=study.title or study.name,
        subtitle=working(status) if status is not None and alive else f"profile {study.profile.name}",
        banner=banner(result) if isinstance(result, StudyResult) else None,
        stages=() if finished else stages_of(status, so_far),
        charts=made_charts(_beside_photographs(result, photographed))
        + made_charts(study_plots(result))[:: -1 if finished else 1],
        tables=(*_answers(result), *_without(result, excluded), _runs(result)),
        report=report,
    )


def photographed_of(folder: Path | None) -> PhotographedTarget | None:
    """The photographs against which the study in ``folder`` is calibrated; None if it has another target."""
    return None if folder is None else load_target(folder / FOLDER)


def _beside_photographs(result: AnyStudy, photographed: PhotographedTarget | None) -> Plots:
    """Measured silhouettes, with a photograph behind them, over the poured ones; empty until there are both."""
    if photographed is None or not isinstance(result, StudyResult) or not result.piles or not photographed.outlines:
        return {}
    outlines, behind = photographed.outlines, photographed.backdrop
    caption = outlines_caption(result.piles, len(outlines)) + (f" Behind: {behind.name}." if behind else "")
    if (mass := result.study.profile.mass) is not None:
        caption += f" {number(1e3 * mass)} g were poured; sizes compare with a pile of that mass only."
    return {PHOTOGRAPHED: Plot(partial(pile_outlines, result.piles, outlines, behind), caption, 0.6)}


def working(status: CommandStatus) -> str:
    """The progress of a command, in a line."""
    words = "Paused" if status.state == "paused" else "Running"
    if not status.planned:
        return f"{words}: {status.stage or 'the program loads'}"
    return f"{words}: {status.stage}, {status.done} of {status.planned}, time left {time_left(status.eta_s)}"


def stages_of(status: CommandStatus | None, so_far: tuple[str, str] = ("", "")) -> tuple[Stage, ...]:
    """The stages of a command with their progress; ``so_far``: a stage, and what it would find if it ended now."""
    if status is None:
        return ()
    return tuple(
        Stage(
            one.name,
            f"{one.done} of {one.planned}" if one.planned else TO_COME,
            DONE
            if one.finding is not None or 0 < one.planned <= one.done
            else AT_WORK
            if status.alive and one.name == status.stage
            else TO_COME,
            one.finding or (f"so far: {so_far[1]}" if one.name == so_far[0] and so_far[1] else ""),
        )
        for one in status.stages
    )


def _answers(result: AnyStudy) -> tuple[BoardTable, ...]:
    """The resulting parameters, if the study has got that far."""
    if result.optimum is None:
        return ()
    rows = tuple(
        (one.name, one.label, one.chosen if one.identified else one.answer, "yes" if one.identified else "no")
        for one in settings(result.optimum)
    )
    caption = "Where a factor is not identified, the range that gives the target is the answer."
    table = Table(("Factor", "Parameter", "Answer", "Identified"), rows, caption)
    return (BoardTable("Parameters", table, folded=False),)


def _without(result: AnyStudy, excluded: Sequence[ExcludedRun]) -> tuple[BoardTable, ...]:
    """What the study would have answered without the excluded runs, and why they are excluded."""
    if not isinstance(result, StudyResult):
        return ()
    runs = [run for row in result.surface.runs for run in row]
    excluded = [one for one in excluded if any(one.is_of(run) for run in runs)]
    if not excluded:
        return ()
    why = Table(("Run left out", "Seed", "Because"), tuple((one.label, str(one.seed), one.reason) for one in excluded))
    reasons = BoardTable("Runs left out", why, folded=False)
    try:
        left = settings(optimum_without(result, excluded))
    except StatisticsError as error:
        text = Table(("Without them",), ((f"no model: {error}",),))
        return (BoardTable("Parameters without these runs", text, folded=False), reasons)
    rows = tuple(
        (one.name, one.label, *(each.chosen if each.identified else each.answer for each in (one, other)))
        for one, other in zip(settings(result.optimum), left, strict=True)
    )
    caption = "The surface is fitted anew; its factors, its region and the verification are those of all runs."
    table = Table(("Factor", "Parameter", "All runs", "Without"), rows, caption)
    return (BoardTable("Parameters without these runs", table, folded=False), reasons)


def listed_runs(result: AnyStudy) -> list[tuple[str, Run]]:
    """Every run with its stage, in running order."""
    return [(stage, run) for stage in stages_with_runs(result) for runs in result.runs_of(stage) for run in runs]


def _runs(result: AnyStudy) -> BoardTable:
    targets = [target.observable for target in result.study.targets]
    first = {experiment_of(name): name for name in reversed(targets)}
    runs = listed_runs(result)
    rows = tuple(
        (stage, run.title, str(run.seed), outcome_text(run.outcome), observed_of(run, first[run.experiment]))
        for stage, run in runs
    )
    opens = tuple({"do": "open_run", "stage": stage, "label": run.label, "seed": run.seed} for stage, run in runs)
    read = enumeration(
        [observable_label(name) for name in dict.fromkeys(first[experiment_of(name)] for name in targets)]
    )
    caption = f"Value: {read}. A click on a row pours that run in the scene."
    return BoardTable(f"Runs ({len(rows)})", Table(RUN_HEADER, rows, caption), opens)
