"""CSV as spreadsheets save it: cells between commas, semicolons or tabs, numbers with a decimal point or comma.

Programs set to German, French and many other languages write ``;`` between cells and a comma in numbers. The header
decides: what stands in it most often is the delimiter, and only beside a comma as the delimiter a comma is no decimal
sign. Lines that begin with # are comments, also where a spreadsheet has quoted them or filled them up with delimiters.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable
from dataclasses import dataclass

DELIMITERS = (",", ";", "\t")


@dataclass(frozen=True)
class CsvTable:
    """Rows and comments by the number of the line in which they begin, from 1 on.

    rows: the header first; cells without spaces around them. Rows without any content are left out, and so are empty
    cells behind the last name of the header.
    """

    rows: tuple[tuple[int, list[str]], ...]
    comments: tuple[tuple[int, str], ...]
    decimal_comma: bool

    def plain(self, text: str) -> str:
        """The text of a number with a decimal point."""
        return text.replace(",", ".") if self.decimal_comma else text

    def number(self, text: str) -> float:
        """A cell as a number; NaN where it is not a finite one."""
        plain = self.plain(text).replace("−", "-")
        try:
            value = float(plain)
        except ValueError:
            return math.nan
        # Python reads 1_000 as a thousand; no spreadsheet means that.
        return value if math.isfinite(value) and "_" not in plain else math.nan


def csv_table(text: str, wrong: Callable[[int, str], Exception], trailing_comments: bool = False) -> CsvTable:
    """The table in ``text``.

    Args:
        text: content of the file, without a byte order mark (`doe.text_file`).
        wrong: makes the error about a line that cannot be split into cells, from its number and what is wrong.
        trailing_comments: whether # also begins a comment behind the cells of a row.
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
    delimiter = max(DELIMITERS, key=lines[0][1].count) if lines else ","
    return CsvTable(tuple(_rows(lines, delimiter, wrong)), tuple(comments), delimiter != ",")


def _without_comment(line: str) -> str:
    """``line`` up to the first # that stands outside quotes."""
    end = next((k for k, sign in enumerate(line) if sign == "#" and line.count('"', 0, k) % 2 == 0), len(line))
    return line[:end]


def _rows(
    lines: list[tuple[int, str]], delimiter: str, wrong: Callable[[int, str], Exception]
) -> list[tuple[int, list[str]]]:
    reader = csv.reader((f"{line}\n" for _, line in lines), delimiter=delimiter, strict=True)
    rows: list[tuple[int, list[str]]] = []
    while reader.line_num < len(lines):
        # A cell in quotes may hold line breaks: the row is named by its first line.
        number = lines[reader.line_num][0]
        try:
            cells = [cell.strip() for cell in next(reader)]
        except csv.Error as error:
            raise wrong(number, f"cannot be read as cells: {error}") from None
        width = len(rows[0][1]) if rows else 0
        while len(cells) > width and not cells[-1]:
            cells.pop()
        if any(cells):
            rows.append((number, cells))
    return rows
