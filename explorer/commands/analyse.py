"""``explorer analyse``: analyse the completed sheet of a designed experiment."""

from __future__ import annotations

from pathlib import Path

import typer

from explorer.commands.shared_options import AUTHOR, NOTES, RESULT_JSON, parts_of, report_option
from explorer.design.choices import ModelOrder, Reduction, Surrogate


def analyse(
    sheet: str = typer.Argument(metavar="RUNS.csv", help="Completed sheet of `explorer design`: file or shipped name."),
    response: str = typer.Option("", metavar="NAME", help="Response column to analyse; required if there are several."),
    target: float | None = typer.Option(None, help="Desired value of the response; finds the settings that give it."),
    target_error: float = typer.Option(0.0, min=0.0, help="Standard error of --target, in its unit."),
    model: ModelOrder | None = typer.Option(
        None, help="Order of the model; by default the highest that the runs support."
    ),
    terms: str = typer.Option(
        "",
        metavar="A,B,A*B,…",
        help="Terms of the model, instead of --model; lower-order terms that they require are added.",
    ),
    reduce: Reduction | None = typer.Option(
        None, help="Drop terms one at a time, a factor only after its products and squares: by AICc, or while p > 0.05."
    ),
    surrogate: Surrogate | None = typer.Option(
        None,
        help="Also fit a Gaussian process, compare its predictions with the polynomial's, and use it for --target.",
    ),
    only: str = typer.Option("", metavar="NAME,…", help="Analyse only these factors; the others count as scatter."),
    block: str = typer.Option(
        "", metavar="NAME", help="Column of blocks (days, batches, operators), each with a fixed effect."
    ),
    random: str = typer.Option(
        "",
        metavar="NAME",
        help="Column of groups drawn at random (days, whole plots, seeds), with a variance component.",
    ),
    factors: str | None = typer.Option(
        None, metavar="FILE", help="Factors file, for a sheet that declares no factors."
    ),
    report: Path | None = report_option("result.json", "--report", "--out"),
    author: str = AUTHOR,
    notes: str = NOTES,
    json: bool = RESULT_JSON,
) -> None:
    """Analyse a designed experiment: effects, model, analysis of variance, diagnostics, settings that give a target."""
    from explorer.design.analysis import AnalyseOrder, run_analyse
    from explorer.design.text import analysis_text
    from explorer.errors import CommandError
    from explorer.files.run_folder import json_text

    if target_error and target is None:
        raise CommandError("--target-error: allowed only with --target")

    order = AnalyseOrder(
        sheet=sheet,
        response=response,
        target=target,
        target_error=target_error,
        factors=factors,
        order=model,
        terms=parts_of(terms),
        only=parts_of(only),
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
