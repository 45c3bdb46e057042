"""The tables of a follow-up (`next_folder`) by quantity and pour, as a person fills them in: read and written.

In the files, a row that was not measured is a comment, because the reader refuses a row without a value. Here it is an
ordinary row with empty values. Comment lines, and observables that were not asked for, stay as they are.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from doe.diagnose.result import Suggestion
from doe.errors import MeasurementError
from doe.measurement.bodies import COLUMNS as BODY_COLUMNS
from doe.measurement.bodies import QUANTITIES
from doe.measurement.load import FILE, outside_files
from doe.measurement.long_form import COLUMNS, MOST_BYTES
from doe.measurement.scans import SUFFIXES, scan_files
from doe.table_file import DELIMITERS, CellTable, csv_table, read_text
from explorer.diagnosis.next_folder import ORDER, asks_for, is_copy
from explorer.errors import CommandError
from explorer.files.exports import zipped
from explorer.files.measured_curves import PICTURES
from explorer.files.output_file import write_whole, write_whole_bytes
from explorer.files.uploads import named as whose
from explorer.files.uploads import unpacked_folder
from solver import named, parse_quantity, read_toml
from solver.assets import own_path

KEPT = "follow_ups"
"""Folder among the uploads for follow-ups that were sent back: they are not data sets of their own."""
ANY_DELIMITER = re.compile(f"[{''.join(DELIMITERS)}]")


@dataclass(frozen=True)
class AskedNumber:
    """A quantity at the place ``x`` ("" for a scalar), and its value in every pour; "" if none is filled in."""

    observable: str
    x: str
    values: tuple[str, ...]


@dataclass(frozen=True)
class AskedBody:
    """A quantity of single bodies, its mean and standard error; "" if none is filled in."""

    body: str
    quantity: str
    unit: str
    mean: str
    standard_error: str


@dataclass(frozen=True)
class FollowUpTables:
    """What the follow-up in ``folder`` asks for, and what is filled in. ``condition``: "" if it asks for no pour."""

    folder: Path
    condition: str
    numbers: tuple[AskedNumber, ...]
    bodies: tuple[AskedBody, ...]
    scanned: frozenset[int]
    """Numbers of the pours whose pile has a scan."""

    @property
    def pours(self) -> int:
        """Number of pours asked for."""
        return len(self.numbers[0].values) if self.numbers else 0

    @property
    def cells(self) -> tuple[str, ...]:
        """Every value asked for, those of pours first."""
        numbers = (value for row in self.numbers for value in row.values)
        return (*numbers, *(cell for row in self.bodies for cell in (row.mean, row.standard_error)))


def read_follow_up(folder: Path) -> FollowUpTables:
    """The tables in ``folder``. Raises CommandError or MeasurementError, in one line, if it holds no such tables."""
    name, pours, bodies = _files(folder)
    weighed: list[AskedBody] = []
    if bodies is not None:
        of_bodies = _table(bodies, BODY_COLUMNS, _is_body)
        for _, cells in of_bodies.rows[1:]:
            body, quantity, unit, mean, error = (*cells, "", "")[:5]
            weighed.append(AskedBody(body, quantity, unit, of_bodies.plain(mean), of_bodies.plain(error)))
    if pours is None:
        return FollowUpTables(folder, name, (), tuple(weighed), frozenset())
    scans = scan_files(folder, [name])[0][name]
    return FollowUpTables(folder, name, tuple(_numbers(pours)), tuple(weighed), frozenset(scans))


def _numbers(path: Path) -> Iterator[AskedNumber]:
    table = _table(path, COLUMNS, _is_number)
    found: dict[tuple[str, str], dict[int, str]] = {}
    most = 0
    for _, cells in table.rows[1:]:
        if _is_number(cells):
            place = table.plain(cells[2]) if len(cells) > 2 else ""
            unit = cells[4] if len(cells) > 4 and cells[3] else ""
            value = table.plain(cells[3]) + unit if len(cells) > 3 else ""
            found.setdefault((cells[1], place), {})[int(cells[0])] = value
            most = max(most, int(cells[0]))
    for key, of in found.items():
        yield AskedNumber(*key, tuple(of.get(k, "") for k in range(1, most + 1)))


def write_numbers(folder: Path, numbers: Sequence[AskedNumber]) -> None:
    """Write the values of ``numbers``, in SI, in place of those in the table of ``folder``.

    A value is a number in SI, or one with a unit, such as 24.7mm. Raises CommandError for anything else, and then
    changes nothing.
    """
    _, path, _ = _files(folder)
    if path is None:
        raise CommandError(f"{folder / FILE}: condition: is missing; allowed: one, with its name and its table")
    entered: dict[tuple[str, str, int], str] = {}
    for row in numbers:
        known = named(row.observable)
        for k, text in enumerate(row.values, start=1):
            where = f"pour {k}, {row.observable}" + (f" at {row.x}" if row.x else "")
            entered[row.observable, row.x, k] = _entered(text, known.unit if known else "1", where)
    table = _table(path, COLUMNS, _is_number)

    def line(cells: Sequence[str]) -> str:
        if not _is_number(cells):
            return ",".join(table.plain(cell) for cell in cells)
        place = table.plain(cells[2]) if len(cells) > 2 else ""
        value = entered.get((cells[1], place, int(cells[0])), "")
        return f"{'' if value else '# '}{cells[0]},{cells[1]},{place},{value}"

    _write(path, table, COLUMNS, line)


def write_bodies(folder: Path, bodies: Sequence[AskedBody]) -> None:
    """The same for the table of single bodies: means and standard errors in the units that the table names."""
    _, _, path = _files(folder)
    if path is None:
        raise CommandError(f"{folder / FILE}: bodies: is missing; allowed: the name of a table")
    entered: dict[tuple[str, str], tuple[str, str, str]] = {}
    for row in bodies:
        where = f"{row.body}, {row.quantity.replace('_', ' ')}"
        mean, error = (_entered(text, "1", where) for text in (row.mean, row.standard_error))
        if bool(mean) != bool(error):
            raise CommandError(f"{where}: has {'no standard error' if mean else 'no mean'}; allowed: both, or neither")
        entered[row.body, row.quantity] = row.unit, mean, error

    def line(cells: Sequence[str]) -> str:
        unit, mean, error = entered.get((cells[0], cells[1]), (cells[2], "", ""))
        return f"{'' if mean else '# '}{cells[0]},{cells[1]},{unit},{mean},{error}"

    _write(path, _table(path, BODY_COLUMNS, _is_body), BODY_COLUMNS, line)


def add_scan(folder: Path, name: str, content: bytes) -> Path:
    """Keep ``content``, a scan that a browser sent as ``name``, for the first pile that has no scan yet."""
    suffix = Path(name).suffix.lower()
    if suffix not in SUFFIXES:
        raise CommandError(f"{name[:80]}: allowed: files ending in {', '.join(SUFFIXES)}")
    tables = read_follow_up(folder)
    free = next((k for k in range(1, tables.pours + 1) if k not in tables.scanned), None)
    if free is None:
        raise CommandError(f"{name[:80]}: there is a scan of every pile ({tables.pours}); upload the whole folder anew")
    path = folder / "scans" / f"{tables.condition}_{free}{suffix}"
    path.parent.mkdir(exist_ok=True)
    write_whole_bytes(path, content)
    return path


def packed(folder: Path) -> bytes:
    """The whole folder as an archive (.zip), to be filled in elsewhere."""
    files = sorted(file for file in folder.rglob("*") if file.is_file())
    return zipped({file.relative_to(folder).as_posix(): file for file in files})


def take_filled(folder: Path, suggestion: Suggestion, name: str, content: bytes, uploads: Path) -> None:
    """Take the measured data from the archive ``content``, this follow-up filled in elsewhere; ``uploads`` keeps it.

    Tables, scans, pictures, and the settings in measurement.toml are taken. Raises CommandError in one line, with
    nothing changed, if the archive holds something else or its settings name a file outside it.
    """
    sent = unpacked_folder(name, content, uploads / KEPT, ORDER, read_follow_up)
    # The same archive may have been sent to another follow-up before.
    with whose(name, sent):
        if not (asks_for(sent, suggestion) and is_copy(sent, folder)):
            raise CommandError(f"{ORDER}: is that of another follow-up; allowed: of {suggestion.experiment.name}")
        if (sent / FILE).read_bytes() != (folder / FILE).read_bytes():
            for key, path in outside_files(sent, read_toml(sent / FILE)):
                raise CommandError(f"{key}: {path.name[:80]!r} is outside the archive; allowed are files in it")
    _, *tables = _files(sent)
    for file in sorted(file for file in sent.rglob("*") if file.is_file()):
        if file.suffix.lower() in (*SUFFIXES, *PICTURES) or file in (sent / FILE, *tables):
            to = folder / file.relative_to(sent)
            to.parent.mkdir(parents=True, exist_ok=True)
            write_whole_bytes(to, file.read_bytes())


# The files


def _files(folder: Path) -> tuple[str, Path | None, Path | None]:
    """Name and table of the one condition, and the table of single bodies; either table may be missing."""
    table = read_toml(folder / FILE)
    conditions, bodies = table.get("condition"), table.get("bodies")
    if conditions is None and bodies is not None:
        return "", None, folder / own_path(str(bodies))
    one = conditions[0] if isinstance(conditions, list) and len(conditions) == 1 else None
    if not isinstance(one, dict) or not {"name", "data"} <= set(one):
        raise CommandError(f"{folder / FILE}: condition: allowed: one, with its name and its table under data")
    pours = folder / own_path(str(one["data"]))
    return str(one["name"]), pours, None if bodies is None else folder / own_path(str(bodies))


def _table(path: Path, columns: Sequence[str], is_row: Callable[[Sequence[str]], bool]) -> CellTable:
    """The table in ``path``, including the rows that were not measured."""
    lines = []
    for line in read_text(path, MOST_BYTES, MeasurementError).splitlines():
        bare = line.strip().strip('"').lstrip("# ") if line.lstrip(' "').startswith("#") else ""
        lines.append(bare if bare and is_row([cell.strip() for cell in ANY_DELIMITER.split(bare)]) else line)
    table = csv_table("\n".join(lines), lambda line, what: MeasurementError(f"{path}:{line}: {what}"), True)
    header = table.rows[0][1] if table.rows else []
    if [*header[: len(columns)]] != [*columns]:
        found = ",".join(header) or "nothing"
        raise CommandError(f"{path}: columns: {found[:80]}; allowed here: {','.join(columns)}")
    return table


def _is_number(cells: Sequence[str]) -> bool:
    return len(cells) > 2 and cells[0].isdecimal() and named(cells[1]) is not None


def _is_body(cells: Sequence[str]) -> bool:
    return len(cells) > 2 and cells[1] in QUANTITIES


def _entered(text: str, unit: str, where: str) -> str:
    """A typed value, converted to SI; "" for none. Raises ParameterError if it is not a number in that unit."""
    plain = "".join(text.split()).replace("−", "-")
    plain = plain if "." in plain else plain.replace(",", ".")
    return repr(parse_quantity(plain, unit, where)) if plain else ""


def _write(path: Path, table: CellTable, columns: Sequence[str], line: Callable[[Sequence[str]], str]) -> None:
    """Write comments, header and rows in their order, each row as ``line`` formats it."""
    lines = [text for _, text in table.comments] + [",".join(columns)]
    write_whole(path, "\n".join([*lines, *(line(cells) for _, cells in table.rows[1:])]) + "\n")
