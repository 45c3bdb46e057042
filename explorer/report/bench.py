"""The report of a bench test, and charts of it: a laboratory's curves, and what the solver's instrument read.

Of the laboratory every replicate, with the part that was taken as straight; of the solver every column against the
first.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from doe.laboratory import CurveFit, Derived, LabResult
from doe.laboratory.linear_range import LinearRange
from doe.laboratory.result import CONDITIONS
from doe.provenance import About
from explorer.errors import CommandError
from explorer.files.output_file import write_whole
from explorer.laboratory.twin_row import LIKE
from explorer.report.content import (
    Banner,
    Block,
    Bullets,
    DataTable,
    Figure,
    Report,
    Section,
    Spec,
    Strong,
    Table,
    Word,
)
from explorer.report.figures.style import CHOSEN, FACTOR, Json, axis, chart, label
from explorer.report.html import page
from explorer.units import enumeration, number, reading_unit

PANEL_HEIGHT = 420
PARAMETERS = (
    "Lay the parameters over a material: `explorer lab … --out part.toml`, then `explorer new material NAME --part "
    "part.toml`."
)
TARGET = "A target, no parameter: parameters are found by it. Its like is simulated by {}."
LEAST_POINTS = 3
"""Fewer readings of the solver's instrument are a few numbers, which the table has, and no curve."""


def write_curves(path: Path, result: LabResult, about: About) -> None:
    """Write the report of a test with curves as one page; CommandError without curves."""
    if not result.curves:
        raise CommandError("--plot: single readings only, no curve to draw")
    write_whole(path, page(bench_report(result, about)))


def bench_report(result: LabResult, about: About) -> Report:
    """The report of a bench test: what was measured, by which formula, and the curves behind it."""
    sections = [_parameters(result)]
    figures = []
    for k, (title, spec) in enumerate(curve_charts(result).items(), start=1):
        curves = [one for one in result.curves if _group(one) == title]
        points = sum(len(one.force) for one in curves)
        words = title.replace("_", " ")
        part = "the part taken as straight" if _straight(curves[0]) else "Hertz’s law, up to yield"
        caption = f"{words}: n = {len(curves)} replicates, {points} points. Line: {part}."
        figures.append(Figure(f"curves-{k}", spec, caption))
    if figures:
        sections.append(Section("Curves", tuple(figures)))
    return Report(
        f"{result.test.replace('_', ' ').capitalize()}: {Path(result.file).name}",
        "Readings of a bench test and the parameters that follow",
        banner(result),
        tuple(sections),
        about,
        (_data(result),),
    )


def banner(result: LabResult) -> Banner:
    """What was measured; a single replicate has no interval and measures nothing."""
    found = [one for one in result.derived if one.name not in CONDITIONS]
    alone = [one for one in found if one.summary.n < 2]
    kinds = enumeration([f"{one.name.replace('_', ' ')} {_of(one)}".strip() for one in found])
    outliers = sum(len(one.summary.outliers) for one in found)
    if not found or len(alone) == len(found):
        return Banner(
            Word.NO_ANSWER,
            "",
            f"One replicate of {kinds}: a value without a spread and without an interval.",
            "Repeat the test: five replicates give a useful interval.",
        )
    least = min(one.summary.n for one in found)
    odd = f"; {outliers} readings are outliers at the 5 % level and were kept" if outliers else ""
    return Banner(
        Word.MEASURED,
        kinds,
        f"{least} replicates at least of every quantity{odd}.",
        TARGET.format(LIKE[result.test]) if result.test in LIKE else PARAMETERS,
    )


def _parameters(result: LabResult) -> Section:
    rows = []
    for one in result.derived:
        if one.name in CONDITIONS:
            continue
        unit, s = reading_unit(one.unit), one.summary
        mean, sd, low, high = (number(unit.of(value), 4) for value in (s.mean, s.sd, s.low, s.high))
        odd = enumeration([one.replicates[k] for k in s.outliers])
        rows.append(
            (
                _of(one),
                one.name.replace("_", " "),
                Strong(unit.attach(mean)),
                sd,
                f"{low} … {high}",
                str(s.n),
                odd,
                one.formula,
            )
        )
    header = ("of", "quantity", "mean", "SD", "95 % of the mean", "n", "outliers", "formula")
    blocks: list[Block] = [Table(header, tuple(rows), "95 %: Student’s t. Outliers are kept.")]
    errors = [_with_errors(one) for one in result.derived if one.reading and one.name not in CONDITIONS]
    if errors:
        head = ("of", "quantity", "SD/√n", "u of the readings", "u of both", "95 % of the mean")
        blocks.append(Table(head, tuple(errors), "With the errors that the readings declare, by the GUM."))
    estimates = []
    for other in result.estimates:
        unit = reading_unit(other.unit)
        value, low, high = (number(unit.of(x), 4) for x in (other.value, other.low, other.high))
        of = "–".join(other.of)
        estimates.append(
            (of, other.name.replace("_", " "), Strong(unit.attach(value)), f"{low} … {high}", other.formula)
        )
    if estimates:
        blocks.append(Table(("of", "quantity", "value", "95 %", "formula"), tuple(estimates), "From several tests."))
    notes = dict.fromkeys([*(note for one in result.derived for note in one.notes), *result.notes])
    return Section("Parameters", (*blocks, *((Bullets(tuple(notes)),) if notes else ())))


def _with_errors(one: Derived) -> tuple[str, ...]:
    """What the errors that the readings declare add to a mean."""
    assert one.reading is not None
    unit, u = reading_unit(one.unit), one.reading
    found = [number(unit.of(x), 2) for x in (one.summary.standard_error, u.standard, u.combined)]
    low, high = (number(unit.of(x), 4) for x in (u.low, u.high))
    return (_of(one), one.name.replace("_", " "), *found, unit.attach(f"{low} … {high}"))


def _of(one: Derived) -> str:
    return "–".join(one.of).replace("_", " ")


def _data(result: LabResult) -> DataTable:
    """Every replicate, SI."""
    rows = tuple(
        ("-".join(one.of), one.name, replicate, value, one.unit, one.parameter)
        for one in result.derived
        for replicate, value in zip(one.replicates, one.values, strict=True)
    )
    return DataTable("replicates", ("of", "quantity", "replicate", "value", "unit", "parameter"), rows)


def curve_charts(result: LabResult) -> dict[str, Spec]:
    """Title → chart per component and quantity; none where the readings are no curves."""
    groups: dict[str, list[CurveFit]] = {}
    for curve in result.curves:
        groups.setdefault(_group(curve), []).append(curve)
    return {title: force_displacement(curves, title) for title, curves in groups.items()}


def _group(curve: CurveFit) -> str:
    return f"{'-'.join(curve.of)}, {curve.quantity}"


def force_displacement(curves: list[CurveFit], title: str) -> Spec:
    """Points of every replicate and, over them, the part that counts, straight or Hertzian, drawn on to zero force."""
    traces: list[Json] = []
    for curve in curves:
        first = curve is curves[0]
        traces.append(
            {
                "type": "scatter",
                "mode": "markers",
                "x": [1e3 * x for x in curve.displacement],
                "y": list(curve.force),
                "name": "points",
                "legendgroup": "points",
                "showlegend": first,
                "marker": {"size": 4, "color": FACTOR, "opacity": 0.5},
                "hovertemplate": f"replicate {label(curve.replicate)}: %{{x:.4g}} mm, %{{y:.4g}} N<extra></extra>",
            }
        )
        x, force = curve.fit.drawn
        traces.append(
            {
                "type": "scatter",
                "mode": "lines",
                "x": [1e3 * at for at in x],
                "y": list(force),
                "name": f"{'straight' if _straight(curve) else 'Hertzian'} part, on to zero force",
                "legendgroup": "straight",
                "showlegend": first,
                "line": {"color": CHOSEN, "width": 2},
                "hovertemplate": f"replicate {label(curve.replicate)}: {1e-6 * curve.modulus:.4g} MPa<extra></extra>",
            }
        )
    layout: Json = {
        "title": {"text": label(title.replace("_", " "))},
        "xaxis": axis("displacement [mm]"),
        "yaxis": axis("force [N]"),
        "margin": {"l": 60, "r": 24, "t": 80, "b": 52},
    }
    return chart(traces, layout, PANEL_HEIGHT)


def _straight(curve: CurveFit) -> bool:
    return isinstance(curve.fit, LinearRange)


def bench_charts(data: dict[str, Any]) -> dict[str, Spec]:
    """Title → chart, from what `explorer.tables.pours.bench_data` gives."""
    columns = list(data["series"].items())
    if not columns or len(columns[0][1]) < LEAST_POINTS:
        return {}
    (name, across), *others = columns
    return {f"{other} over {name}": _curve(name, across, other, values) for other, values in others}


def _curve(name: str, across: list[float | None], other: str, values: list[float | None]) -> Spec:
    trace = {
        "type": "scatter",
        "mode": "lines+markers",
        "x": across,
        "y": values,
        "name": label(other),
        "line": {"color": FACTOR, "width": 2},
        "marker": {"size": 4},
        "showlegend": False,
    }
    return chart([trace], {"xaxis": axis(name), "yaxis": axis(other)})
