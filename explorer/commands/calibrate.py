"""`explorer calibrate`: the whole study in this process, with progress, into a folder."""

from __future__ import annotations

from pathlib import Path

import typer

FAILURE, ABOVE_LIMIT, MOVED = 1, 3, 4


def calibrate(
    headless: bool = typer.Option(
        False, "--headless", help="Run here, without a page; the page runs it from its own panel."
    ),
    study: str = typer.Option("sunflower_extract", help="A shipped study or the path of a study file."),
    profile: str = typer.Option("standard", help="Size of the study: a [profile.NAME] of the study file."),
    target: Path | None = typer.Option(
        None, metavar="DIR", help="Photographs in place of the study's angle: a folder of `explorer measure --target`."
    ),
    out: Path = typer.Option(Path("results"), help="Folder for result.json, the report, its figures and data."),
    resume: bool = typer.Option(False, "--resume", help="Go on in a folder that is not empty."),
    store: Path | None = typer.Option(None, help="SQLite file that keeps every run."),
    record: Path | None = typer.Option(
        None,
        metavar="FILE.rrd|DIR",
        help="New recording of the piles, a finished OUT is only recorded; or a folder for all verification pours.",
    ),
    threads: int | None = typer.Option(None, min=1, help="Pours at the same time; one per core if not given."),
    scheduler: str = typer.Option("", metavar="tcp://…", help="Pour on the workers of this Dask scheduler."),
    tries: int = typer.Option(3, min=1, max=20, help="Seeds tried for one replicate that gives no valid pour."),
    beyond_reach: bool = typer.Option(
        False, "--beyond-reach", help="Go on where no setting of the factors comes near the target."
    ),
    author: str = typer.Option("", metavar="NAME", help="Who made it, for the report."),
    notes: str = typer.Option("", metavar="TEXT", help="Notes for the report."),
    fail_above: float | None = typer.Option(
        None, min=0.0, help="Exit with 3 where the relative error of a target is above this [%]."
    ),
    baseline: Path | None = typer.Option(
        None, metavar="RESULT.json", help="Earlier result: exit with 4 if verdict, mean, noise or parameters moved."
    ),
    summary: Path | None = typer.Option(None, metavar="FILE.md", help="Verdict and what moved, as Markdown for CI."),
    junit: Path | None = typer.Option(None, metavar="FILE.xml", help="The same as JUnit XML, a case per question."),
    json: bool = typer.Option(
        False, "--json", "--events", help="Print events for CI, one JSON object per line, and nothing else."
    ),
) -> None:
    """Calibrate a material: pilot, reach, screening, ascent, response surface, optimum, verification, report."""
    from doe.errors import StudyStopped
    from doe.studies.baseline import BaselineError, compare, moved
    from explorer.background.reporter import end_as_by_ctrl_c, reporter_of
    from explorer.errors import CommandError
    from explorer.files.output_file import check_folder_of, write_whole
    from explorer.study import for_ci
    from explorer.study.run import StudyOrder, run_study
    from solver import check_scheduler

    if not headless:
        raise CommandError("calibrate: add --headless to run here, or start it from the panel of `explorer serve`")
    check_scheduler(scheduler, threads)
    # Before any pour: a file that is no result, or cannot be written, is told at once.
    for option, path in (("--summary", summary), ("--junit", junit)):
        if path is not None:
            check_folder_of(path, option)
    before = for_ci.read_baseline(baseline) if baseline is not None else None
    end_as_by_ctrl_c()
    one_file = record is not None and record.suffix == ".rrd"
    folder, piles = (None, record) if one_file else (record, None)
    if scheduler and folder is not None:
        raise CommandError(
            f"--record {folder}: a folder takes pours of this machine; leave --scheduler out, or name a .rrd file"
        )
    order = StudyOrder(
        study,
        profile,
        out,
        resume=resume,
        store=store,
        record=folder,
        threads=threads,
        tries=tries,
        author=author,
        notes=notes,
        target=target,
        beyond_reach=beyond_reach,
        piles=piles,
        scheduler=scheduler,
    )
    try:
        with reporter_of("calibrate", json) as reporter:
            result = run_study(order, reporter)
    except StudyStopped as stopped:
        typer.echo(f"error: {' '.join(str(stopped).split())}", err=True)
        raise typer.Exit(FAILURE) from None
    try:
        compared = () if before is None else compare(before, result)
    except BaselineError as error:
        raise CommandError(f"--baseline {baseline}: {error}") from None
    if summary is not None:
        write_whole(summary, for_ci.summary(result, compared))
    if junit is not None:
        write_whole(junit, for_ci.junit(result, compared, fail_above))
    for one in (gone := moved(compared)):
        typer.echo(f"moved: {for_ci.change(one)} ({one.why or one.answer})", err=True)
    above = [] if fail_above is None else [fault for one in for_ci.errors(result) if (fault := one.fault(fail_above))]
    for line in above:
        typer.echo(line, err=True)
    if above:
        raise typer.Exit(ABOVE_LIMIT)
    if gone:
        raise typer.Exit(MOVED)
