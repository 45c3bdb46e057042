"""``explorer calibrate``: run a whole study in this process, with progress, and write it to a folder."""

from __future__ import annotations

from pathlib import Path

import typer

from explorer.commands.shared_options import AUTHOR, EVENTS, NOTES, RESUME, SCHEDULER, STORE, THREADS

FAILURE, ABOVE_LIMIT, MOVED = 1, 3, 4


def calibrate(
    headless: bool = typer.Option(
        False,
        "--headless",
        help="Required: run here, without the page (`explorer serve` starts studies from its own panel).",
    ),
    study: str = typer.Option("sunflower_extract", metavar="STUDY", help="Study: file or shipped name."),
    profile: str = typer.Option(
        "standard", metavar="NAME", help="Size of the study: a [profile.NAME] of the study file."
    ),
    target: Path | None = typer.Option(
        None,
        metavar="DIR",
        help="Photographs instead of the study's angle: a folder written by `explorer measure --target`.",
    ),
    out: Path = typer.Option(
        Path("results"), metavar="DIR", help="Output folder for the report, its figures and data, and result.json."
    ),
    resume: bool = RESUME,
    store: Path | None = STORE,
    record: Path | None = typer.Option(
        None,
        metavar="FILE.rrd|DIR",
        help="New recording of the piles (a finished --out is only recorded), or folder for recordings of all "
        "verification pours.",
    ),
    threads: int | None = THREADS,
    scheduler: str = SCHEDULER,
    tries: int = typer.Option(3, min=1, max=20, metavar="N", help="Seeds tried for a replicate without a valid pour."),
    beyond_reach: bool = typer.Option(
        False, "--beyond-reach", help="Continue even if no setting of the factors comes near the target."
    ),
    author: str = AUTHOR,
    notes: str = NOTES,
    fail_above: float | None = typer.Option(
        None, min=0.0, metavar="PERCENT", help="Exit with 3 if the relative error of a target exceeds this [%]."
    ),
    baseline: Path | None = typer.Option(
        None, metavar="RESULT.json", help="Earlier result; exit with 4 if the verdict, mean, noise or parameters moved."
    ),
    summary: Path | None = typer.Option(
        None, metavar="FILE.md", help="Markdown file for the verdict and what moved, for CI."
    ),
    junit: Path | None = typer.Option(None, metavar="FILE.xml", help="The same as JUnit XML, one case per question."),
    json: bool = EVENTS,
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
    # Before any pour, so that a baseline that is not a result, or a file that cannot be written, is reported at once.
    for option, path in (("--summary", summary), ("--junit", junit)):
        if path is not None:
            check_folder_of(path, option)
    before = for_ci.read_baseline(baseline) if baseline is not None else None
    end_as_by_ctrl_c()
    one_file = record is not None and record.suffix == ".rrd"
    folder, piles = (None, record) if one_file else (record, None)
    if scheduler and folder is not None:
        raise CommandError(
            f"--record {folder}: a folder records only pours on this machine; leave out --scheduler, or name a .rrd "
            "file"
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
