"""A laboratory's readings as text for a terminal and as plain data: what was derived, twins, and biases."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from doe.laboratory import Derived, Estimate, LabResult
from doe.laboratory.bias import BiasTable
from doe.laboratory.hertz import HertzRange
from doe.laboratory.linear_range import LinearRange
from doe.laboratory.result import CONDITIONS
from explorer.laboratory.twin_row import CLOSES, TwinRow
from explorer.terminal.text_table import text_table
from explorer.units import entry_unit

PERCENT = ("moisture_wet_basis", "moisture_dry_basis")
NORMALITY_LEVEL = 0.05


def lab_data(result: LabResult, rows: Sequence[TwinRow], bias: BiasTable | None) -> dict[str, Any]:
    """All of it as JSON types, SI: the result, ``twins`` and ``bias`` (empty and null where not asked for)."""
    twins = [row.to_dict() | {"error": row.error if math.isfinite(row.error) else None} for row in rows]
    return result.to_dict() | {"twins": twins, "bias": bias_data(bias)}


def bias_data(bias: BiasTable | None) -> dict[str, Any] | None:
    """A table of biases as JSON types."""
    return bias.to_dict() if bias else None


def lab_text(result: LabResult) -> str:
    """What was derived, the estimates, the curves' straight parts, and what there is to say about them."""
    parts = [f"{result.test}: {result.file}", _derived_table(result.derived)]
    if result.estimates:
        parts.append(_estimate_table(result.estimates))
    parts += [table for table in (_errors_table(result), _straight_table(result), _hertz_table(result)) if table]
    notes = [f"{_name(one.of)} {one.name}: {text}" for one in result.derived for text in _remarks(one)]
    notes += [f"{_name(one.of)} {one.name}: {text}" for one in result.estimates for text in one.notes]
    notes += [*dict.fromkeys(note for one in result.derived for note in one.notes), *result.notes]
    if notes:
        parts.append("\n".join(f"note: {note}" for note in notes))
    return "\n\n".join(parts)


def twin_text(rows: Sequence[TwinRow]) -> str:
    """Measured, put in and simulated side by side."""
    cells = [
        (
            _name(row.of),
            row.quantity,
            _number(row.measured, row.unit),
            _number(row.put_in, row.unit),
            _number(row.simulated, row.unit),
            _screen(row.unit)[0],
            "-" if not math.isfinite(row.error) else f"{100.0 * row.error:+.3f}",
            {True: "closes", False: "DOES NOT CLOSE", None: "-"}[row.closes],
        )
        for row in rows
    ]
    head = ("twin of", "quantity", "measured", "put in", "simulated", "unit", "error %", f"within {CLOSES:.0%}")
    return text_table(head, cells)


def bias_text(bias: BiasTable) -> str:
    """A table of biases with its title and statement."""
    rows = [tuple(f"{number:.4g}" for number in row) for row in bias.rows]
    return f"{bias.title}\n{text_table(bias.columns, rows)}\n{bias.statement}"


def _derived_table(derived: Sequence[Derived]) -> str:
    rows = []
    for one in derived:
        if one.name in CONDITIONS:
            continue
        unit, factor = _screen(one.unit, one.name)
        s = one.summary
        rows.append(
            (
                _name(one.of),
                one.name,
                str(s.n),
                _scaled(s.mean, factor),
                _scaled(s.sd, factor, 3),
                f"{_scaled(s.low, factor)} … {_scaled(s.high, factor)}",
                f"{_scaled(s.least, factor)} … {_scaled(s.largest, factor)}",
                unit,
                _scaled(s.shapiro_p, 1.0, 2),
                ", ".join(one.replicates[k] for k in s.outliers) or "none",
            )
        )
    head = ("of", "quantity", "n", "mean", "SD", "95 % of the mean", "range", "unit", "Shapiro p", "outliers")
    return text_table(head, rows)


def _estimate_table(estimates: Sequence[Estimate]) -> str:
    rows = []
    for one in estimates:
        unit, factor = _screen(one.unit, one.name)
        interval = f"{_scaled(one.low, factor)} … {_scaled(one.high, factor)}"
        error = _scaled(one.standard_error, factor, 2)
        rows.append((_name(one.of), one.name, _scaled(one.value, factor), error, interval, unit, one.formula))
    return text_table(("of", "quantity", "value", "SE", "95 %", "unit", "formula"), rows)


def _errors_table(result: LabResult) -> str:
    """What the errors that the readings declare add to each mean."""
    rows = []
    for one in result.derived:
        if one.reading is None or one.name in CONDITIONS:
            continue
        unit, factor = _screen(one.unit, one.name)
        reading = one.reading
        numbers = (one.summary.standard_error, reading.standard, reading.combined)
        interval = f"{_scaled(reading.low, factor)} … {_scaled(reading.high, factor)}"
        rows.append((_name(one.of), one.name, *(_scaled(u, factor, 2) for u in numbers), interval, unit))
    head = (
        "with the readings' own errors",
        "quantity",
        "SD/√n",
        "u of readings",
        "u of both",
        "95 % of the mean",
        "unit",
    )
    return text_table(head, rows) if rows else ""


def _straight_table(result: LabResult) -> str:
    rows = [
        (
            _name(curve.of),
            curve.quantity,
            curve.replicate,
            f"{1e3 * fit.first_displacement:.4g} … {1e3 * fit.last_displacement:.4g}",
            f"{fit.first_force:.4g} … {fit.last_force:.4g}",
            f"{1e3 * fit.origin:.3g}",
            str(fit.points),
            f"{100.0 * fit.share:.0f}",
            f"{fit.r_squared:.5f}",
            f"{1e-6 * curve.modulus:.5g}",
        )
        for curve in result.curves
        if isinstance(fit := curve.fit, LinearRange)
    ]
    head = ("straight part of", "for", "replicate", "from … to [mm]", "from … to [N]", "toe [mm]", "points",
            "% of peak", "R²", "modulus [MPa]")  # fmt: skip
    return text_table(head, rows) if rows else ""


def _hertz_table(result: LabResult) -> str:
    rows = [
        (
            _name(curve.of),
            curve.quantity,
            curve.replicate,
            f"{1e3 * fit.origin:.3g}",
            f"{1e3 * fit.last_displacement:.4g}",
            f"{fit.last_force:.4g}",
            str(fit.points),
            f"{100.0 * fit.share:.0f}",
            f"{fit.exponent:.3f} ({fit.exponent_low:.3f} … {fit.exponent_high:.3f})",
            "none"
            if math.isnan(fit.yield_force)
            else f"{1e3 * fit.yield_displacement:.4g} mm, {fit.yield_force:.4g} N",
            f"{1e-6 * curve.modulus:.5g}",
        )
        for curve in result.curves
        if isinstance(fit := curve.fit, HertzRange)
    ]
    head = ("Hertz's law of", "for", "replicate", "toe [mm]", "up to [mm]", "up to [N]", "points", "% of peak",
            "exponent (95 %)", "yield", "modulus [MPa]")  # fmt: skip
    return text_table(head, rows) if rows else ""


def _remarks(one: Derived) -> list[str]:
    """What the statistics say that a reader must not overlook."""
    s, found = one.summary, []
    unit, factor = _screen(one.unit, one.name)
    if s.n == 1:
        found.append("one replicate: no spread, no interval")
    if s.outliers:
        names = ", ".join(one.replicates[k] for k in s.outliers)
        found.append(
            f"replicate {names} is an outlier at the 5 % level ({s.outlier_test}) and was kept; without it the mean is "
            f"{_scaled(s.mean_without, factor)}" + ("" if unit == "1" else f" {unit}")
        )
    if s.shapiro_p < NORMALITY_LEVEL:
        found.append(f"not normal (Shapiro–Wilk p = {s.shapiro_p:.2g}): the interval assumes that it is")
    return found


def _name(of: tuple[str, ...]) -> str:
    return "-".join(of)


def _screen(unit: str, name: str = "") -> tuple[str, float]:
    if name in PERCENT:
        return "%", 100.0
    if unit == "rad":
        return "deg", 180.0 / math.pi
    shown = entry_unit(unit)
    return shown.symbol or unit, 1.0 / shown.size


def _number(value: float | None, unit: str) -> str:
    return "-" if value is None else _scaled(value, _screen(unit)[1])


def _scaled(value: float, factor: float, digits: int = 4) -> str:
    return f"{factor * value:.{digits}g}" if math.isfinite(value) else "-"
