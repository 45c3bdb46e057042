"""Plain tables for a terminal."""

from __future__ import annotations

import io
from collections.abc import Sequence


def text_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Columns padded to their widest cell, two blanks between them; columns of numbers to the right."""
    # Imported where it is used: `explorer --help` prints no table.
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="")
    for k, title in enumerate(header):
        numbers = all(_is_number(row[k]) for row in rows)
        table.add_column(Text(title), justify="right" if numbers else "left", no_wrap=True)
    for row in rows:
        table.add_row(*map(Text, row))
    # As wide as it wants to be: what is printed may be read by a program, or in a window that scrolls.
    console = Console(file=io.StringIO(), width=100_000, color_system=None)
    with console.capture() as printed:
        console.print(table)
    return "\n".join(line.rstrip() for line in printed.get().splitlines())


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
