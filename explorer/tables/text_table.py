"""Plain tables for a terminal."""

from __future__ import annotations

from collections.abc import Sequence


def text_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Columns padded to their widest cell, two blanks between them; columns of numbers to the right."""
    columns = [[row[k] for row in rows] for k in range(len(header))]
    widths = [max(map(len, (title, *cells))) for title, cells in zip(header, columns, strict=True)]
    widths = [-width if all(map(_is_number, cells)) else width for width, cells in zip(widths, columns, strict=True)]
    return "\n".join(table_line(row, widths) for row in (header, *rows))


def table_line(row: Sequence[str], widths: Sequence[int]) -> str:
    """One line of a table whose columns are ``widths`` characters wide, a negative one to the right."""
    cells = (cell.rjust(-width) if width < 0 else cell.ljust(width) for cell, width in zip(row, widths, strict=True))
    return "  ".join(cells).rstrip()


def _is_number(cell: str) -> bool:
    """True for a number, and for the dash of a missing one."""
    try:
        return cell == "-" or float(cell) is not None
    except ValueError:
        return False
