"""``explorer verify``: compare the solver with closed-form solutions, conservation laws and a published benchmark."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from explorer.commands.shared_options import STORE_HELP

if TYPE_CHECKING:
    from solver.verification import Row

USUAL_POURS = 241
"""Pours of each kind that give an equivalence test with a margin of 0.3 SD a power of 0.9."""
USUAL_LIMIT = 120.0
"""Limit of the wall time of a run of LIGGGHTS [s]."""


def verify(
    only: list[str] = typer.Option([], metavar="NAME", help="Run only this test, such as T4; repeatable."),
    json: Path | None = typer.Option(None, "--json", metavar="FILE", help="File for every row of the table."),
    every: bool = typer.Option(
        False, "--all", help="Print every point, not only the one with the largest error on each curve."
    ),
    peers: bool = typer.Option(
        False,
        "--peers",
        help="Also run T4, T5, T6 and T8 in LIGGGHTS, and here with its tangential law, and print their values at the "
        "points that miss their limit.",
    ),
    peer_limit: float | None = typer.Option(
        None,
        metavar="S",
        help="With --peers: wall time after which a run of LIGGGHTS is stopped [s]; by default 120.",
        min=1.0,
    ),
    economy: str | None = typer.Option(
        None,
        metavar="STUDY",
        help="Instead, test for this study whether piles with and without an economy of the method are equivalent.",
    ),
    change: str | None = typer.Option(
        None, metavar="NAME", help="With --economy: name of the economy; by default larger_steps."
    ),
    profile: str | None = typer.Option(
        None,
        metavar="NAME",
        help="With --economy: profile of the study that gives shapes and mass; by default standard.",
    ),
    pours: int | None = typer.Option(
        None,
        min=2,
        metavar="N",
        help="With --economy: pours with and without it at each of three settings; by default 241 each.",
    ),
    store: Path | None = typer.Option(None, metavar="FILE", help=f"With --economy: {STORE_HELP}"),
) -> None:
    """Check the solver against known solutions.

    These are tests T1 to T8 of Chung & Ooi (2011), restitution and conservation laws. The exit code is 0 if every limit
    is met and 1 if not; rows without a limit are shown for comparison. The results of --peers do not change it.
    """
    from explorer.errors import CommandError
    from explorer.files.output_file import check_folder_of, write_whole

    if json:
        check_folder_of(json, "--json")
    if peer_limit is not None and not peers:
        raise CommandError("--peer-limit: allowed only with --peers")
    if economy is not None:
        if only or peers or every:
            raise CommandError("--economy: only compares piles; leave out --only, --peers and --all")
        from explorer.study.economy import compare_economy, economy_text

        asked = (economy, profile or "standard", change or "larger_steps", pours or USUAL_POURS)
        typer.echo(economy_text(compare_economy(*asked, store, json, typer.echo)))
        return
    if any(one is not None for one in (change, profile, pours, store)):
        raise CommandError("--change, --profile, --pours, --store: allowed only with --economy")
    from explorer.export.impacts import liggghts_engine
    from explorer.export.run import installed
    from explorer.files.run_folder import json_text
    from explorer.terminal.verification import peers_text, result_of, summary_text, table_text
    from solver.verification import BY_ANY_ENGINE, FAMILIES, OURS_BY_DISPLACEMENT, verify_engine
    from solver.verification import verify as rows_of

    by_lower_case = {name.lower(): name for name in FAMILIES}
    for name in only:
        if name.lower() not in by_lower_case:
            raise CommandError(f"--only: {name!r} is not one of {', '.join(FAMILIES)}")
    wanted = {by_lower_case[name.lower()] for name in only}
    chosen = [name for name in FAMILIES if name in wanted or not wanted]
    shared = [name for name in chosen if name in BY_ANY_ENGINE]
    if peers:
        if not shared:
            raise CommandError(f"--peers: runs only {', '.join(BY_ANY_ENGINE)}, but --only names none of them")
        installed("liggghts")
    rows = list(rows_of(chosen))

    def keep(beside: dict[str, list[Row]]) -> None:
        if json:
            write_whole(json, json_text(result_of(rows, beside)) + "\n")

    keep({})
    typer.echo(table_text(rows, every))
    if peers:
        engine = liggghts_engine(peer_limit or USUAL_LIMIT)
        beside = {one.name: list(verify_engine(one, shared)) for one in (engine, OURS_BY_DISPLACEMENT)}
        keep(beside)
        typer.echo(peers_text(rows, beside))
    typer.echo(summary_text(rows))
    if not all(row.passed for row in rows):
        raise typer.Exit(1)
