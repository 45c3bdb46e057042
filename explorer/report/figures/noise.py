"""Chart of the pilot: per estimator its noise, how well it shows a declared change, and the range of its bias."""

from __future__ import annotations

import math

from doe.analysis.pilot import EstimatorChoice
from doe.stages.pilot import PilotResult
from explorer.report.content import Spec
from explorer.report.figures.style import (
    ASSUMPTION,
    CHOSEN,
    DUMMY,
    FACTOR,
    TARGET,
    Json,
    axis,
    chart,
    label,
    points,
    side_by_side,
    suffix,
    vertical_line,
)
from explorer.units import observable_label, unit_of_observable


def noise_of_estimators(pilot: PilotResult) -> Spec:
    """σ with its 95 % interval, d′ per declared change with its interval, and the range of the bias, in panels.

    Only estimators in the unit of the first, the target's own, share the axis.
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
    """Error bars from (value, low, high), given in a unit ``size`` times smaller than drawn."""
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
