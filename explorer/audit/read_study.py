"""A folder with study.toml and CSV files → `doe.audit.PublishedStudy`. The format: doe/audit/README.md."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TypeVar

from doe.audit import Printed, PublishedStudy
from doe.audit.restitution_formula import names_in
from doe.audit.study import Derived, DropTest, Measured, Quote, Target, Total
from doe.errors import AuditError
from explorer.audit.entries import Entries, read_entries
from explorer.audit.read_stages import read_ascent, read_optimum, read_screening, read_surface, read_verified
from explorer.audit.tables import Table, places, read_table
from solver.assets import asset_path

FORMAT = 1
Part = TypeVar("Part")


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


def _study(entries: Entries, folder: Path) -> PublishedStudy:
    if entries.whole("format", 0) != FORMAT:
        raise entries.error("format", f"this program reads format {FORMAT}")

    def optional(key: str, read: Callable[[Entries, Path], Part]) -> Part | None:
        return _finished(read, entries.table(key), folder) if key in entries else None

    ascent = optional("ascent", read_ascent)
    surface = optional("surface", partial(read_surface, ascent=ascent))
    study = PublishedStudy(
        title=entries.text("title"),
        source=entries.text("source", " ").strip(),
        target=_finished(_target, entries.table("target"), folder),
        derived=tuple(_finished(_derived, one, folder) for one in entries.tables("derived")),
        measured=tuple(part for one in entries.tables("measured") for part in _finished(_measured, one, folder)),
        totals=tuple(_finished(_total, one, folder) for one in entries.tables("total")),
        quotes=tuple(_finished(_quote, one, folder) for one in entries.tables("quoted")),
        drop_test=optional("drop_test", _drop_test),
        screening=optional("screening", read_screening),
        ascent=ascent,
        surface=surface,
        optimum=read_optimum(entries.table("optimum"), surface) if "optimum" in entries else None,
        verified=optional("verification", read_verified),
    )
    entries.finish()
    return study


def _finished(read: Callable[[Entries, Path], Part], entries: Entries, folder: Path) -> Part:
    part = read(entries, folder)
    entries.finish()
    return part


def _target(entries: Entries, folder: Path) -> Target:
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


def _derived(entries: Entries, folder: Path) -> Derived:
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


def _measured(entries: Entries, folder: Path) -> tuple[Measured, ...]:
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


def _of_label(table: Table, key: str, label: str, column: str) -> tuple[Printed, ...]:
    """All cells of a column in the rows of one label; AuditError where there is none."""
    rows = [row for row, name in enumerate(table.texts(key)) if name == label]
    if not rows:
        raise AuditError(f"{table.name}: no row with {key} = {label!r}")
    return tuple(table.number(column, row) for row in rows)


def _total(entries: Entries, folder: Path) -> Total:
    table = read_table(folder, entries.text("file"))
    column = entries.text("column")
    return Total(
        entries.text("where"), entries.text("quantity", column), table.numbers(column), entries.figure("total")
    )


def _quote(entries: Entries, folder: Path) -> Quote:
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


def _drop_test(entries: Entries, folder: Path) -> DropTest:
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


def _labels(table: Table, entries: Entries) -> tuple[str, ...]:
    """Names of the rows: cells of the column `label`, or of the first one."""
    return table.texts(entries.text("label", next(iter(table.columns))))
