"""A folder with study.toml and CSV files → `doe.audit.PublishedStudy`. The format: doe/audit/README.md.

study.toml declares the target, single claims, and the stages of a calibration: screening, ascent, surface, optimum,
verification. The CSV files hold text as printed, with file, line and column for whoever has to mend it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from doe.analysis.surface import term_names
from doe.audit import Printed, PublishedStudy, printed, printed_or_none
from doe.audit.anova_table import source_name
from doe.audit.restitution_formula import names_in
from doe.audit.study import (
    AnovaLine,
    Ascent,
    Derived,
    DesignSteps,
    DropTest,
    Equation,
    Measured,
    Optimum,
    Quote,
    ScreenedFactor,
    Screening,
    SurfaceStudy,
    Target,
    Total,
    Verified,
)
from doe.audit.surface_refit import STATISTICS
from doe.errors import AuditError
from doe.table_file import read_table as read_cells
from explorer.audit.entries import TableEntries, read_entries
from solver.assets import asset_path

FloatArray = npt.NDArray[np.float64]
Part = TypeVar("Part")

MOST_BYTES = 2_000_000
"""Bytes of one file; published tables hold thousands."""
MOST_FACTORS = 8
"""Of a second-order surface: 45 terms."""
ANOVA_COLUMNS = {
    "source": ("source", "sourceofvariation", "effect", "factor", "term", "terms", "regression"),
    "sum_of_squares": (
        *("sumofsquares", "sumsq", "ss", "adjss", "sumsquares", "partialss", "typeiss", "typeiiss", "typeiiiss"),
        *("typeisumofsquares", "typeiisumofsquares", "typeiiisumofsquares", "seqss"),
    ),
    "sequential": ("seqss", "sequentialss"),
    "df": ("df", "dof", "degreesoffreedom"),
    "mean_square": ("meansquare", "meansq", "ms", "adjms"),
    "f": ("fvalue", "f", "fratio"),
    "p": ("pvalue", "p", "prf", "probf", "pvalueprobf", "sig"),
}
"""Figure → the columns in which programs print it, by their letters alone ("Pr(>F)": "prf"), the first one found."""
NO_FIGURE = ("", "*", "-", "–", "—", "NA", "NaN")
"""What stands in a cell that has none."""
FORMAT = 1


def shipped_study() -> Path:
    """Folder of the article that is shipped."""
    return asset_path("source_tables", "table1_physical").parent


def read_study(folder: Path) -> PublishedStudy:
    """The study in ``folder``. Raises AuditError with one line that names file, key or line, and what is allowed."""
    if not folder.is_dir():
        raise AuditError(f"{folder}: no such folder")
    try:
        return _study(read_entries(folder), folder)
    except AuditError as error:
        text = str(error)
        raise AuditError(text if text.startswith(str(folder)) else f"{folder}/{text}") from None


def _study(entries: TableEntries, folder: Path) -> PublishedStudy:
    if entries.whole("format", 0) != FORMAT:
        raise entries.error("format", f"this program reads format {FORMAT}")

    def optional(key: str, read: Callable[[TableEntries, Path], Part]) -> Part | None:
        return _finished(read, entries.table(key), folder) if key in entries else None

    ascent = optional("ascent", read_ascent)
    surface = partial(read_surface, ascent=ascent)
    surfaces = tuple(_finished(surface, one, folder) for one in entries.tables("surface"))
    study = PublishedStudy(
        title=entries.text("title"),
        source=entries.text("source", " ").strip(),
        target=optional("target", _target),
        derived=tuple(_finished(_derived, one, folder) for one in entries.tables("derived")),
        measured=tuple(part for one in entries.tables("measured") for part in _finished(_measured, one, folder)),
        totals=tuple(_finished(_total, one, folder) for one in entries.tables("total")),
        quotes=tuple(_finished(_quote, one, folder) for one in entries.tables("quoted")),
        drop_test=optional("drop_test", _drop_test),
        screening=optional("screening", read_screening),
        ascent=ascent,
        surfaces=surfaces,
        optimum=read_optimum(entries.table("optimum"), surfaces) if "optimum" in entries else None,
        verified=optional("verification", read_verified),
    )
    entries.finish()
    return study


def _finished(read: Callable[[TableEntries, Path], Part], entries: TableEntries, folder: Path) -> Part:
    part = read(entries, folder)
    entries.finish()
    return part


def _target(entries: TableEntries, folder: Path) -> Target:
    mean = entries.figure("mean")
    if mean.value == 0:
        raise entries.error("mean", "0 is not allowed: relative errors are divided by it")
    replicates = None
    if "file" in entries:
        replicates = read_table(folder, entries.text("file")).numbers(entries.text("column"))
    return Target(
        where=entries.text("where", "text"),
        quantity=entries.text("quantity"),
        unit=entries.text("unit", "1"),
        mean=mean,
        sd=entries.figure_or_none("sd"),
        n=entries.whole("n", 1) if "n" in entries else None,
        replicates=replicates,
    )


def _derived(entries: TableEntries, folder: Path) -> Derived:
    table = read_table(folder, entries.text("file"))
    column, formula = entries.text("column"), entries.text("formula")
    names = names_in(formula)
    return Derived(
        where=entries.text("where"),
        quantity=entries.text("quantity", column),
        formula=formula,
        rows=_labels(table, entries),
        printed=table.numbers(column),
        inputs=tuple({name: table.number(name, row) for name in names} for row in range(table.rows)),
    )


def _measured(entries: TableEntries, folder: Path) -> tuple[Measured, ...]:
    table, where, made_from = read_table(folder, entries.text("file")), entries.text("where"), entries.text("made_from")
    labels, parts = _labels(table, entries), []
    single = read_table(folder, entries.text("replicates")) if "replicates" in entries else None
    key = entries.text("label", next(iter(table.columns)))
    for column in entries.texts("columns"):
        cells = [(label, table.number_or_none(column, row)) for row, label in enumerate(labels)]
        table.texts(column)
        there = [(label, cell) for label, cell in cells if cell is not None]
        runs = None if single is None else tuple(_of_label(single, key, label, column) for label, _ in there)
        rows, prints = tuple(label for label, _ in there), tuple(cell for _, cell in there)
        parts.append(Measured(where, column.replace("_", " "), made_from, rows, prints, runs))
    return tuple(parts)


def _of_label(table: PrintedTable, key: str, label: str, column: str) -> tuple[Printed, ...]:
    """All cells of a column in the rows of one label; AuditError where there is none."""
    rows = [row for row, name in enumerate(table.texts(key)) if name == label]
    if not rows:
        raise AuditError(f"{table.name}: no row with {key} = {label!r}")
    return tuple(table.number(column, row) for row in rows)


def _total(entries: TableEntries, folder: Path) -> Total:
    table = read_table(folder, entries.text("file"))
    column = entries.text("column")
    return Total(
        entries.text("where"), entries.text("quantity", column), table.numbers(column), entries.figure("total")
    )


def _quote(entries: TableEntries, folder: Path) -> Quote:
    quantity, value = entries.text("quantity"), entries.figure("value")
    where, said, text = entries.text("where"), entries.text("table"), entries.text("text", " ").strip()
    if "file" not in entries:
        return Quote(where, quantity, value, None, said, text)
    table, column = read_table(folder, entries.text("file")), entries.text("column")
    among = table.numbers(column)
    original, elsewhere = None, places(table, value)
    if "row" in entries:
        row = entries.table("row")
        wanted = {key: row.text(key) for key in row.names()}
        found = [k for k in range(table.rows) if all(table.texts(key)[k] == text for key, text in wanted.items())]
        if len(found) != 1:
            raise entries.error("row", f"{len(found)} rows of {table.name} fit; exactly one is needed")
        original = among[found[0]]
    return Quote(where, quantity, value, original, said, text, column, among, elsewhere)


def _drop_test(entries: TableEntries, folder: Path) -> DropTest:
    table, formula = read_table(folder, entries.text("file")), entries.text("formula")
    unknown = set(names_in(formula)) - set("LHhvtg") - {"vx", "vy"}
    if unknown:
        raise entries.error("formula", f"{sorted(unknown)[0]!r} is not known; allowed: L, H, h, v, vx, vy, t, g")
    restitutions = table.numbers(entries.text("column"))
    wrong = [one.text for one in restitutions if not 0 <= one.value <= 1]
    if wrong:
        raise entries.error("column", f"a restitution of {wrong[0]} is not allowed; allowed: 0 … 1")
    return DropTest(
        where=entries.text("where"),
        formula=formula,
        plate_angle_deg=entries.number("plate_angle_deg", 0.0, 89.0),
        fall=entries.number("fall", 0.0, 100.0),
        landing=entries.number("landing", 0.0, 100.0) if "landing" in entries else None,
        restitutions=restitutions,
    )


def _labels(table: PrintedTable, entries: TableEntries) -> tuple[str, ...]:
    """Names of the rows: cells of the column `label`, or of the first one."""
    return table.texts(entries.text("label", next(iter(table.columns))))


def read_screening(entries: TableEntries, folder: Path) -> Screening:
    """``[screening]``: its factors (factor, low, high) and ANOVA (factor, sum_of_squares, f_value, p_value)."""
    runs = read_table(folder, entries.text("runs"))
    factors, anova = read_table(folder, entries.text("factors")), read_table(folder, entries.text("anova"))
    names = factors.texts("factor")
    if anova.texts("factor") != names:
        raise AuditError(f"{anova.name}: its factors differ from those of {factors.name}, or are in another order")
    design = _numbers(runs, names) if entries.flag("design", False) else None
    ranges = tuple(
        ScreenedFactor(name, factors.number("low", k).value, factors.number("high", k).value)
        for k, name in enumerate(names)
    )
    for row, one in enumerate(ranges):
        if not one.low < one.high:
            raise AuditError(f"{factors.name}, line {factors.lines[row]}: low must be below high")
    level = entries.number("level", 0.0, 1.0) if "level" in entries else 0.05
    significant = entries.texts("significant") if "significant" in entries else None
    unknown = [name for name in significant or () if name not in names]
    if unknown:
        raise entries.error("significant", f"{unknown[0]!r} is not one of {', '.join(names)}")
    if runs.rows <= len(names):
        raise AuditError(
            f"{runs.name}: {runs.rows} runs are too few for {len(names)} factors; allowed: at least {len(names) + 1}"
        )
    return Screening(
        where_runs=entries.text("where_runs"),
        where_anova=entries.text("where_anova"),
        factors=ranges,
        responses=runs.numbers(entries.text("response")),
        design=design,
        error_df=entries.whole("error_df", 1),
        sums=anova.numbers("sum_of_squares"),
        f=anova.numbers("f_value") if "f_value" in anova.columns else (),
        p=anova.numbers("p_value") if "p_value" in anova.columns else (),
        total=entries.figure_or_none("total"),
        significant=significant,
        level=level,
        level_of_others=entries.number("level_of_others", 0.0, 1.0) if "level_of_others" in entries else level,
    )


def read_ascent(entries: TableEntries, folder: Path) -> Ascent:
    """``[ascent]`` with ``[ascent.factors]``: name in the screening → column of its settings."""
    table, columns = read_table(folder, entries.text("file")), entries.table("factors")
    names = columns.names()
    if not names:
        raise entries.error("factors", "at least one is needed")
    steps = table.texts(entries.text("step"))
    best = entries.text("best") if "best" in entries else None
    if best is not None and best not in steps:
        raise entries.error("best", f"{best!r} is not one of {', '.join(steps)}")
    return Ascent(
        where=entries.text("where"),
        factors=names,
        steps=steps,
        settings=_numbers(table, tuple(columns.text(name) for name in names)),
        responses=table.numbers(entries.text("response")),
        errors=table.numbers(entries.text("error")) if "error" in entries else (),
        best=best,
    )


def read_surface(entries: TableEntries, folder: Path, ascent: Ascent | None) -> SurfaceStudy:
    """``[surface]`` with ``[[surface.factor]]``, ``[surface.statistics]`` and ``[surface.equation]``; ``ascent`` is the
    walk that its levels may be said to be steps of. Without ``runs`` its figures are held against one another only."""
    runs = read_table(folder, entries.text("runs")) if "runs" in entries else None
    anova = read_table(folder, entries.text("anova"))
    factors = entries.tables("factor")
    if not (0 if runs is None else 1) <= len(factors) <= MOST_FACTORS:
        raise entries.error("factor", f"{len(factors)} factors; allowed: 1 … {MOST_FACTORS}")
    names = tuple(one.text("name") for one in factors)
    if len(set(names)) < len(names):
        raise entries.error("factor", f"names must differ: {', '.join(names)}")
    low = np.array([one.number("low") for one in factors])
    high = np.array([one.number("high") for one in factors])
    if not (low < high).all():
        raise entries.error("factor", "low must be below high")
    columns = tuple(one.text("column", None if runs is not None else " ") for one in factors)
    levels = np.empty((0, len(factors))) if runs is None else _numbers(runs, columns)
    screened = tuple(one.text("screened", name) for one, name in zip(factors, names, strict=True))
    for one in factors:
        one.finish()
    coded = levels if entries.flag("coded", True) else (2 * levels - low - high) / (high - low)
    where_runs = entries.text("where_runs", None if runs is not None else " ").strip()
    where_anova = entries.text("where_anova")
    given = entries.table("statistics") if "statistics" in entries else None
    statistics = {} if given is None else {key: given.figure(key) for key in STATISTICS if key in given}
    if given is not None:
        given.finish()
    return SurfaceStudy(
        where_runs=where_runs,
        where_anova=where_anova,
        where_statistics=entries.text("where_statistics", where_anova),
        factors=names,
        screened=screened,
        low=low,
        high=high,
        coded=coded,
        responses=runs.numbers(entries.text("response")) if runs is not None else (),
        anova=_anova_lines(anova),
        statistics=statistics,
        equation=_equation(entries.table("equation"), names) if "equation" in entries else None,
        steps=_steps(entries.table("steps"), ascent) if "steps" in entries else None,
    )


def _steps(entries: TableEntries, ascent: Ascent | None) -> DesignSteps:
    found = {}
    for key in ("low", "centre", "high"):
        found[key] = entries.text(key)
        if ascent is None or found[key] not in ascent.steps:
            known = "there is no [ascent]" if ascent is None else f"allowed: {', '.join(ascent.steps)}"
            raise entries.error(key, f"{found[key]!r} is not a step of the ascent; {known}")
    entries.finish()
    return DesignSteps(**found)


def _anova_lines(table: PrintedTable) -> tuple[AnovaLine, ...]:
    plain = {"".join(filter(str.isalnum, column.lower())): column for column in reversed([*table.columns])}
    found: dict[str, str] = {}
    for figure, names in ANOVA_COLUMNS.items():
        column = next((plain[name] for name in names if name in plain), None)
        # "Seq SS" is the sum of squares where no other stands beside it.
        if column is not None and column not in found.values():
            found[figure] = column
    sources = table.texts(found.pop("source", "source"))
    return tuple(
        AnovaLine(source, **{figure: table.number_or_none(column, row) for figure, column in found.items()})
        for row, source in enumerate(sources)
    )


def _equation(entries: TableEntries, factors: tuple[str, ...]) -> Equation:
    units = entries.text("units")
    if units not in ("coded", "natural"):
        raise entries.error("units", f"{units!r} is not one of coded, natural")
    terms, known = entries.table("terms"), ("1", *term_names(factors)[1:])
    coefficients = {}
    for key in terms.names():
        name = key if key == "1" else source_name(key, factors)
        if name not in known:
            raise terms.error(key, f"is not one of {', '.join(known)}")
        coefficients[name] = terms.figure(key)
    equation = Equation(entries.text("where"), units == "coded", coefficients)
    entries.finish()
    return equation


def read_optimum(entries: TableEntries, surfaces: tuple[SurfaceStudy, ...]) -> Optimum:
    """``[optimum]`` with ``values``: factor of the surface → its value, natural unit. Of several surfaces ``surface``
    says which one, by its ``where_anova``."""
    if not surfaces:
        raise entries.error("values", "there is no [surface] for this optimum")
    places = [surface.where_anova for surface in surfaces]
    where = entries.text("surface", None if len(places) > 1 else places[0])
    if where not in places:
        raise entries.error("surface", f"{where!r} is not one of {', '.join(places)}")
    values, position = entries.table("values"), places.index(where)
    found = Optimum(
        where=entries.text("where"),
        values=tuple(values.figure(name) for name in surfaces[position].factors),
        predicted=entries.figure_or_none("predicted"),
        surface=position,
    )
    values.finish()
    entries.finish()
    return found


def read_verified(entries: TableEntries, folder: Path) -> Verified:
    """``[verification]``."""
    table = read_table(folder, entries.text("file"))
    return Verified(
        where=entries.text("where"),
        responses=table.numbers(entries.text("response")),
        mean=entries.figure_or_none("mean"),
        relative_error_percent=entries.figure_or_none("relative_error_percent"),
        p_two_sample=entries.figure_or_none("p_two_sample"),
    )


def _numbers(table: PrintedTable, columns: tuple[str, ...]) -> FloatArray:
    """Columns as values, shape (rows, columns)."""
    return np.array([[cell.value for cell in table.numbers(column)] for column in columns]).T


@dataclass(frozen=True)
class PrintedTable:
    """A table as text: column → cells; ``lines`` are the line numbers of its rows."""

    name: str
    columns: Mapping[str, tuple[str, ...]]
    lines: tuple[int, ...]

    @property
    def rows(self) -> int:
        """Number of rows."""
        return len(self.lines)

    def texts(self, column: str) -> tuple[str, ...]:
        """Cells of a column; AuditError where there is none of that name."""
        if column not in self.columns:
            raise AuditError(f"{self.name}: no column {column!r}; it has {', '.join(self.columns)}")
        return self.columns[column]

    def numbers(self, column: str) -> tuple[Printed, ...]:
        """A column in which every cell is a number."""
        return tuple(self.number(column, row) for row in range(self.rows))

    def number(self, column: str, row: int) -> Printed:
        """One cell; AuditError names file, line and column where it is no number."""
        try:
            return printed(self.texts(column)[row])
        except AuditError as error:
            raise AuditError(f"{self.name}, line {self.lines[row]}, {column}: {error}") from None

    def number_or_none(self, column: str, row: int) -> Printed | None:
        """One cell, None where no figure stands in it or the column is not there."""
        cells = self.columns.get(column)
        return None if cells is None or cells[row] in NO_FIGURE else self.number(column, row)


def read_table(folder: Path, name: str) -> PrintedTable:
    """A CSV file of a study's folder. Raises AuditError for what is not one, OSError for what cannot be opened."""
    if Path(name).name != name or not name:
        raise AuditError(f"{name!r} is not the name of a file beside study.toml")
    path = folder / name
    table = read_cells(path, MOST_BYTES, AuditError)
    if len(table.rows) < 2:
        raise AuditError(f"{path}: a line of column names and at least one row are needed")
    (_, header), *rows = table.rows
    if len(set(header)) < len(header) or "" in header:
        raise AuditError(f"{path}: every column needs a name of its own: {', '.join(header)}")
    for number, row in rows:
        if len(row) != len(header):
            raise AuditError(f"{path}, line {number}: {len(row)} cells; the table has {len(header)} columns")
    # Numbers as printed, but with a point: everything behind reads their digits. Words keep their commas.
    cells = zip(
        *([plain if printed_or_none(plain := table.plain(cell)) else cell for cell in row] for _, row in rows),
        strict=True,
    )
    columns = dict(zip(header, cells, strict=True))
    return PrintedTable(name, columns, tuple(number for number, _ in rows))


def places(table: PrintedTable, value: Printed) -> tuple[str, ...]:
    """Where the table prints ``value``, in words: "restitution of petiole–petiole"; a row is named by its words."""
    found = []
    for row in range(table.rows):
        cells = {column: texts[row] for column, texts in table.columns.items()}
        numbers = {column: printed_or_none(text) for column, text in cells.items()}
        name = "–".join(text for column, text in cells.items() if text and numbers[column] is None) or f"row {row + 1}"
        like = [c for c, number in numbers.items() if number and not number.bound and value.agrees(number.value)]
        found += [f"{column} of {name}" for column in like]
    return tuple(found)
