"""The verification as a table for a terminal and as plain data."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from explorer.files.run_result import versions
from explorer.tables.text_table import text_table
from solver.verification import Row

HEADER = ("test", "quantity", "points", "at", "reference", "ours", "error %", "limit %", "of", "ok")


def curves(rows: Sequence[Row]) -> list[list[Row]]:
    """Rows of the same test and quantity together: the points of one curve, or a single number."""
    found: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        found.setdefault((row.test, row.quantity), []).append(row)
    return list(found.values())


def furthest(points: Sequence[Row]) -> Row:
    """The point with the largest error; one whose error is no number comes first."""
    return max(points, key=lambda row: math.inf if math.isnan(row.error) else abs(row.error))


def table_text(rows: Sequence[Row], every_point: bool) -> str:
    """One line per curve with its furthest point, or one per point."""
    lines = [[row] for row in rows] if every_point else curves(rows)
    return text_table(HEADER, [_cells(points) for points in lines])


def summary_text(rows: Sequence[Row]) -> str:
    """How many of the curves that have a limit keep it at every point, and which do not."""
    judged = [points for points in curves(rows) if points[0].limit is not None]
    missed = [points for points in judged if not all(row.passed for row in points)]
    text = f"{len(judged) - len(missed)} of {len(judged)} within their limits at every point"
    return text + "".join(f"\nmissed: {points[0].test}, {points[0].quantity}" for points in missed)


def result_of(rows: Sequence[Row]) -> dict[str, Any]:
    """Plain data: ``ok``, ``versions`` and every row; an error or number that is not finite is null."""
    return {"ok": all(row.passed for row in rows), "versions": versions(), "rows": [_record(row) for row in rows]}


def _cells(points: Sequence[Row]) -> list[str]:
    row = furthest(points)
    ok = "-" if row.limit is None else "yes" if all(one.passed for one in points) else "NO"
    limit = "-" if row.limit is None else f"{row.limit:g}"
    numbers = [f"{row.reference:.6g}", f"{row.ours:.6g}", f"{row.error:.3g}", limit]
    return [row.test, row.quantity, str(len(points)), row.at, *numbers, row.scale_name, ok]


def _record(row: Row) -> dict[str, Any]:
    return {
        "test": row.test,
        "quantity": row.quantity,
        "at": row.at,
        "reference": _finite(row.reference),
        "ours": _finite(row.ours),
        "error_percent": _finite(row.error),
        "of": row.scale_name,
        "limit_percent": row.limit,
        "ok": row.passed,
        "source": row.source,
    }


def _finite(number: float) -> float | None:
    return number if math.isfinite(number) else None
