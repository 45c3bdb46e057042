"""``explorer design``: the runs of a designed experiment, as a sheet to fill in anywhere."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import typer

from explorer.commands.listing import Listing
from explorer.design.choices import FEWEST, MOST, Alpha, ModelOrder


class Designs(Listing):
    """Lists the designs."""

    heading = "Designs"

    def listed(self) -> Iterable[tuple[str, str]]:
        """With what each is for."""
        from doe.designs import DESIGNS

        return ((name, design.doc) for name, design in DESIGNS.items())


def design(
    kind: str = typer.Argument(metavar="DESIGN", help="One of the designs below."),
    factors: str = typer.Option(
        ..., metavar="FILE", help="TOML with name, low, high and unit of every factor, or a shipped one's name."
    ),
    out: Path = typer.Option(
        ..., metavar="FILE.csv", help="New sheet, .csv or .xlsx: one line per run in the order to run them."
    ),
    runs: int | None = typer.Option(
        None,
        min=FEWEST["runs"],
        help="plackett-burman: size of the table, 8 … 48; factorial: best fraction; others: points.",
    ),
    replicates: int | None = typer.Option(
        None, min=FEWEST["replicates"], max=MOST["replicates"], help="Runs of each row; 1 if not given."
    ),
    centre: int | None = typer.Option(
        None,
        min=FEWEST["centre"],
        max=MOST["centre"],
        help="Runs with every factor in the middle; with --blocks in each block.",
    ),
    blocks: int | None = typer.Option(
        None,
        min=FEWEST["blocks"],
        max=MOST["blocks"],
        help="Orthogonal blocks (days, batches): their effects take nothing from the model's.",
    ),
    fold: bool = typer.Option(False, "--fold", help="plackett-burman: add the mirror image of every row."),
    nonregular: bool = typer.Option(
        False, "--nonregular", help="plackett-burman, 16 and 32 runs: no main effect is wholly an interaction of two."
    ),
    generator: list[str] = typer.Option([], metavar="E=ABC", help="factorial: a fraction; may be repeated."),
    fraction: int = typer.Option(
        0, min=FEWEST["fraction"], help="factorial: 2^(k−P) of minimum aberration.", metavar="P"
    ),
    alpha: Alpha = typer.Option(Alpha.ROTATABLE, help="central-composite: where the axial points stand."),
    model: ModelOrder | None = typer.Option(None, help="d-optimal, i-optimal: of whose terms; quadratic if not given."),
    constraint: list[str] = typer.Option(
        [], metavar="'A + B <= 1'", help="d-optimal, i-optimal: in the factors' units; may be repeated."
    ),
    augment: Path | None = typer.Option(
        None, metavar="RUNS.csv", help="d-optimal, i-optimal: keep this sheet's finished runs, and add --runs to them."
    ),
    lattice: int | None = typer.Option(
        None,
        min=FEWEST["lattice"],
        max=MOST["lattice"],
        metavar="M",
        help="mixture: all blends in steps of 1/M; the simplex centroid if not given.",
    ),
    seed: int | None = typer.Option(
        None, min=FEWEST["seed"], help="Of the order of the runs, and of designs that are drawn; 1 if not given."
    ),
    decimal_comma: bool = typer.Option(
        False, "--decimal-comma", help="CSV with 0,5 for 0.5 and semicolons, as spreadsheets of many languages open it."
    ),
    standard_order: bool = typer.Option(False, "--standard-order", help="Do not shuffle the runs."),
    sigma: float | None = typer.Option(None, help="Standard deviation of one run: what will the design see?"),
    effect: float | None = typer.Option(None, help="With which chance will it see a change so large?"),
    report: Path | None = typer.Option(
        None, metavar="DIR", help="New folder for plan.json, the report of the runs, its figures and data."
    ),
    author: str = typer.Option("", metavar="NAME", help="Who made it, for the report."),
    notes: str = typer.Option("", metavar="TEXT", help="Notes for the report."),
    json: bool = typer.Option(False, "--json", help="Print plain data."),
) -> None:
    """Write the runs of a design; says what is confused with what, and which effects it will be able to see."""
    from doe.table_file import WORKBOOK
    from explorer.design.factors_file import read_factors
    from explorer.design.run_plan import DesignOrder, make_plan, sheet_content
    from explorer.design.text import check_power, plan_result, plan_text
    from explorer.errors import CommandError
    from explorer.files.output_file import check_new_file, check_vacant, write_whole_bytes
    from explorer.files.run_folder import appearing, json_text
    from explorer.files.run_result import made_today
    from solver.assets import asset_path

    check_new_file(out, option="--out")
    workbook = out.suffix.lower() == WORKBOOK
    if workbook and decimal_comma:
        raise CommandError(f"--decimal-comma: {out} is a workbook, which shows numbers as its reader has them")
    if report is not None:
        check_vacant(report, "--report")
    check_power(sigma, effect)
    file = read_factors(asset_path("designs", factors))
    order = DesignOrder(
        kind,
        runs=runs,
        replicates=replicates,
        centre=centre,
        seed=seed,
        fold=fold,
        generators=tuple(generator),
        fraction=fraction,
        alpha=alpha,
        standard_order=standard_order,
        blocks=blocks,
        nonregular=nonregular,
        model=model,
        constraints=tuple(constraint),
        augment=augment,
        lattice=lattice,
    )
    plan = make_plan(order, file)
    said = json_text(plan_result(plan, file, sigma, effect)) if json else plan_text(plan, file, sigma, effect)
    write_whole_bytes(out, sheet_content(plan, file, workbook, decimal_comma))
    if report is not None:
        from explorer.design.plan_result import design_plan
        from explorer.report.design.plan import plan_report
        from explorer.report.folder import write_report

        made = design_plan(plan, file, sigma, effect, made_today(author, notes))
        with appearing(report, "--report") as folder:
            write_report(plan_report(made), folder, {made.NAME: json_text(made.to_dict()) + "\n"})
    then = f"explorer analyse {out}{' --block block' if blocks else ''}"
    typer.echo(said if json else f"{said}\n\nwrote {out}; fill in {', '.join(file.responses)}, then: {then}")
