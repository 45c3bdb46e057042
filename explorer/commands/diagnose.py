"""``explorer diagnose``: which physical effect do measured data ask for that the declared model lacks?"""

from __future__ import annotations

from pathlib import Path

import typer


def diagnose(
    folder: str = typer.Argument(
        ..., metavar="DIR", help="Folder with measurement.toml, or a shipped data set's name."
    ),
    out: Path = typer.Option(Path("diagnosis"), help="Folder for diagnosis.json, the report, its figures and data."),
    effects: str = typer.Option("", metavar="A,B,…", help="Candidates; all effects if not given."),
    budget: int | None = typer.Option(None, min=1, metavar="POURS", help="About so many pours for the emulator."),
    resume: bool = typer.Option(False, "--resume", help="Go on in a folder that is not empty."),
    store: Path | None = typer.Option(None, help="SQLite file that keeps every pour."),
    threads: int | None = typer.Option(None, min=1, help="Worker processes; one per core if not given."),
    scheduler: str = typer.Option("", metavar="tcp://…", help="Pour on the workers of this Dask scheduler."),
    seed: int = typer.Option(0, min=0, help="Of the pours; another one asks for others."),
    follow_up: Path | None = typer.Option(
        None, "--follow-up", metavar="DIR", help="The folder OUT/next of an ambiguous answer, filled in."
    ),
    given: Path | None = typer.Option(
        None, metavar="DIR", help="A finished diagnosis: with its effect in the model, what else is missing?"
    ),
    plan_next: bool = typer.Option(
        True, "--next/--no-next", help="Pour what could be measured next if the answer is ambiguous."
    ),
    author: str = typer.Option("", metavar="NAME", help="Who made it, for the report."),
    notes: str = typer.Option("", metavar="TEXT", help="Notes for the report."),
    apply: bool = typer.Option(False, "--apply", help="Also write the corrected material as OUT/corrected.toml."),
    record: Path | None = typer.Option(
        None, metavar="FILE.rrd", help="New recording of the piles; a finished OUT is only recorded."
    ),
    json: bool = typer.Option(
        False, "--json", "--events", help="Print events for CI, one JSON object per line, and nothing else."
    ),
) -> None:
    """Calibrate the declared model, test what is left, name the missing effect, confirm it by fresh pours."""
    from explorer.background.reporter import end_as_by_ctrl_c, reporter_of
    from explorer.diagnosis.run import DiagnoseOrder, run_diagnose
    from solver import check_scheduler
    from solver.assets import measurement_folder

    check_scheduler(scheduler, threads)

    end_as_by_ctrl_c()
    names = tuple(name.strip() for name in effects.split(",") if name.strip())
    order = DiagnoseOrder(
        folder=measurement_folder(folder),
        out=out,
        effects=names,
        budget=budget,
        resume=resume,
        store=store,
        threads=threads,
        apply=apply,
        seed=seed,
        follow_up=follow_up,
        given=given,
        plan_next=plan_next,
        author=author,
        notes=notes,
        record=record,
        scheduler=scheduler,
    )
    with reporter_of("diagnose", json) as reporter:
        run_diagnose(order, reporter)
