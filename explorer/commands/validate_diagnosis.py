"""``explorer validate-diagnosis``: how often the diagnosis finds the known truth in data of made-up laboratories."""

from __future__ import annotations

from pathlib import Path

import typer

from explorer.commands.shared_options import EVENTS, SCHEDULER, STORE


def validate_diagnosis(
    n: int = typer.Option(370, "--n", min=1, metavar="N", help="Number of data sets; 370 make a complete test."),
    root: int = typer.Option(
        1, "--root", min=1, metavar="N", help="Root of all random numbers; another root gives other data sets."
    ),
    laboratory: Path | None = typer.Option(
        None,
        metavar="FILE",
        help="File of a made-up laboratory (doe/validation/laboratory.py); by default the shipped one.",
    ),
    out: Path = typer.Option(Path("validation"), metavar="DIR", help="Folder for sets.jsonl, two lines per data set."),
    minutes: float | None = typer.Option(
        None,
        min=0.0,
        metavar="MINUTES",
        help="Stop after this time [min]; the same command continues. 0 only prints the table of finished data sets.",
    ),
    shard: str = typer.Option(
        "1/1",
        metavar="K/N",
        help="Process only every N-th data set, from the K-th on; N processes can share --out and --store.",
    ),
    sets: str = typer.Option(
        "", metavar="N,N,…", help="Process only the data sets with these numbers, counted from 0 to --n less one."
    ),
    wide: bool = typer.Option(False, "--wide", help="Data sets with effects of 4 to 40 σ, for development."),
    follow_up: bool = typer.Option(
        True, "--follow-up/--no-follow-up", help="Carry out the experiment that an answer asks for."
    ),
    store: Path | None = STORE,
    threads: int | None = typer.Option(
        None, min=1, metavar="N", help="Processes on this machine; by default one per CPU core."
    ),
    scheduler: str = SCHEDULER,
    json: bool = EVENTS,
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

    # Here --threads applies to the work on this machine: verdicts, and pours with an effect outside the library.
    check_scheduler(scheduler)

    number, _, of = shard.partition("/")
    if not (number.isdecimal() and of.isdecimal() and 1 <= int(number) <= int(of)):
        raise CommandError(f"--shard {shard}: allowed: K/N with 1 ≤ K ≤ N, such as 1/2")
    numbers = [one.strip() for one in sets.split(",")] if sets else []
    if not all(one.isdecimal() and int(one) < n for one in numbers):
        raise CommandError(f"--sets {sets}: allowed: numbers from 0 to {n - 1}, separated by commas")
    order = CampaignOrder(
        out=out,
        number=n,
        root=root,
        store=store,
        minutes=minutes if minutes is not None else math.inf,
        workers=threads,
        shard=int(number),
        of=int(of),
        only=tuple(map(int, numbers)),
        wide=wide,
        follow_up=follow_up,
        scheduler=scheduler,
        laboratory=laboratory or TREFOILS,
    )
    # A wrong file is reported before anything is written.
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
