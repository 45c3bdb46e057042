"""The verification as a table for a terminal and as plain data; with the numbers of other engines where they ran."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from explorer.files.run_result import versions
from explorer.terminal.text_table import text_table
from solver.verification import OURS_BY_DISPLACEMENT, Row

HEADER = ("test", "quantity", "points", "at", "reference", "ours", "error %", "limit %", "of", "ok")

MISSED_ALONE = {
    "T4": "the printed curve is that of a spring which keeps a displacement, as LIGGGHTS's does; ours keeps a force, "
    "scales it down on unloading (Thornton), makes no energy, and is nearer to the measurement",
    "T6": "LIGGGHTS's curve crosses the printed one here and misses it on either side; ours, without a dashpot beyond "
    "Coulomb's limit, crosses it elsewhere",
}
KEPT_BY_CONVENTION = "kept with contact.tangential_law mindlin and contact.tangential_dashpot uncapped: a convention"
"""Why ours misses the sticking part of a test at points where another engine keeps the limit."""

PeerRows = Mapping[str, Sequence[Row]]
"""Engine → its rows, whose ``ours`` is the engine's number."""


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


def peers_text(rows: Sequence[Row], peers: PeerRows) -> str:
    """Every row that ours misses with each engine's number beside it, then who misses what.

    Parameters
    ----------
    rows
        Ours.
    peers
        Rows of other engines; those that ours does not have are left out.

    Returns
    -------
    Lines of text. A row that ours alone misses comes with its reason, or is called a bug where none is known.
    """
    return "\n".join(_peer_text(rows, name, found) for name, found in peers.items())


def _peer_text(rows: Sequence[Row], name: str, found: Sequence[Row]) -> str:
    beside = {_key(row): row for row in found}
    both = [(row, beside[_key(row)]) for row in rows if _key(row) in beside and row.limit is not None]
    missed = [(ours, theirs) for ours, theirs in both if not ours.passed]
    alone = [ours for ours, theirs in missed if theirs.passed]
    header = ("test", "quantity", "at", "reference", "ours", "error %", name, "error %", "limit %", f"{name} keeps it")
    lines = [text_table(header, [_peer_cells(ours, theirs) for ours, theirs in missed])] if missed else []
    lines.append(
        f"of {len(both)} points that {name} ran too, ours misses {len(missed)}: "
        f"{len(missed) - len(alone)} with {name}, {len(alone)} alone"
    )
    for test in dict.fromkeys(row.test for row in alone):
        points = [row for row in alone if row.test == test]
        lines.append(f"by ours alone: {test}: " + "; ".join(f"{row.quantity}, {row.at}" for row in points))
        known = MISSED_ALONE.get(test) if all(row.quantity.endswith("sticking") for row in points) else None
        if known and name == OURS_BY_DISPLACEMENT.name:
            known = KEPT_BY_CONVENTION
        lines.append(f"    {known or 'no reason is known: a bug until one is'}")
    theirs_alone = [theirs for ours, theirs in both if ours.passed and not theirs.passed]
    for points in curves(theirs_alone):
        lines.append(f"by {name} alone: {points[0].test}, {points[0].quantity}, {', '.join(row.at for row in points)}")
    return "\n".join(lines)


def result_of(rows: Sequence[Row], peers: PeerRows | None = None) -> dict[str, Any]:
    """Plain data: ``ok``, ``versions`` and every row; an error or number that is not finite is null.

    With ``peers``, every row that another engine ran has ``peers``: engine → ``value``, ``error_percent``, ``ok``.
    """
    beside = {name: {_key(row): row for row in found} for name, found in (peers or {}).items()}
    return {
        "ok": all(row.passed for row in rows),
        "versions": versions(),
        "rows": [_record(row) | _peer_record(row, beside) for row in rows],
    }


def _key(row: Row) -> tuple[str, str, str]:
    return row.test, row.quantity, row.at


def _peer_cells(ours: Row, theirs: Row) -> list[str]:
    numbers = [f"{ours.reference:.6g}", f"{ours.ours:.6g}", f"{ours.error:.3g}"]
    others = [f"{theirs.ours:.6g}", f"{theirs.error:.3g}", f"{ours.limit:g}", "yes" if theirs.passed else "NO"]
    return [ours.test, ours.quantity, ours.at, *numbers, *others]


def _peer_record(row: Row, beside: Mapping[str, Mapping[tuple[str, str, str], Row]]) -> dict[str, Any]:
    found = {name: rows[_key(row)] for name, rows in beside.items() if _key(row) in rows}
    records = {
        name: {"value": _finite_or_none(one.ours), "error_percent": _finite_or_none(one.error), "ok": one.passed}
        for name, one in found.items()
    }
    return {"peers": records} if records else {}


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
        "reference": _finite_or_none(row.reference),
        "ours": _finite_or_none(row.ours),
        "error_percent": _finite_or_none(row.error),
        "of": row.scale_name,
        "limit_percent": row.limit,
        "ok": row.passed,
        "source": row.source,
    }


def _finite_or_none(number: float | None) -> float | None:
    """A number as JSON has it: None for NaN and infinity."""
    return None if number is None or not math.isfinite(number) else float(number)
