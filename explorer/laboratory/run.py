"""From an order to what `explorer lab` prints and writes: read, derive, write the part, run the twins."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from doe.laboratory import LabResult, analyse
from doe.laboratory.analysis import analyse_composition, analyse_elastic, template_of
from doe.laboratory.bias import BiasTable, bias_table
from explorer.errors import CommandError
from explorer.files.output_file import check_new_file, check_vacant, write_whole
from explorer.files.run_folder import appearing, json_text
from explorer.files.run_result import made_today
from explorer.laboratory.part import part_table, part_text, with_part
from explorer.laboratory.twin_row import TwinRow, check_twin
from explorer.scene.file import DEFAULT_MATERIAL, material_scene
from explorer.terminal.laboratory import bias_data, bias_text, lab_data, lab_text, twin_text
from solver import ParameterError, Scene
from solver.assets import asset_path

CLOSED_FORM = ("shear", "rebound")
"""Tests with a twin for which the bias of the formula exists in closed form only."""


@dataclass(frozen=True)
class LabOrder:
    """The order to `explorer lab`; with ``file`` None, only for the bias of the test's formula, or for a template."""

    test: str
    file: str | None = None
    compression: str | None = None
    left_out: tuple[str, ...] = ()
    out: Path | None = None
    figure: Path | None = None
    material: str | None = None
    simulate: bool = False
    bias: bool = False
    template: bool = False
    json: bool = False
    report: Path | None = None
    author: str = ""
    notes: str = ""


def run_lab(order: LabOrder, say: Callable[[str], None]) -> bool:
    """Carry out ``order``; True if every requested round trip closes. Raises CommandError and others, in one line."""
    _check(order)
    if order.template:
        _template(order, say)
        return True
    if order.file is None:
        table = bias_table(order.test)
        say(json_text({"test": order.test, "bias": bias_data(table)}) if order.json else bias_text(table))
        return True
    result = analysed(order)
    part = part_table(result)
    scene = _scene_with(part, order) if order.simulate else None
    _write(order, result, part)
    if not order.json:
        say(lab_text(result))
    bias = _bias(order, result, scene)
    rows = _twins(result, scene) if scene else []
    if order.json:
        say(json_text(lab_data(result, rows, bias)))
    else:
        if bias and scene and order.test in CLOSED_FORM:
            say("\nThe bias of this formula is a closed form; it is shown as it is, and not simulated.")
        for text in filter(None, (bias and bias_text(bias), rows and twin_text(rows))):
            say(f"\n{text}")
        for path in filter(None, (order.out, order.figure, order.report)):
            say(f"\nwrote {path}")
    return all(row.closes is not False for row in rows)


def _template(order: LabOrder, say: Callable[[str], None]) -> None:
    """Write the empty sheet of a test into a file, or print it."""
    text = template_of(order.test)
    if order.out:
        write_whole(order.out, text)
    if order.json:
        say(json_text({"test": order.test, "template": text}))
    else:
        say(f"wrote {order.out}" if order.out else text.rstrip("\n"))


def _write(order: LabOrder, result: LabResult, part: dict[str, Any]) -> None:
    """Write the requested files."""
    about = made_today(order.author, order.notes)
    if order.figure or order.report:
        from explorer.report.bench import bench_record, bench_report, write_curves
        from explorer.report.folder import write_report

        found = bench_record(result, about, files_of(order))
        if order.figure:
            write_curves(order.figure, found)
        if order.report:
            with appearing(order.report, "--report") as folder:
                write_report(bench_report(found), folder, {found.NAME: json_text(found.to_dict()) + "\n"})
    if order.out:
        write_whole(order.out, part_file(result, part))


def part_file(result: LabResult, part: dict[str, Any]) -> str:
    """The text of PART.toml."""
    return part_text(part, f"{result.test}: measured, from {Path(result.file).name}. SI. Written by explorer lab.")


def analysed(order: LabOrder) -> LabResult:
    """The analysis of the readings that ``order`` names."""
    path = asset_path("laboratory", str(order.file))
    if order.test == "shear" and order.compression is not None:
        return analyse_elastic(path, asset_path("laboratory", order.compression))
    if order.test == "composition":
        return analyse_composition(path, order.left_out)
    return analyse(order.test, path)


def files_of(order: LabOrder) -> list[tuple[str, Path]]:
    """Test and file of every sheet of readings that ``order`` names."""
    files = [(order.test, order.file), ("compression", order.compression)]
    return [(test, asset_path("laboratory", name)) for test, name in files if name is not None]


def _check(order: LabOrder) -> None:
    """Refuse an order that cannot be carried out, before any work."""
    if order.template:
        _check_template(order)
        return
    if order.file is None and not order.bias:
        raise CommandError("FILE.csv is missing; without readings only --bias and --template are allowed")
    if order.file is None and any(
        (order.simulate, order.out, order.figure, order.report, order.compression, order.left_out)
    ):
        raise CommandError("--simulate, --out, --plot, --report, --compression and --leave-out need readings: FILE.csv")
    if order.compression is not None and order.test != "shear":
        raise CommandError("--compression: allowed only with the test shear; both moduli give Poisson's ratio")
    if order.left_out and order.test != "composition":
        raise CommandError("--leave-out: allowed only with the test composition")
    if order.figure and order.test not in ("compression", "shear"):
        raise CommandError("--plot: draws force–displacement curves; allowed only with compression and shear")
    if order.material is not None and not order.simulate:
        raise CommandError("--material: allowed only with --simulate")
    if order.bias:
        bias_table(order.test)  # refuses a test without one
    if order.simulate:
        check_twin(order.test)
    if order.out:
        check_new_file(order.out, ".toml")
    if order.figure:
        check_new_file(order.figure, ".html")
    if order.report:
        check_vacant(order.report, "--report")


def _check_template(order: LabOrder) -> None:
    """Check that nothing but the test is named: a template needs nothing else."""
    others = (order.file, order.compression, order.left_out, order.figure, order.report, order.material)
    if any(others) or order.simulate or order.bias:
        raise CommandError("--template: makes an empty sheet; allowed with it: --out FILE.csv, --json")
    if order.out:
        check_new_file(order.out, ".csv")


def _scene_with(part: dict[str, Any], order: LabOrder) -> Scene:
    """The material of the twins with the derived parameters."""
    name = order.material or DEFAULT_MATERIAL
    try:
        return with_part(material_scene(name), part)
    except ParameterError as error:
        raise CommandError(f"--simulate in material {name}: {error}") from None


def _twins(result: LabResult, scene: Scene) -> list[TwinRow]:
    # Importing this loads Taichi, which takes a second; nothing else here needs it.
    from explorer.laboratory.twin import twins

    return list(twins(result, scene))


def _bias(order: LabOrder, result: LabResult, scene: Scene | None) -> BiasTable | None:
    if not order.bias:
        return None
    if scene is None or order.test in CLOSED_FORM:
        return bias_table(order.test)
    from explorer.laboratory.twin import simulated_bias

    return simulated_bias(order.test, scene, result.derived[0].of)
