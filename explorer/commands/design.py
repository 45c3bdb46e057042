"""``explorer design``: write the runs of a designed experiment as a sheet to fill in."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import typer

from explorer.commands.listing import Listing
from explorer.commands.shared_options import AUTHOR, NOTES, RESULT_JSON, report_option
from explorer.design.choices import FEWEST, MOST, Alpha, ModelOrder


class Designs(Listing):
    """Lists the designs."""

    heading = "Designs"

    def listed(self) -> Iterable[tuple[str, str]]:
        """Name and purpose of each design."""
        from doe.designs import DESIGNS

        return ((name, design.doc) for name, design in DESIGNS.items())


def design(
    kind: str = typer.Argument(metavar="DESIGN", help="Design from the list below."),
    factors: str = typer.Option(
        ..., metavar="FILE", help="TOML file with name, low, high and unit of every factor, or shipped name."
    ),
    out: Path = typer.Option(
        ..., metavar="FILE.csv", help="New sheet (.csv or .xlsx), one line per run in the order in which to run them."
    ),
    runs: int | None = typer.Option(
        None,
        min=FEWEST["runs"],
        help="Number of runs (plackett-burman: 8, 12, … 48; factorial: the best fraction of this size).",
    ),
    replicates: int | None = typer.Option(
        None,
        min=FEWEST["replicates"],
        max=MOST["replicates"],
        help="Replicates of each row; by default as in the factors file, otherwise 1.",
    ),
    centre: int | None = typer.Option(
        None,
        min=FEWEST["centre"],
        max=MOST["centre"],
        help="Number of centre runs; with --blocks, in each block.",
    ),
    blocks: int | None = typer.Option(
        None,
        min=FEWEST["blocks"],
        max=MOST["blocks"],
        help="Number of orthogonal blocks (days, batches), whose effects do not bias those of the model.",
    ),
    fold: bool = typer.Option(False, "--fold", help="plackett-burman: add the mirror image of every row."),
    nonregular: bool = typer.Option(
        False,
        "--nonregular",
        help="plackett-burman, 16 or 32 runs: no main effect is fully aliased with a two-factor interaction.",
    ),
    generator: list[str] = typer.Option([], metavar="E=ABC", help="factorial: generator of a fraction; repeatable."),
    fraction: int = typer.Option(
        0, min=FEWEST["fraction"], help="factorial: the 2^(k−P) fraction of minimum aberration.", metavar="P"
    ),
    alpha: Alpha = typer.Option(Alpha.ROTATABLE, help="central-composite: position of the axial points."),
    model: ModelOrder | None = typer.Option(
        None, help="d-optimal, i-optimal: model to design for; by default quadratic."
    ),
    constraint: list[str] = typer.Option(
        [], metavar="'A + B <= 1'", help="d-optimal, i-optimal: constraint in the factors' units; repeatable."
    ),
    augment: Path | None = typer.Option(
        None,
        metavar="RUNS.csv",
        help="d-optimal, i-optimal: keep the finished runs of this sheet and add --runs to them.",
    ),
    lattice: int | None = typer.Option(
        None,
        min=FEWEST["lattice"],
        max=MOST["lattice"],
        metavar="M",
        help="mixture: all blends in steps of 1/M; by default the simplex centroid.",
    ),
    seed: int | None = typer.Option(
        None,
        min=FEWEST["seed"],
        help="Seed of the run order and of random designs; by default as in the factors file, otherwise 1.",
    ),
    decimal_comma: bool = typer.Option(
        False,
        "--decimal-comma",
        help="Write the CSV with decimal commas and semicolons, as spreadsheets in many languages expect.",
    ),
    standard_order: bool = typer.Option(
        False, "--standard-order", help="Keep the runs in standard order instead of shuffling them."
    ),
    sigma: float | None = typer.Option(
        None, help="Standard deviation of one run; prints which effects the design can detect."
    ),
    effect: float | None = typer.Option(
        None,
        help="Size of a change, in the response's unit, without --sigma in standard deviations of one run; prints the "
        "probability of detecting it.",
    ),
    report: Path | None = report_option("plan.json", "--report"),
    author: str = AUTHOR,
    notes: str = NOTES,
    json: bool = RESULT_JSON,
) -> None:
    """Write the runs of a designed experiment, with its aliases and the effects that it can detect."""
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
        raise CommandError(
            f"--decimal-comma: not allowed for the workbook {out}, which shows numbers as the reader's program is set"
        )
    if report is not None:
        check_vacant(report, "--report")
    check_power(kind, sigma, effect)
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
