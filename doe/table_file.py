"""Tables provided by users: CSV as any spreadsheet saves it, or a workbook (.xlsx), of which the first sheet is read.

CSV cells are separated by commas, semicolons or tabs, and numbers have a decimal point or comma: programs set to
German, French and many other languages write ``;`` between cells and a comma in numbers. The header decides: the
delimiter is whichever of the three occurs in it most often, and unless that is the comma, a comma in a cell is a
decimal sign. A header of one name has no delimiter. The encoding is UTF-8 with or without a byte order mark, UTF-16
with one, or else that of Windows (cp1252). Lines that begin with # are comments, even if a spreadsheet has quoted them
or padded them with delimiters.
"""

from __future__ import annotations

import codecs
import csv
import io
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

DELIMITERS = (",", ";", "\t")
WORKBOOK = ".xlsx"
SUFFIXES = (".csv", WORKBOOK)
"""File name suffixes of tables."""
UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)


@dataclass(frozen=True)
class CellTable:
    """Rows and comments with the number, from 1, of the line in which each begins.

    rows: the header first; cells are stripped of surrounding spaces. Empty rows are left out, and so are empty cells
    beyond the last name of the header.
    """

    rows: tuple[tuple[int, list[str]], ...]
    comments: tuple[tuple[int, str], ...]
    decimal_comma: bool

    def plain(self, text: str) -> str:
        """Return the text of a number with a decimal point."""
        return text.replace(",", ".") if self.decimal_comma else text

    def number(self, text: str) -> float:
        """Return a cell as a number; NaN if it is not a finite number."""
        plain = self.plain(text).replace("−", "-")
        try:
            value = float(plain)
        except ValueError:
            return math.nan
        # Python reads 1_000 as a thousand; no spreadsheet does.
        return value if math.isfinite(value) and "_" not in plain else math.nan


def read_table(
    path: Path, most_bytes: int, wrong: Callable[[str], Exception], place: str = ", line {}", comments: bool = False
) -> CellTable:
    """Read the table in the file ``path``.

    Args:
        path: CSV, or a workbook if its name ends in .xlsx.
        most_bytes: a larger file is refused.
        wrong: makes the exception about a file or one of its lines from a message that begins with ``path``.
        place: how a line is named after ``path``.
        comments: whether # also begins a comment after the cells of a row.
    """
    content = _content(path, most_bytes, wrong)
    if path.suffix.lower() == WORKBOOK:
        return _of_workbook(content, lambda what: wrong(f"{path}: {what}"))
    text = decoded(content)
    if text is None:
        raise wrong(f"{path}: neither text nor a workbook ({WORKBOOK})")
    return csv_table(text, lambda line, what: wrong(f"{path}{place.format(line)}: {what}"), comments)


def check_cells(table: CellTable, wrong: Callable[[int, str], Exception], short: bool = False) -> None:
    """Raise ``wrong(line, what)`` for the first row whose number of cells differs from that of the header.

    ``short``: whether a row may have fewer cells.
    """
    columns = len(table.rows[0][1]) if table.rows else 0
    for line, cells in table.rows:
        if len(cells) > columns or (len(cells) < columns and not short):
            raise wrong(
                line,
                f"{len(cells)} cells; allowed: {columns}, one per column (with decimal commas the cells "
                "are divided by semicolons or tabs)",
            )


def read_text(path: Path, most_bytes: int, wrong: Callable[[str], Exception]) -> str:
    """Return the text in ``path``, lines ending in ``\\n``; on failure raise ``wrong(message)``, naming the file."""
    text = decoded(_content(path, most_bytes, wrong))
    if text is None:
        raise wrong(f"{path}: not a text file")
    return text


def decoded(content: bytes) -> str | None:
    """Return ``content`` as text, lines ending in ``\\n``; None if it is not text."""
    encodings = ("utf-16",) if content.startswith(UTF_16) else ("utf-8-sig", "cp1252")
    for encoding in encodings:
        try:
            text = content.decode(encoding)
        except UnicodeDecodeError:
            continue
        return None if "\0" in text else text.replace("\r\n", "\n").replace("\r", "\n")
    return None


def _content(path: Path, most_bytes: int, wrong: Callable[[str], Exception]) -> bytes:
    try:
        size = path.stat().st_size
        if size > most_bytes:
            raise wrong(f"{path}: {size} bytes; allowed: up to {most_bytes}")
        return path.read_bytes()
    except FileNotFoundError:
        raise wrong(f"{path}: no such file") from None
    except OSError as error:
        raise wrong(f"{path}: {error.strerror}") from None


def _of_workbook(content: bytes, wrong: Callable[[str], Exception]) -> CellTable:
    """The first sheet; its numbers have a decimal point, whatever the spreadsheet displays."""
    # Imported here because it takes a second and few users bring a workbook.
    import pandas

    try:
        frame = pandas.read_excel(io.BytesIO(content), header=None, dtype=str, keep_default_na=False, engine="openpyxl")
    except Exception as error:  # a ZIP reader and an XML parser may raise anything for a file that is not a workbook
        raise wrong(f"cannot be read as a workbook: {error}") from None
    comments: list[tuple[int, str]] = []
    rows: list[tuple[int, list[str]]] = []
    for number, cells in enumerate(frame.to_numpy().tolist(), start=1):
        texts = [str(cell).strip() for cell in cells]
        if texts and texts[0].startswith("#"):
            comments.append((number, " ".join(texts).strip()))
        elif kept := _trimmed(texts, len(rows[0][1]) if rows else 0):
            rows.append((number, kept))
    return CellTable(tuple(rows), tuple(comments), decimal_comma=False)


def csv_table(text: str, wrong: Callable[[int, str], Exception], trailing_comments: bool = False) -> CellTable:
    """Return the table in ``text``.

    Args:
        text: content of the file (:func:`decoded`).
        wrong: makes the exception for a line that cannot be split into cells, from its number and the problem.
        trailing_comments: whether # also begins a comment after the cells of a row.
    """
    lines: list[tuple[int, str]] = []
    comments: list[tuple[int, str]] = []
    for number, line in enumerate(text.splitlines(), start=1):
        comment = line.strip().strip('"').rstrip(",;\t\"' ")
        if comment.startswith("#"):
            comments.append((number, comment))
            continue
        content = _without_comment(line) if trailing_comments and "#" in line else line
        if content.strip(" ,;\t"):
            lines.append((number, content))
    header = lines[0][1] if lines else ","
    # With a header of one name, a comma can only be a decimal sign.
    delimiter = max(DELIMITERS, key=header.count) if any(map(header.count, DELIMITERS)) else ";"
    return CellTable(tuple(_rows(lines, delimiter, wrong)), tuple(comments), delimiter != ",")


def _without_comment(line: str) -> str:
    """``line`` up to the first # outside quotes."""
    end = next((k for k, sign in enumerate(line) if sign == "#" and line.count('"', 0, k) % 2 == 0), len(line))
    return line[:end]


def _rows(
    lines: list[tuple[int, str]], delimiter: str, wrong: Callable[[int, str], Exception]
) -> list[tuple[int, list[str]]]:
    reader = csv.reader((f"{line}\n" for _, line in lines), delimiter=delimiter, strict=True)
    rows: list[tuple[int, list[str]]] = []
    while reader.line_num < len(lines):
        # A quoted cell may contain line breaks: the row is named by its first line.
        number = lines[reader.line_num][0]
        try:
            cells = [cell.strip() for cell in next(reader)]
        except csv.Error as error:
            raise wrong(number, f"cannot be read as cells: {error}") from None
        if kept := _trimmed(cells, len(rows[0][1]) if rows else 0):
            rows.append((number, kept))
    return rows


def _trimmed(cells: list[str], width: int) -> list[str]:
    """``cells`` without trailing empty ones beyond the first ``width``; [] if all are empty."""
    while len(cells) > width and not cells[-1]:
        cells.pop()
    return cells if any(cells) else []
