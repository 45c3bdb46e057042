"""Results of the laboratory's commands for the page: the terminal's text, the line that repeats it, charts and files.

Each function does what the command of its name does, and none of them depends on the page. Whatever needs the solver (a
simulated bench test, a pour beside a photograph) runs as a command in a child process: the page's own process never
loads the solver.
"""

from __future__ import annotations

import io
import json
import shlex
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

from doe.audit import audit_study
from doe.laboratory.analysis import template_of
from doe.table_file import WORKBOOK
from doe.target import Target
from explorer.audit.read_study import read_study, shipped_study
from explorer.audit.report import audit_html, audit_text
from explorer.background.command_output import command_output, kept_scene
from explorer.design.analysis import AnalyseOrder, run_analyse
from explorer.design.choices import Alpha
from explorer.design.factors_file import read_factors
from explorer.design.run_plan import DesignOrder, make_plan, sheet_content
from explorer.design.text import analysis_text, check_power, plan_text
from explorer.files.run_folder import json_text
from explorer.files.run_result import BenchTestResult, made_today
from explorer.laboratory.part import part_table
from explorer.laboratory.run import LabOrder, analysed, files_of, part_file
from explorer.measured.folder import NewCondition, write_condition, written_text
from explorer.measured.readings import Brought
from explorer.photograph.marks import UNMARKED, Marks
from explorer.photograph.result import MeasuredPhotographs
from explorer.photograph.run import MeasureOrder, drawn_sheet, measure_order, outline_text, run_measure
from explorer.photograph.simulated import SimulatedViews
from explorer.photograph.target import PhotographedTarget, check_targets, keep_target
from explorer.report.bench import bench_record, bench_report
from explorer.report.design import design_html
from explorer.report.design.charts import design_plots
from explorer.report.figures.bench import bench_charts, curve_charts
from explorer.report.html import page
from explorer.report.study_charts import Plot, Plots
from explorer.scene.source import command_line, rig_source
from explorer.terminal.laboratory import lab_text
from explorer.terminal.photograph import NOTE, Rows, measure_tables
from explorer.terminal.pours import bench_text
from solver import Scene, read_toml, with_values
from solver.assets import asset_path, photograph_scales, shipped_assets

PART = "Points of every replicate; the line is the part that the modulus is taken from, drawn on to zero force."
ON_THE_SOLVER = "What the solver's own instrument read in the course of the test."
PLOT = "beside.png"
"""Name of the picture that shows the photograph beside the pour."""


@dataclass(frozen=True)
class CommandResult:
    """The result of a command.

    ``text``: as on the terminal; empty if ``tables`` (caption → rows) replace it, with ``note`` below them. ``files``:
    name → content, to download. ``picture``: RGB, (height, width, 3), if there is one.
    """

    text: str
    command: str
    plots: Plots = field(default_factory=dict)
    files: Mapping[str, bytes] = field(default_factory=dict)
    picture: npt.NDArray[np.uint8] | None = None
    tables: Mapping[str, Rows] = field(default_factory=dict)
    note: str = ""


@dataclass(frozen=True)
class Ruler:
    """The scale of a photograph: mm per pixel, or mm of the one straight bar in it; with neither, lengths are in px."""

    scale_mm: float | None = None
    reference_mm: float | None = None

    @property
    def known(self) -> bool:
        """Whether lengths are in millimetres."""
        return self.scale_mm is not None or self.reference_mm is not None


@dataclass(frozen=True, eq=False)
class PhotographReading:
    """What was read off one photograph: this one reading is both shown and kept as a target."""

    photo: str
    """A file, or the name of a shipped photograph."""
    ruler: Ruler
    checkerboard: str | None
    """File with a picture of a checkerboard by the same camera; None: the base line determines the lens."""
    order: MeasureOrder
    measured: MeasuredPhotographs
    marks: Marks = UNMARKED


def example_rulers() -> dict[str, Ruler]:
    """The scales of the shipped photographs, by name."""
    return {name: Ruler(**known) for name, known in read_toml(photograph_scales()).items()}


def bench_result(order: LabOrder) -> CommandResult:
    """`explorer lab`: readings → parameters."""
    result = analysed(order)
    plots: Plots = {title: Plot(partial(dict, spec), PART) for title, spec in curve_charts(result).items()}
    files = {
        f"{order.test}.toml": part_file(result, part_table(result)).encode(),
        "report.html": page(bench_report(bench_record(result, made_today("", ""), files_of(order)))).encode(),
    }
    return CommandResult(lab_text(result), shlex.join(["explorer", *lab_words(order)]), plots, files)


def twin_result(order: LabOrder) -> CommandResult:
    """`explorer lab --simulate` and `--bias`: what the readings give, and what the test gives on the solver."""
    words = lab_words(order)
    said = command_output(words)
    return replace(bench_result(order), text=said, command=shlex.join(["explorer", *words]))


def template_file(test: str) -> tuple[str, bytes]:
    """`explorer lab TEST --template`: the name of the sheet and its content."""
    return f"{test}_sheet.csv", template_of(test).encode()


def examples_of(test: str) -> tuple[str, ...]:
    """Names of the shipped readings of a test: its own first, then others."""
    return tuple(name for name in shipped_assets("laboratory") if name == test or name.startswith(f"{test}_"))


def lab_words(order: LabOrder) -> list[str]:
    """The command line of ``order``, without the program's name."""
    words = ["lab", order.test, str(order.file)]
    words += ["--compression", order.compression] if order.compression else []
    words += [word for name in order.left_out for word in ("--leave-out", name)]
    words += ["--simulate"] if order.simulate else []
    words += ["--material", order.material] if order.material else []
    return [*words, "--bias"] if order.bias else words


def rig_result(scene: Scene, rig: str, values: Mapping[str, float | str], seed: int, folder: Path) -> CommandResult:
    """`explorer simulate RIG`: a bench test of one body of ``scene``, which is kept as a file in ``folder``.

    ``values``: path → value (SI) of the rig's own parameters. Raises ParameterError before anything runs.
    """
    source = rig_source(rig, str(kept_scene(scene, folder)))
    line = command_line(source, with_values(source.scene, dict(values)), seed)
    printed = command_output([*shlex.split(line)[1:], "--json"])
    result = BenchTestResult.from_dict(json.loads(printed))
    plots: Plots = {title: Plot(partial(dict, spec), ON_THE_SOLVER) for title, spec in bench_charts(result).items()}
    files = {f"{rig}.json": f"{json_text(result.to_dict())}\n".encode()}
    return CommandResult(bench_text(result), line, plots, files)


def photograph_reading(
    photo: str, ruler: Ruler, checkerboard: str | None = None, marks: Marks = UNMARKED
) -> PhotographReading:
    """The reading of ``photo`` (file or shipped name), with the lens taken from the picture ``checkerboard``.

    ``marks``: what a person marked in the photograph; a length between two marks replaces ``ruler``.

    Raises CommandError, or PhotographError if a file is not a picture or shows no checkerboard.
    """
    if marks.length_mm is not None:
        ruler = Ruler(reference_mm=marks.length_mm)
    lengths = (ruler.scale_mm, ruler.reference_mm, marks.ends_text)
    order = measure_order([photo], *lengths, marks.base_line_text, None, None, None, checkerboard)
    return PhotographReading(photo, ruler, checkerboard, order, run_measure(order), marks)


def photograph_result(read: PhotographReading) -> CommandResult:
    """`explorer measure`: the angle of repose on a photograph, or why there is none."""
    order, measured = read.order, read.measured
    words = ["explorer", *measure_words(read)]
    drawn = drawn_sheet(order, measured)
    file = io.BytesIO()
    drawn.save(file, "PNG")
    stem = order.pictures[0].stem
    files = {f"{stem}_read.png": file.getvalue()}
    if measured.piles and read.ruler.known:
        files[f"{stem}_outline.csv"] = outline_text(measured.piles[0]).encode()
    picture = np.asarray(drawn, dtype=np.uint8)
    return CommandResult("", shlex.join(words), {}, files, picture, measure_tables(measured), NOTE)


def compared_result(read: PhotographReading, scene: Scene, folder: Path) -> CommandResult:
    """`explorer measure --from-simulation`: the photograph beside a pour of ``scene`` that the same fit reads."""
    words = [*measure_words(read), "--from-simulation", str(kept_scene(scene, folder))]
    with tempfile.TemporaryDirectory() as apart:
        drawn = Path(apart) / PLOT
        data = json.loads(command_output([*words, "--plot", str(drawn), "--json"]))
        content = drawn.read_bytes()
        with Image.open(drawn) as picture:
            pixels = np.asarray(picture.convert("RGB"), dtype=np.uint8)
    tables = measure_tables(read.measured, SimulatedViews.from_dict(data["simulation"]))
    return CommandResult("", shlex.join(["explorer", *words]), {}, {PLOT: content}, pixels, tables, NOTE)


def measured_target(read: PhotographReading, folder: Path, targets: Sequence[Target], anew: bool) -> PhotographedTarget:
    """`explorer measure --target`: keep the photograph in ``folder`` as a target of the study with ``targets``.

    ``anew``: replace what is kept there instead of adding to it. If it raises CommandError, nothing has changed.
    """
    check_targets(targets)
    return keep_target(folder, read.order.pictures, read.measured, anew)


def measure_words(read: PhotographReading) -> list[str]:
    """The command line that repeats the reading ``read``, without the program's name."""
    words = ["measure", read.photo]
    for option, length in (("--scale", read.ruler.scale_mm), ("--reference-length", read.ruler.reference_mm)):
        words += [] if length is None else [option, f"{length:g}"]
    words += read.marks.words
    return words if read.checkerboard is None else [*words, "--checkerboard", read.checkerboard]


def measured_data_result(folder: Path, asked: NewCondition, brought: Brought) -> CommandResult:
    """`explorer new measurement`: write the condition ``asked`` into ``folder``; returns what the data can show.

    Raises what :func:`explorer.measured.folder.write_condition` raises; nothing has changed then.
    """
    words = ["explorer", *measured_data_words(folder, asked, brought)]
    found = write_condition(folder, asked, brought)
    return CommandResult(written_text(found), shlex.join(words), note=f"In the list of Diagnose: {folder.name}.")


def measured_data_words(folder: Path, asked: NewCondition, brought: Brought) -> list[str]:
    """The command line that does the same with the same files, without the program's name."""
    words = ["new", "measurement", folder.name, "--out", str(folder.parent), "--condition", asked.name]
    for option, given in (
        ("--study", [asked.study]),
        ("--material", [asked.material]),
        ("--set", asked.settings),
        ("--uncertainty", asked.uncertainty),
        ("--photo", brought.photographs),
        ("--scale", [None if brought.pixel is None else f"{1e3 * brought.pixel:g}"]),
        ("--angles", [brought.angles]),
        ("--balance", brought.balances),
        ("--starts", brought.starts),
        ("--lag", [brought.lag]),
        ("--scan", brought.scans),
        ("--scan-unit", [brought.scan_unit] if brought.scans else []),
        ("--drum", [brought.drum]),
    ):
        words += [word for one in given if one is not None for word in (option, str(one))]
    return words


@dataclass(frozen=True)
class SheetOrder:
    """Options of `explorer design` besides the design: factors file, the effect it should detect, kind of file."""

    factors: str
    sigma: float | None = None
    """Standard deviation of one run."""
    effect: float | None = None
    """Change that the design should detect."""
    workbook: bool = False
    decimal_comma: bool = False


def sheet_result(order: DesignOrder, asked: SheetOrder) -> CommandResult:
    """`explorer design`: the runs of a design as a sheet to fill in."""
    check_power(order.design, asked.sigma, asked.effect)
    file = read_factors(asset_path("designs", asked.factors))
    plan = make_plan(order, file)
    name = f"runs{WORKBOOK if asked.workbook else '.csv'}"
    words = ["explorer", "design", order.design, "--factors", asked.factors, "--out", name]
    options: dict[str, Any] = {
        "--runs": order.runs,
        "--replicates": order.replicates,
        "--centre": order.centre,
        "--blocks": order.blocks,
        "--fraction": order.fraction or None,
        "--lattice": order.lattice,
        "--alpha": None if order.alpha == Alpha.ROTATABLE else order.alpha,
        "--model": order.model,
        "--augment": order.augment,
        "--seed": order.seed,
        "--sigma": asked.sigma,
        "--effect": asked.effect,
    }
    words += [word for option, value in options.items() if value is not None for word in (option, str(value))]
    words += [word for generator in order.generators for word in ("--generator", generator)]
    words += [word for constraint in order.constraints for word in ("--constraint", constraint)]
    flags = {
        "--fold": order.fold,
        "--nonregular": order.nonregular,
        "--standard-order": order.standard_order,
        "--decimal-comma": asked.decimal_comma,
    }
    words += [flag for flag, given in flags.items() if given]
    return CommandResult(
        plan_text(plan, file, asked.sigma, asked.effect),
        shlex.join(words),
        {},
        {name: sheet_content(plan, file, asked.workbook, asked.decimal_comma)},
    )


def analysis_result(order: AnalyseOrder) -> CommandResult:
    """`explorer analyse`: the analysis of a filled sheet."""
    result = run_analyse(order)
    files = {"report.html": design_html(result).encode()}
    return CommandResult(analysis_text(result), shlex.join(result.command), design_plots(result), files)


def audit_result(folder: Path | None) -> CommandResult:
    """`explorer audit`: a published study recomputed from its own tables; None for the shipped article."""
    found = audit_study(read_study(folder or shipped_study()))
    words = ["explorer", "audit", *([str(folder)] if folder else [])]
    return CommandResult(audit_text(found), shlex.join(words), {}, {"audit.html": audit_html(found).encode()})
