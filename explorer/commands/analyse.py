"""``explorer analyse``: what the filled sheet of a designed experiment says."""

from __future__ import annotations

from pathlib import Path

import typer

from explorer.design.choices import ModelOrder, Reduction, Surrogate


def analyse(
    sheet: str = typer.Argument(metavar="RUNS.csv", help="Filled sheet of `explorer design`, or a shipped one's name."),
    response: str = typer.Option("", metavar="NAME", help="Column to analyse; needed where there are several."),
    target: float | None = typer.Option(None, help="Value that the response should have: which settings give it?"),
    target_error: float = typer.Option(0.0, min=0.0, help="Standard error of the target, in its unit."),
    model: ModelOrder | None = typer.Option(None, help="By default the highest order that the runs can bear."),
    terms: str = typer.Option("", metavar="A,B,A*B,…", help="Instead of an order, the terms; what they need is added."),
    reduce: Reduction | None = typer.Option(
        None, help="Drop terms one by one, factors after their products: by AICc, or while p > 0.05."
    ),
    surrogate: Surrogate | None = typer.Option(
        None, help="A Gaussian process beside the polynomial: which predicts better? --target is answered by it."
    ),
    only: str = typer.Option("", metavar="NAME,…", help="Only these factors; the others count as scatter."),
    block: str = typer.Option("", metavar="NAME", help="Column of days, batches or operators: a fixed effect each."),
    random: str = typer.Option(
        "", metavar="NAME", help="Column of groups drawn at random (days, whole plots, seeds): a variance component."
    ),
    factors: str | None = typer.Option(None, metavar="FILE", help="Factors file, for a sheet that declares none."),
    report: Path | None = typer.Option(
        None, "--report", "--out", metavar="DIR", help="New folder for result.json, the report, its figures and data."
    ),
    author: str = typer.Option("", metavar="NAME", help="Who made it, for the report."),
    notes: str = typer.Option("", metavar="TEXT", help="Notes for the report."),
    json: bool = typer.Option(False, "--json", help="Print the result as JSON, and nothing else."),
) -> None:
    """Effects, model, analysis of variance, diagnostics, canonical analysis, and the settings that give a target."""
    from explorer.design.analysis import AnalyseOrder, run_analyse
    from explorer.design.text import analysis_text
    from explorer.errors import CommandError
    from explorer.files.run_folder import json_text

    if target_error and target is None:
        raise CommandError("--target-error: belongs to --target")

    order = AnalyseOrder(
        sheet=sheet,
        response=response,
        target=target,
        target_error=target_error,
        factors=factors,
        order=model,
        terms=_names(terms),
        only=_names(only),
        block=block,
        random=random,
        reduction=reduce,
        surrogate=surrogate,
        out=report,
        author=author,
        notes=notes,
    )
    result = run_analyse(order)
    typer.echo(json_text(result.to_dict()) if json else analysis_text(result))
    if report is not None and not json:
        typer.echo(f"\nwrote {report / 'report.html'}, report.md, result.json")


def _names(text: str) -> tuple[str, ...]:
    return tuple(name.strip() for name in text.split(",") if name.strip())
