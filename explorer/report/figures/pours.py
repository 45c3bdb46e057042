"""Charts of pours: noise of the estimators, and means beside the target in ascent, scan and verification."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from doe.analysis.pilot import EstimatorChoice
from doe.provenance import PouredPile
from doe.run_records import Run, valid_values
from doe.stages.ascent import AscentResult, TargetWalk
from doe.stages.pilot import PilotResult
from doe.stages.scan import ScanResult
from doe.stages.verification import VerificationResult
from doe.target import Target
from explorer.report.content import Spec
from explorer.report.figures.style import (
    ASSUMPTION,
    CHOSEN,
    DUMMY,
    FACTOR,
    INTERVAL_BAND,
    MARGIN_BAND,
    TARGET,
    Json,
    axis,
    chart,
    error_bars,
    finite,
    horizontal_band,
    horizontal_line,
    label,
    line,
    note,
    points,
    side_by_side,
    suffix,
    vertical_line,
)
from explorer.units import (
    enumeration,
    observable_label,
    observable_title,
    observed_number,
    parameter_label,
    parameter_value,
    unit_of_observable,
    unit_of_parameter,
)


def noise_of_estimators(pilot: PilotResult) -> Spec:
    """σ with its 95 % interval, d′ per declared change with its interval, and the range of the bias, in panels.

    Only estimators in the unit of the first, which is the target's own, share the axis.
    """
    own = unit_of_observable(next(iter(pilot.noise))).symbol
    estimators = [name for name in pilot.noise if unit_of_observable(name).symbol == own][::-1]
    rows = {name: label(observable_label(name)) for name in estimators}
    unit = unit_of_observable(estimators[0])
    choice, bias = pilot.choice, pilot.estimator_bias
    panels = 1 + (choice is not None) + bool(bias)
    domains = side_by_side(panels, 0.05)
    noises = [pilot.noise[name] for name in estimators]
    colours = [CHOSEN if name == pilot.estimator else FACTOR for name in estimators]
    traces = [
        points(
            [unit.of(noise.sigma) for noise in noises],
            [rows[name] for name in estimators],
            "σ over seeds",
            FACTOR,
            marker={"color": colours},
            error_x=_interval([(n.sigma, n.low, n.high) for n in noises], unit.size, FACTOR),
            showlegend=False,
        )
    ]
    layout: Json = {
        "xaxis": axis(f"noise σ of one pour [{unit.symbol}]", domain=domains[0], rangemode="tozero"),
        "yaxis": axis("", categoryorder="array", categoryarray=list(rows.values())),
        "shapes": [],
    }
    panel = 1
    if choice is not None:
        traces += _separations(choice, rows, panel)
        layout[f"xaxis{suffix(panel)}"] = axis("d′ = shift ÷ σ", domain=domains[panel], anchor="y", rangemode="tozero")
        panel += 1
    if bias:
        known = [name for name in estimators if any(math.isfinite(mean) for mean, _ in bias.get(name, ()))]
        means = [sorted(mean for mean, _ in bias[name] if math.isfinite(mean)) for name in known]
        ranges = [(found[len(found) // 2], found[0], found[-1]) for found in means]
        traces.append(
            points(
                [unit.of(middle) for middle, _, _ in ranges],
                [rows[name] for name in known],
                "bias on made-up piles",
                TARGET,
                error_x=_interval(ranges, unit.size, TARGET),
                showlegend=False,
                xaxis=f"x{suffix(panel)}",
            )
        )
        title = f"bias on made-up piles [{unit.symbol}]"
        layout[f"xaxis{suffix(panel)}"] = axis(title, domain=domains[panel], anchor="y")
        layout["shapes"].append(vertical_line(0.0, DUMMY, panel, "dot") | {"yref": "y domain"})
    return chart(traces, layout, 150 + 42 * len(estimators))


def _separations(choice: EstimatorChoice, rows: dict[str, str], panel: int) -> list[Json]:
    changes = list(dict.fromkeys(entry.change for entry in choice.separations))
    traces = []
    for change, colour in zip(changes, _cycle(len(changes)), strict=True):
        entries = [s for s in choice.separations if s.change == change and math.isfinite(s.d_prime)]
        bars = [(s.d_prime, s.low, s.high) for s in entries]
        traces.append(
            points(
                [s.d_prime for s in entries],
                [rows[s.estimator] for s in entries],
                f"d′: {change}",
                colour,
                error_x=_interval(bars, 1.0, colour),
                xaxis=f"x{suffix(panel)}",
            )
        )
    return traces


def _interval(bars: list[tuple[float, float, float]], size: float, colour: str) -> Json:
    """Error bars from (value, low, high), given in a unit ``size`` times smaller than the drawn one."""
    return {
        "type": "data",
        "symmetric": False,
        "array": [(high - value) / size if math.isfinite(high) else 0.0 for value, _, high in bars],
        "arrayminus": [max(0.0, value - low) / size if math.isfinite(low) else 0.0 for value, low, _ in bars],
        "color": colour,
        "thickness": 1.5,
        "width": 4,
    }


def _cycle(count: int) -> list[str]:
    colours = [ASSUMPTION, FACTOR, TARGET, CHOSEN]
    return [colours[k % len(colours)] for k in range(count)]


Look = tuple[str, str, str]
"""Colours of a line and its band, and dash."""
REFERENCE_BAND = "rgba(212, 120, 40, 0.18)"
NORMAL_95 = 1.96
FAINT = 0.45
MEASURED = 1.0
SIMULATED = 2.0


def ascent_path(walk: AscentResult, seen: TargetWalk, target: Target) -> Spec:
    """Mean per step with its 95 % interval, single runs, the first-order prediction, and the target with margin.

    ``seen``: the result of ``walk`` in the observable of ``target``.
    """
    unit = unit_of_observable(seen.observable)
    steps = list(range(1, len(seen.means) + 1))
    settings = [
        "<br>".join(
            label(f"{factor.name} = {parameter_value(factor.path, value)}")
            for factor, value in zip(walk.factors, natural, strict=True)
        )
        for natural in walk.path.natural.tolist()
    ]
    means = finite(unit.of(mean) for mean in seen.means)
    widths = [NORMAL_95 * unit.of(error) for error in seen.standard_error.tolist()]
    traces = [
        {
            "type": "scatter",
            "mode": "lines",
            "x": steps,
            "y": [unit.of(value) for value in seen.predicted.tolist()],
            "name": "first-order prediction of the screening",
            "line": line(DUMMY, "dot"),
        },
        _single_runs(steps, walk.runs, seen.observable, FACTOR),
        points(
            steps,
            means,
            "mean, 95 % interval",
            FACTOR,
            mode="lines+markers",
            line=line(FACTOR),
            error_y=error_bars(widths, FACTOR),
            text=settings,
            hovertemplate="step %{x}: %{y:.4g}<br>%{text}<extra></extra>",
        ),
    ]
    layout = {"xaxis": axis("step", dtick=1), "yaxis": axis(observable_title(seen.observable))}
    return chart(traces, layout | _target_marks(target), 400)


def profile(words: str, x: Sequence[float], mean: Sequence[float], sd: Sequence[float], look: Look) -> list[Json]:
    """A mean height with a band of one standard deviation, in the unit of its numbers; gaps at NaN."""
    colour, band, dash = look
    known = [
        (at, middle - spread, middle + spread)
        for at, middle, spread in zip(x, mean, sd, strict=True)
        if math.isfinite(middle) and math.isfinite(spread)
    ]
    edge = {
        "type": "scatter",
        "mode": "lines",
        "x": [at for at, _, _ in known] + [at for at, _, _ in known[::-1]],
        "y": [high for _, _, high in known] + [max(0.0, low) for _, low, _ in known[::-1]],
        "fill": "toself",
        "fillcolor": band,
        "line": {"width": 0},
        "hoverinfo": "skip",
        "showlegend": False,
        "name": f"{words} ± sd",
    }
    stroke = line(colour, dash, 2.2)
    return [edge, {"type": "scatter", "mode": "lines", "x": list(x), "y": finite(mean), "name": words, "line": stroke}]


@dataclass(frozen=True)
class Backdrop:
    """A picture behind a chart: ``source`` is its ``data:`` address; the ends of its sides [m]."""

    name: str
    source: str
    left: float
    right: float
    low: float
    high: float


def pile_outlines(
    piles: Sequence[PouredPile],
    measured: Mapping[str, tuple[Sequence[float], Sequence[float]]],
    behind: Backdrop | None = None,
) -> Spec:
    """Mean silhouettes with bands and, over them, photographed outlines (name → u, z [m]), on one scale [mm]."""
    looks = {"reference": (ASSUMPTION, REFERENCE_BAND, "dot"), "optimum": (FACTOR, INTERVAL_BAND, "dash")}
    traces: list[Json] = []
    for pile in piles:
        u, mean, sd = ([1e3 * value for value in row] for row in (pile.u, pile.mean, pile.sd))
        traces += profile(f"{pile.name}, n = {pile.pours}", u, mean, sd, looks[pile.name])
    for name, (across, up) in measured.items():
        x, y = ([1e3 * value for value in row] for row in (across, up))
        traces.append({"type": "scatter", "mode": "lines", "x": x, "y": y, "name": label(name), "line": line(TARGET)})
    layout: Json = {
        "xaxis": axis("distance from the pile’s middle [mm]"),
        "yaxis": axis("height [mm]", scaleanchor="x", rangemode="tozero"),
    }
    if behind is not None:
        place: Json = {"xref": "x", "yref": "y", "x": 1e3 * behind.left, "y": 1e3 * behind.high, "layer": "below"}
        size = {"sizex": 1e3 * (behind.right - behind.left), "sizey": 1e3 * (behind.high - behind.low)}
        layout["images"] = [{"source": behind.source, "sizing": "stretch", **place, **size}]
    return chart(traces, layout, 340)


def outlines_caption(piles: Sequence[PouredPile], photographed: int) -> str:
    """What the marks of :func:`pile_outlines` mean."""
    n = enumeration([f"{pile.pours} pours at the {pile.name}" for pile in piles])
    return (
        f"Photographed outlines (n = {photographed}) over mean silhouettes of n = {n}; bands: ± 1 SD between pours; "
        "both axes on one scale."
    )


def scan(scanned: ScanResult, target: Target) -> Spec:
    """Mean over the values of the scanned assumption with 95 % intervals, single runs, and the target."""
    unit, across = unit_of_observable(scanned.observable), unit_of_parameter(scanned.path)
    x = [across.of(value) for value in scanned.values]
    widths = [unit.of(math.nan if noise is None else noise.half_width) for noise in scanned.noise]
    traces = [
        _single_runs(x, scanned.runs, scanned.observable, ASSUMPTION),
        points(
            x,
            finite(unit.of(mean) for mean in scanned.means),
            "mean, 95 % interval",
            ASSUMPTION,
            mode="lines+markers",
            line=line(ASSUMPTION),
            error_y=error_bars(widths, ASSUMPTION),
        ),
    ]
    title = parameter_label(scanned.path) + (f" [{across.symbol}]" if across.symbol else "")
    layout = {"xaxis": axis(title), "yaxis": axis(observable_title(scanned.observable))}
    return chart(traces, layout | _target_marks(target), 380)


def verification(stage: VerificationResult, index: int) -> Spec:
    """Fresh pours as points, their mean and the measured mean with 95 % intervals, the margin as a band."""
    target, tests = stage.targets[index], stage.tests[index]
    unit = unit_of_observable(target.observable)
    pours = [unit.of(value) for value in valid_values(stage.runs, target.observable)]
    # Spread over a strip so that equal values stay visible; the horizontal position has no meaning.
    places = [SIMULATED + 0.14 + 0.22 * k / max(1, len(pours) - 1) for k in range(len(pours))]
    traces = [points(places, pours, "fresh pours", FACTOR, marker={"size": 7, "opacity": 0.6})]
    for name, x, sample, colour in (
        ("measured mean, 95 % interval", MEASURED, tests.target, TARGET),
        ("simulated mean, 95 % interval", SIMULATED, tests.simulated, FACTOR),
    ):
        bars: Json = error_bars([unit.of(sample.half_width)], colour)
        bars["width"] = 9
        diamond = {"size": 12, "symbol": "diamond"}
        traces.append(points([x], [unit.of(sample.mean)], name, colour, marker=diamond, error_y=bars))
    mean, margin = unit.of(target.mean), unit.of(target.margin)
    layout: Json = {
        "xaxis": axis("", range=[0.5, 2.75], tickvals=[MEASURED, SIMULATED + 0.12], ticktext=["measured", "simulated"]),
        "yaxis": axis(observable_title(target.observable)),
        "shapes": [horizontal_band(mean - margin, mean + margin, MARGIN_BAND)],
    }
    return chart(traces, layout, 400)


def _single_runs(x: Sequence[float], rows: Sequence[Sequence[Run]], observable: str, colour: str) -> Json:
    unit = unit_of_observable(observable)
    found = [
        (place, unit.of(value)) for place, runs in zip(x, rows, strict=True) for value in valid_values(runs, observable)
    ]
    faint = {"size": 6, "opacity": FAINT}
    return points([place for place, _ in found], [value for _, value in found], "single pours", colour, marker=faint)


def _target_marks(target: Target) -> Json:
    unit = unit_of_observable(target.observable)
    mean, margin = unit.of(target.mean), unit.of(target.margin)
    told = [observed_number(target.observable, value) for value in (target.mean, target.margin)]
    return {
        "shapes": [horizontal_band(mean - margin, mean + margin, MARGIN_BAND), horizontal_line(mean, TARGET)],
        "annotations": [
            note(f"target {told[0]} ± margin {told[1]}", 0.995, mean, xanchor="right", yanchor="bottom")
            | {"xref": "x domain", "yref": "y"}
        ],
    }
