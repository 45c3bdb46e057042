"""Charts of the response along a path: the steepest ascent, and an assumption in steps."""

from __future__ import annotations

from explorer.report.content import Spec
from explorer.report.figures.style import (
    ASSUMPTION,
    DUMMY,
    FACTOR,
    MARGIN_BAND,
    TARGET,
    Json,
    axis,
    chart,
    error_bars,
    horizontal_band,
    horizontal_line,
    label,
    line,
    note,
    points,
)
from explorer.report.findings import Plain, interval_of_mean, values_of
from explorer.report.units_for_people import (
    observable_title,
    parameter_label,
    parameter_value,
    unit_of_observable,
    unit_of_parameter,
)

NORMAL_95 = 1.96
FAINT = 0.45


def ascent_path(result: Plain) -> Spec:
    """Mean per step with its 95 % interval, single runs, the first-order prediction, and the target with margin."""
    walk = result["ascent"]
    unit = unit_of_observable(walk["observable"])
    steps = list(range(1, len(walk["means"]) + 1))
    settings = [
        "<br>".join(
            label(f"{factor['name']} = {parameter_value(factor['path'], value)}")
            for factor, value in zip(walk["factors"], natural, strict=True)
        )
        for natural in walk["path"]["natural"]
    ]
    means = [None if mean is None else unit.of(mean) for mean in walk["means"]]
    widths = [None if error is None else NORMAL_95 * unit.of(error) for error in walk["standard_error"]]
    traces = [
        {
            "type": "scatter",
            "mode": "lines",
            "x": steps,
            "y": [unit.of(value) for value in walk["path"]["predicted"]],
            "name": "first-order prediction of the screening",
            "line": line(DUMMY, "dot"),
        },
        _single_runs(steps, walk["runs"], walk["observable"], FACTOR),
        points(
            steps,
            means,
            "mean, 95 % interval",
            FACTOR,
            mode="lines+markers",
            line=line(FACTOR),
            error_y=error_bars(widths, FACTOR),
            text=settings,
            hovertemplate="step %{x}: %{y:.2f}<br>%{text}<extra></extra>",
        ),
    ]
    layout = {"xaxis": axis("step", dtick=1), "yaxis": axis(observable_title(walk["observable"]))}
    return chart(traces, layout | _target_marks(result), 400)


def scan(result: Plain) -> Spec:
    """Mean over the values of the scanned assumption with 95 % intervals, single runs, and the target."""
    scanned = result["scan"]
    unit, across = unit_of_observable(scanned["observable"]), unit_of_parameter(scanned["path"])
    x = [across.of(value) for value in scanned["values"]]
    widths = [None if n is None else interval_of_mean(n["sigma"], n["runs"]) for n in scanned["noise"]]
    traces = [
        _single_runs(x, scanned["runs"], scanned["observable"], ASSUMPTION),
        points(
            x,
            [None if mean is None else unit.of(mean) for mean in scanned["means"]],
            "mean, 95 % interval",
            ASSUMPTION,
            mode="lines+markers",
            line=line(ASSUMPTION),
            error_y=error_bars([None if w is None else unit.of(w) for w in widths], ASSUMPTION),
        ),
    ]
    title = parameter_label(scanned["path"]) + (f" [{across.symbol}]" if across.symbol else "")
    layout = {"xaxis": axis(title), "yaxis": axis(observable_title(scanned["observable"]))}
    return chart(traces, layout | _target_marks(result), 380)


def _single_runs(x: list[float] | list[int], rows: list[list[Plain]], observable: str, colour: str) -> Json:
    unit = unit_of_observable(observable)
    found = [
        (place, unit.of(value)) for place, runs in zip(x, rows, strict=True) for value in values_of(runs, observable)
    ]
    faint = {"size": 6, "opacity": FAINT}
    return points([place for place, _ in found], [value for _, value in found], "single pours", colour, marker=faint)


def _target_marks(result: Plain) -> Json:
    target = result["study"]["targets"][0]
    unit = unit_of_observable(target["observable"])
    mean, margin = unit.of(target["mean"]), unit.of(target["margin"])
    return {
        "shapes": [horizontal_band(mean - margin, mean + margin, MARGIN_BAND), horizontal_line(mean, TARGET)],
        "annotations": [
            note(f"target {mean:.2f} ± margin {margin:.2f}", 0.995, mean, xanchor="right", yanchor="bottom")
            | {"xref": "x domain", "yref": "y"}
        ],
    }
