"""The stages of a calibration in a study.toml: screening, ascent, surface, optimum, verification."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from doe.analysis.surface import term_names
from doe.audit.study import (
    AnovaLine,
    Ascent,
    DesignSteps,
    Equation,
    Optimum,
    ScreenedFactor,
    Screening,
    SurfaceStudy,
    Verified,
)
from doe.audit.surface_refit import source_name
from doe.errors import AuditError
from explorer.audit.entries import Entries
from explorer.audit.tables import Table, read_table

FloatArray = npt.NDArray[np.float64]
STATISTICS = ("r_squared", "r_squared_adjusted", "r_squared_predicted", "cv_percent", "adequate_precision", "sigma")
MOST_FACTORS = 8
"""Of a second-order surface: 45 terms."""


def read_screening(entries: Entries, folder: Path) -> Screening:
    """``[screening]``: its factors (factor, low, high) and ANOVA (factor, sum_of_squares, f_value, p_value)."""
    runs = read_table(folder, entries.text("runs"))
    factors, anova = read_table(folder, entries.text("factors")), read_table(folder, entries.text("anova"))
    names = factors.texts("factor")
    if anova.texts("factor") != names:
        raise AuditError(f"{anova.name}: its factors are not those of {factors.name}, in the same order")
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
        raise AuditError(f"{runs.name}: {runs.rows} runs cannot tell {len(names)} factors; one more is needed")
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


def read_ascent(entries: Entries, folder: Path) -> Ascent:
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


def read_surface(entries: Entries, folder: Path, ascent: Ascent | None) -> SurfaceStudy:
    """``[surface]`` with ``[[surface.factor]]``, ``[surface.statistics]`` and ``[surface.equation]``; ``ascent`` is the
    walk that its levels may be said to be steps of."""
    runs, anova = read_table(folder, entries.text("runs")), read_table(folder, entries.text("anova"))
    factors = entries.tables("factor")
    if not 1 <= len(factors) <= MOST_FACTORS:
        raise entries.error("factor", f"{len(factors)} factors; allowed: 1 … {MOST_FACTORS}")
    names = tuple(one.text("name") for one in factors)
    if len(set(names)) < len(names):
        raise entries.error("factor", f"names must differ: {', '.join(names)}")
    low = np.array([one.number("low") for one in factors])
    high = np.array([one.number("high") for one in factors])
    if not (low < high).all():
        raise entries.error("factor", "low must be below high")
    levels = _numbers(runs, tuple(one.text("column") for one in factors))
    screened = tuple(one.text("screened", name) for one, name in zip(factors, names, strict=True))
    for one in factors:
        one.finish()
    coded = levels if entries.flag("coded", True) else (2 * levels - low - high) / (high - low)
    where_runs = entries.text("where_runs")
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
        responses=runs.numbers(entries.text("response")),
        anova=tuple(_anova_line(anova, row) for row in range(anova.rows)),
        statistics=statistics,
        equation=_equation(entries.table("equation"), names) if "equation" in entries else None,
        steps=_steps(entries.table("steps"), ascent) if "steps" in entries else None,
    )


def read_optimum(entries: Entries, surface: SurfaceStudy | None) -> Optimum:
    """``[optimum]`` with ``values``: factor of the surface → its value, natural unit."""
    if surface is None:
        raise entries.error("values", "there is no [surface] that this could be the optimum of")
    values = entries.table("values")
    found = Optimum(
        where=entries.text("where"),
        values=tuple(values.figure(name) for name in surface.factors),
        predicted=entries.figure_or_none("predicted"),
    )
    values.finish()
    entries.finish()
    return found


def read_verified(entries: Entries, folder: Path) -> Verified:
    """``[verification]``."""
    table = read_table(folder, entries.text("file"))
    return Verified(
        where=entries.text("where"),
        responses=table.numbers(entries.text("response")),
        mean=entries.figure_or_none("mean"),
        relative_error_percent=entries.figure_or_none("relative_error_percent"),
        p_two_sample=entries.figure_or_none("p_two_sample"),
    )


def _numbers(table: Table, columns: tuple[str, ...]) -> FloatArray:
    """Columns as values, shape (rows, columns)."""
    return np.array([[cell.value for cell in table.numbers(column)] for column in columns]).T


def _steps(entries: Entries, ascent: Ascent | None) -> DesignSteps:
    found = {}
    for key in ("low", "centre", "high"):
        found[key] = entries.text(key)
        if ascent is None or found[key] not in ascent.steps:
            known = "there is no [ascent]" if ascent is None else f"allowed: {', '.join(ascent.steps)}"
            raise entries.error(key, f"{found[key]!r} is no step of the ascent; {known}")
    entries.finish()
    return DesignSteps(**found)


def _anova_line(table: Table, row: int) -> AnovaLine:
    cells = {key: table.number_or_none(key, row) for key in ("sum_of_squares", "df", "mean_square")}
    return AnovaLine(
        table.texts("source")[row],
        **cells,
        f=table.number_or_none("f_value", row),
        p=table.number_or_none("p_value", row),
    )


def _equation(entries: Entries, factors: tuple[str, ...]) -> Equation:
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
