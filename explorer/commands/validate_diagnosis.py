"""``explorer validate-diagnosis``: how often the diagnosis finds what made-up laboratories hide from it."""

from __future__ import annotations

from pathlib import Path

import typer


def validate_diagnosis(
    n: int = typer.Option(370, "--n", min=1, help="Data sets; 370 are a whole test."),
    root: int = typer.Option(1, "--root", min=1, help="Root of all random numbers: another root, other data sets."),
    laboratory: Path | None = typer.Option(
        None,
        metavar="FILE",
        help="What it declares and hands out (doe/validation/laboratory.py); the shipped one if not given.",
    ),
    out: Path = typer.Option(Path("validation"), help="Folder for sets.jsonl, two lines per data set."),
    minutes: float | None = typer.Option(
        None, min=0.0, help="Stop after so long; the same command goes on. 0: only the table of what is there."
    ),
    shard: str = typer.Option("1/1", metavar="K/N", help="Only every N-th set; N processes may share OUT and a store."),
    wide: bool = typer.Option(False, "--wide", help="Effects of 4 to 40 σ, for development."),
    follow_up: bool = typer.Option(
        True, "--follow-up/--no-follow-up", help="Carry out the experiment that an ambiguous answer asks for."
    ),
    store: Path | None = typer.Option(None, help="SQLite file that keeps every pour."),
    threads: int | None = typer.Option(None, min=1, help="Worker processes; one per core if not given."),
    scheduler: str = typer.Option("", metavar="tcp://…", help="Pour on the workers of this Dask scheduler."),
    json: bool = typer.Option(
        False, "--json", "--events", help="Print events for CI, one JSON object per line, and nothing else."
    ),
) -> None:
    """Diagnose made-up data with known truths and print how often the answer is right."""
    import math

    from doe.validation.campaign import SETS, CampaignOrder, run_campaign
    from doe.validation.laboratory import TREFOILS, read_laboratory
    from explorer.background.progress import SetProgress
    from explorer.background.reporter import end_as_by_ctrl_c, reporter_of
    from explorer.errors import CommandError
    from explorer.terminal.validation import campaign_text
    from solver import check_scheduler

    # Here --threads is for what stays on this machine: verdicts, and pours with an effect that the library lacks.
    check_scheduler(scheduler)

    number, _, of = shard.partition("/")
    if not (number.isdecimal() and of.isdecimal() and 1 <= int(number) <= int(of)):
        raise CommandError(f"--shard {shard}: allowed: K/N with 1 ≤ K ≤ N, such as 1/2")
    order = CampaignOrder(
        out=out,
        number=n,
        root=root,
        store=store,
        minutes=minutes if minutes is not None else math.inf,
        workers=threads,
        shard=int(number),
        of=int(of),
        wide=wide,
        follow_up=follow_up,
        scheduler=scheduler,
        laboratory=laboratory or TREFOILS,
    )
    # A wrong file is told before anything is made.
    read_laboratory(order.laboratory)
    end_as_by_ctrl_c()
    with reporter_of("validate-diagnosis", json) as reporter:
        out.mkdir(parents=True, exist_ok=True)
        reporter.begin(out, resumed=(out / SETS).exists())
        progress = SetProgress(reporter)
        progress.compiling()
        rows = run_campaign(order, reporter.say, progress)
        reporter.result = out / SETS
    reporter.say(campaign_text(rows))
