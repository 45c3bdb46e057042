"""``explorer diagnose``: which physical effect in the measured data does the declared model lack?"""

from __future__ import annotations

from pathlib import Path

import typer

from explorer.commands.shared_options import AUTHOR, EVENTS, NOTES, RESUME, SCHEDULER, STORE, THREADS, parts_of


def diagnose(
    folder: str = typer.Argument(
        ..., metavar="DIR", help="Folder of measured data (with measurement.toml), or shipped name."
    ),
    out: Path = typer.Option(
        Path("diagnosis"),
        metavar="DIR",
        help="Output folder for the report, its figures and data, and diagnosis.json.",
    ),
    effects: str = typer.Option("", metavar="A,B,…", help="Candidate effects; by default all."),
    budget: int | None = typer.Option(
        None, min=1, metavar="POURS", help="Approximate number of pours for the emulator."
    ),
    resume: bool = RESUME,
    store: Path | None = STORE,
    threads: int | None = THREADS,
    scheduler: str = SCHEDULER,
    seed: int = typer.Option(0, min=0, help="Seed of the pours; another seed gives other pours."),
    follow_up: Path | None = typer.Option(
        None,
        "--follow-up",
        metavar="DIR",
        help="Completed folder OUT/next of a diagnosis; the follow-ups before it are read too.",
    ),
    given: Path | None = typer.Option(
        None,
        metavar="DIR",
        help="Folder of a finished diagnosis: include its effect in the model and look for further ones.",
    ),
    plan_next: bool = typer.Option(
        True, "--next/--no-next", help="Look for what to measure next; simulated if the answer is ambiguous."
    ),
    author: str = AUTHOR,
    notes: str = NOTES,
    apply: bool = typer.Option(False, "--apply", help="Also write the corrected material as OUT/corrected.toml."),
    record: Path | None = typer.Option(
        None, metavar="FILE.rrd", help="New recording of the piles (a finished --out is only recorded)."
    ),
    json: bool = EVENTS,
) -> None:
    """Calibrate the declared model, test its residuals, name the missing effect and confirm it with fresh pours."""
    from explorer.background.reporter import end_as_by_ctrl_c, reporter_of
    from explorer.diagnosis.run import DiagnoseOrder, run_diagnose
    from solver import check_scheduler
    from solver.assets import measurement_folder

    check_scheduler(scheduler, threads)

    end_as_by_ctrl_c()
    order = DiagnoseOrder(
        folder=measurement_folder(folder),
        out=out,
        effects=parts_of(effects),
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
