"""The report of a bench test: what was measured and how well, its curves and replicates, and the readings."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

from doe.laboratory import Derived, Estimate, LabResult, read_table
from doe.laboratory.analysis import TESTS
from doe.laboratory.elastic import SPECIMEN
from doe.laboratory.result import CONDITIONS
from doe.laboratory.tables import Column, Reading, by_replicate
from doe.provenance import About
from doe.record import Record
from explorer.errors import CommandError
from explorer.files.output_file import write_whole
from explorer.files.run_result import versions
from explorer.laboratory.twin_row import LIKE
from explorer.report.content import (
    Banner,
    Block,
    Bullets,
    DataTable,
    Facts,
    Figure,
    Report,
    Section,
    Strong,
    Table,
    Word,
)
from explorer.report.figures.bench import (
    bench_unit,
    curve_charts,
    curve_title,
    interval,
    is_straight,
    replicates,
    side_by_side_quantities,
    sieve_charts,
    specimen,
)
from explorer.report.html import page
from explorer.report.methods import bench_methods
from explorer.units import MISSING, enumeration, fixed, number

PARAMETERS = (
    "Lay the parameters over a material: `explorer lab … --out part.toml`, then `explorer new material NAME --part "
    "part.toml`."
)
TARGET = "A target, no parameter: parameters are found by it. Its like is simulated by {}."
DECISIVE = {"dimensions": "geometric_mean_diameter", "sieve": "d50", "drum": "dynamic_angle"}
"""Test → the quantity of its verdict, if not the first one."""
MOST_NAMED = 3
"""Results that a verdict names at most."""
MOST_ROWS = 40
"""Readings that the page shows at most; the data files have all."""


@dataclass(frozen=True)
class Readings(Record):
    """One file of readings as the test read them [SI]."""

    test: str
    file: str
    sha256: str
    rows: tuple[Reading, ...]


@dataclass(frozen=True)
class BenchResult(Record):
    """The content of ``bench.json``: the results of a test, and the readings behind them."""

    NAME: ClassVar[str] = "bench.json"

    result: LabResult
    about: About
    readings: tuple[Readings, ...] = ()
    versions: dict[str, str | None] = field(default_factory=dict)
    kind: str = "bench"


def bench_record(result: LabResult, about: About, files: Sequence[tuple[str, Path]]) -> BenchResult:
    """The record of ``result``; ``files``: test and file of the readings."""
    return BenchResult(result, about, tuple(_readings(test, path) for test, path in files), versions())


def _readings(test: str, path: Path) -> Readings:
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    return Readings(test, path.name, digest, read_table(path, TESTS[test].layout).rows)


def write_curves(path: Path, found: BenchResult) -> None:
    """Write the report of a test with curves as one page; raises CommandError without curves."""
    if not found.result.curves:
        raise CommandError("--plot: single readings only, no curve to draw")
    write_whole(path, page(bench_report(found)))


def bench_report(found: BenchResult) -> Report:
    """The report of a bench test: what was measured, by which formula, and the curves behind it."""
    result = found.result
    methods, references = bench_methods(result, found.versions)
    sections = [
        _parameters(result),
        Section("Curves", tuple(_curves(found))),
        Section("Replicates", tuple(_replicates(result))),
        Section("Readings", tuple(block for one in found.readings for block in _inputs(one))),
        methods,
    ]
    return Report(
        f"{result.test.replace('_', ' ').capitalize()}: {Path(result.file).name}",
        "Readings of a bench test and what follows from them",
        banner(result),
        tuple(section for section in sections if section.blocks),
        found.about,
        (_data(result), *map(_readings_data, found.readings)),
        references,
    )


def banner(result: LabResult) -> Banner:
    """The verdict: what was measured; a single replicate has no interval, so it does not count as measured."""
    found = [one for one in result.derived if one.name not in CONDITIONS]
    alone = [one for one in found if one.summary.n < 2]
    outliers = sum(len(one.summary.outliers) for one in found)
    if not found or len(alone) == len(found):
        kinds = enumeration([f"{one.name.replace('_', ' ')} {specimen(one)}".strip() for one in found])
        return Banner(
            Word.NO_ANSWER,
            "",
            f"One replicate of {kinds}: a value without a spread and without an interval.",
            "Repeat the test: five replicates give a useful interval.",
        )
    sizes = sorted({one.summary.n for one in found})
    n = f"{sizes[0]} replicates" if len(sizes) == 1 else f"{sizes[0]} replicates at least"
    kept = f"{outliers} readings are outliers" if outliers > 1 else "one reading is an outlier"
    odd = f"; {kept} at the 5 % level and kept" if outliers else ""
    errors = ", with the errors of the readings" if any(one.reading for one in found) else ""
    return Banner(
        Word.MEASURED,
        _results(result, found),
        f"{n} of every quantity; ±: 95 % of the mean, Student’s t{errors}{odd}.",
        TARGET.format(LIKE[result.test]) if result.test in LIKE else PARAMETERS,
    )


def _results(result: LabResult, found: list[Derived]) -> str:
    """The decisive results, each with its interval; a name shared by several is given once."""
    names = {one.name for one in found}
    wanted = DECISIVE.get(result.test, found[0].name)
    of: list[Derived | Estimate] = [one for one in found if one.name == (wanted if wanted in names else found[0].name)]
    of += [one for one in result.estimates if one.name == "poisson_ratio"]
    told, said = [], ""
    for one in of[:MOST_NAMED]:
        told.append(f"{'' if one.name == said else one.name.replace('_', ' ')} {specimen(one)} {_value(one)}".strip())
        said = one.name
    more = len(of) - MOST_NAMED
    return enumeration([*told, *([f"{more} more"] if more > 0 else [])])


def _value(one: Derived | Estimate) -> str:
    """Mean ± half its interval, to the second significant digit of the ±."""
    unit = bench_unit(one.unit)
    mean, half = interval(one) if isinstance(one, Derived) else (one.value, 0.5 * (one.high - one.low))
    mean, half = unit.of(mean), unit.of(half)
    if not 0.0 < half < math.inf:
        return unit.attach(number(mean, 4))
    decimals = max(0, 1 - math.floor(math.log10(half)))
    return unit.attach(f"{fixed(mean, decimals)} ± {fixed(half, decimals)}")


def _parameters(result: LabResult) -> Section:
    rows = []
    for one in result.derived:
        if one.name in CONDITIONS:
            continue
        unit, s = bench_unit(one.unit), one.summary
        mean, sd, low, high = (number(unit.of(value), 4) for value in (s.mean, s.sd, s.low, s.high))
        odd = enumeration([one.replicates[k] for k in s.outliers])
        rows.append(
            (
                specimen(one),
                one.name.replace("_", " "),
                Strong(unit.attach(mean)),
                sd,
                f"{low} … {high}",
                str(s.n),
                odd,
                one.formula,
            )
        )
    header = ("of", "quantity", "mean", "SD", "95 % of the mean", "n", "outliers", "formula")
    blocks: list[Block] = [Table(header, tuple(rows), "95 %: Student’s t. Outliers are kept.")]
    errors = [_with_errors(one) for one in result.derived if one.reading and one.name not in CONDITIONS]
    if errors:
        head = ("of", "quantity", "SD/√n", "u of the readings", "u of both", "95 % of the mean")
        blocks.append(Table(head, tuple(errors), "With the errors that the readings declare, by the GUM."))
    estimates = []
    for other in result.estimates:
        unit = bench_unit(other.unit)
        value, low, high = (number(unit.of(x), 4) for x in (other.value, other.low, other.high))
        estimates.append(
            (
                specimen(other),
                other.name.replace("_", " "),
                Strong(unit.attach(value)),
                f"{low} … {high}",
                other.formula,
            )
        )
    if estimates:
        blocks.append(Table(("of", "quantity", "value", "95 %", "formula"), tuple(estimates), "From several tests."))
    notes = dict.fromkeys([*(note for one in result.derived for note in one.notes), *result.notes])
    return Section("Parameters", (*blocks, *((Bullets(tuple(notes)),) if notes else ())))


def _with_errors(one: Derived) -> tuple[str, ...]:
    """What the declared errors of the readings add to a mean."""
    assert one.reading is not None
    unit, u = bench_unit(one.unit), one.reading
    found = [number(unit.of(x), 2) for x in (one.summary.standard_error, u.standard, u.combined)]
    low, high = (number(unit.of(x), 4) for x in (u.low, u.high))
    return (specimen(one), one.name.replace("_", " "), *found, unit.attach(f"{low} … {high}"))


def _curves(found: BenchResult) -> Iterator[Figure]:
    """Force over displacement, or the cumulative curve of a sieving, with the fit."""
    for k, (title, spec) in enumerate(curve_charts(found.result).items(), start=1):
        curves = [one for one in found.result.curves if curve_title(one) == title]
        points = sum(len(one.force) for one in curves)
        part = "the part taken as straight" if is_straight(curves[0]) else "Hertz’s law, up to yield"
        caption = f"{title.replace('_', ' ')}: n = {len(curves)} replicates, {points} points. Line: {part}."
        yield Figure(f"curves-{k}", spec, caption)
    for one in found.readings if found.result.test == "sieve" else ():
        for k, (name, spec) in enumerate(sieve_charts(one.rows).items(), start=1):
            n = len(by_replicate(row for row in one.rows if row.of[0] == name))
            caption = (
                f"{name.replace('_', ' ')}: n = {n} samples, the undersize at every sieve. Dashed: 1 − exp(−(x/x’)ⁿ)"
            )
            yield Figure(f"undersize-{k}", spec, f"{caption}, least squares.")


def _replicates(result: LabResult) -> Iterator[Figure]:
    for k, found in enumerate(side_by_side_quantities(result), start=1):
        own = [one for of in found.values() for one in of]
        sizes = sorted({one.summary.n for one in own})
        n = " … ".join(map(str, dict.fromkeys((sizes[0], sizes[-1]))))
        errors = ", with the errors of the readings" if any(one.reading for one in own) else ""
        tests = enumeration(sorted({one.summary.outlier_test for one in own}))
        caption = f"n = {n} replicates of each. Bar: 95 % of the mean by Student’s t{errors}. Outliers by {tests}, 5 %."
        yield Figure(f"replicates-{k}", replicates(found), caption)


def _inputs(found: Readings) -> Iterator[Block]:
    """The file, and a row for each reading, or for each replicate of a curve, with its declared ±."""
    yield Facts((("File", found.file), ("SHA-256", found.sha256)))
    layout = TESTS[found.test].layout
    present = {stem for row in found.rows for stem in row.values}
    columns = [one for one in layout.columns if one.stem in present]
    rows, header = found.rows, [" – ".join(layout.keys), "replicate"]
    counts: dict[tuple[tuple[str, ...], str], int] = {}
    for row in rows:
        counts[row.of, row.replicate] = counts.get((row.of, row.replicate), 0) + 1
    curves = found.test != "sieve" and any(count > 1 for count in counts.values())
    if curves:
        columns = [one for one in columns if one.stem in SPECIMEN]
        rows = tuple({(row.of, row.replicate): row for row in rows}.values())
    cells = [
        (
            "–".join(row.of).replace("_", " "),
            row.replicate,
            *(_cell(one, row) for one in columns),
            *([str(counts[row.of, row.replicate])] if curves else []),
        )
        for row in rows[:MOST_ROWS]
    ]
    header += [f"{one.stem.replace('_', ' ')}{_bracketed(one)}" for one in columns]
    caption = "±: as declared beside the reading." if any("±" in cell for row in cells for cell in row) else ""
    if not caption:
        caption = "No errors of the readings were declared." if layout.errors else ""
    if len(rows) > MOST_ROWS:
        caption += f" The first {MOST_ROWS} of {len(rows)}; all are in the data."
    yield Table((*header, *(["points"] if curves else [])), tuple(cells), caption.strip())


def _cell(column: Column, row: Reading) -> str:
    if column.stem not in row.values:
        return MISSING
    text = number(_in_sheet_unit(column, row.values[column.stem]), 6)
    error = row.values.get(column.error.stem)
    return text if error is None else f"{text} ± {number(_in_sheet_unit(column, error))}"


def _in_sheet_unit(column: Column, value: float) -> float:
    """Convert SI to the unit of the test's template, without rounding residue."""
    return float(f"{value / column.factor(column.sheet_name):.12g}")


def _bracketed(column: Column) -> str:
    unit = column.sheet_name.removeprefix(column.stem).removeprefix("_").replace("_", "/")
    for plain, symbol in (("deg", "°"), ("2", "²"), ("3", "³")):
        unit = unit.replace(plain, symbol)
    return f" [{unit}]" if unit else ""


def _data(result: LabResult) -> DataTable:
    """Every replicate, SI."""
    rows = tuple(
        ("-".join(one.of), one.name, replicate, value, one.unit, one.parameter)
        for one in result.derived
        for replicate, value in zip(one.replicates, one.values, strict=True)
    )
    return DataTable("replicates", ("of", "quantity", "replicate", "value", "unit", "parameter"), rows)


def _readings_data(found: Readings) -> DataTable:
    """Every reading in the units of its test's template, as `explorer lab` reads it."""
    layout = TESTS[found.test].layout
    present = {stem for row in found.rows for stem in row.values}
    pairs = [(one, stem) for one in layout.columns for stem in (one.stem, one.error.stem) if stem in present]
    names = [one.sheet_name.replace(one.stem, stem, 1) for one, stem in pairs]
    rows = tuple(
        (
            *row.of,
            row.replicate,
            *(_in_sheet_unit(one, row.values[stem]) if stem in row.values else None for one, stem in pairs),
        )
        for row in found.rows
    )
    return DataTable(f"readings_{found.test}", (*layout.keys, "replicate", *names), rows)
