"""Charts of the optimum: the bootstrap cloud, and how far each factor can move while the model stays at the target."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations

import numpy as np

from doe.studies.study import Factor
from explorer.report.content import Spec
from explorer.report.figures.model import Array, FittedTarget
from explorer.report.figures.style import (
    CHOSEN,
    CLOUD,
    DUMMY,
    FACTOR,
    INK,
    TARGET,
    Json,
    axis,
    chart,
    label,
    points,
    side_by_side,
    suffix,
)
from explorer.report.identified import BY_RULE, GIVES_TARGET, is_identified
from explorer.units import axis_title, parameter_label, parameter_range, unit_of_parameter


def cloud(fitted: FittedTarget) -> Spec:
    """The chosen point of every bootstrap refit, for each pair of factors, with the optimum and the measured values."""
    assert fitted.optimum is not None
    found, factors = fitted.optimum.single, fitted.factors
    pairs = list(combinations(range(len(factors)), 2))
    domains = side_by_side(len(pairs), 0.1)
    sizes = np.array([unit_of_parameter(factor.path).size for factor in factors])
    refits = (found.bootstrap_points / sizes).tolist()
    chosen, measured = (found.point / sizes).tolist(), (found.reference / sizes).tolist()
    traces: list[Json] = []
    layout: Json = {}
    for panel, (i, j) in enumerate(pairs):
        shown: Json = {"xaxis": f"x{suffix(panel)}", "yaxis": f"y{suffix(panel)}", "showlegend": panel == 0}
        dots = {"size": 4, "color": CLOUD}
        star, cross = (
            {"size": 13, "symbol": "star"},
            {"size": 10, "symbol": "diamond", "color": "#ffffff", "line": {"color": INK, "width": 1.5}},
        )
        traces += [
            points([p[i] for p in refits], [p[j] for p in refits], "bootstrap refits", FACTOR, marker=dots, **shown),
            points([measured[i]], [measured[j]], fitted.reference_name, DUMMY, marker=cross, **shown),
            points([chosen[i]], [chosen[j]], fitted.chosen_name, CHOSEN, marker=star, **shown),
        ]
        for direction, k, other in (("x", i, "y"), ("y", j, "x")):
            title = axis_title(factors[k].path, factors[k].name)
            place = {"domain": domains[panel]} if direction == "x" else {}
            layout[f"{direction}axis{suffix(panel)}"] = axis(title, anchor=f"{other}{suffix(panel)}", **place)
    return chart(traces, layout, 360)


def ranges(fitted: FittedTarget) -> Spec:
    """Per factor, as a share of its screened range: region, range that gives the target, optimum, measured value.

    An identified factor has the 95 % set of its optimum as well; of any other the point is a hollow star.
    """
    assert fitted.optimum is not None
    assert fitted.chosen is not None
    found, factors = fitted.optimum.single, fitted.factors
    rows = [label(f"{factor.name} · {parameter_label(factor.path)}") for factor in factors]
    known = [is_identified(found, k) for k in range(len(factors))]
    set_low, set_high = (_where(known, end) for end in (found.point_low, found.point_high))
    bars = (
        ("region of the surface", fitted.low, fitted.high, DUMMY, 22),
        (GIVES_TARGET, found.solution_low, found.solution_high, TARGET, 12),
        ("95 % set of the optimum (bootstrap)", set_low, set_high, CHOSEN, 5),
    )
    traces: list[Json] = []
    for name, lows, highs, colour, width in bars:
        for k, (factor, row) in enumerate(zip(factors, rows, strict=True)):
            least, greatest = float(lows[k]), float(highs[k])
            if math.isnan(least) or math.isnan(greatest):
                continue
            text = parameter_range(factor.path, least, greatest)
            traces.append(
                {
                    "type": "scatter",
                    "mode": "lines",
                    "x": [_share(factor, least), _share(factor, greatest)],
                    "y": [row, row],
                    "name": name,
                    "legendgroup": name,
                    "showlegend": not any(trace["name"] == name for trace in traces),
                    "line": {"color": colour, "width": width},
                    "opacity": 0.35 if colour == DUMMY else 0.8,
                    "hovertemplate": f"{name}: {text}<extra></extra>",
                }
            )
    for name, values, colour, symbol in (
        (fitted.reference_name, found.reference, "#ffffff", "diamond"),
        ("optimum", _where(known, fitted.chosen), CHOSEN, "star"),
        (BY_RULE, _where([not one for one in known], fitted.chosen), CHOSEN, "star-open"),
    ):
        shares = [None if math.isnan(v) else _share(factor, v) for factor, v in zip(factors, values, strict=True)]
        outlined = {"symbol": symbol, "size": 12, "line": {"color": INK, "width": 1.2}}
        if any(share is not None for share in shares):
            traces.append(points(shares, rows, name, colour, marker=outlined))
    layout = {
        "xaxis": axis("share of the screened range [%]", range=[-3, 103]),
        "yaxis": axis("", categoryorder="array", categoryarray=rows[::-1]),
    }
    return chart(traces, layout, 190 + 52 * len(rows))


def _where(shown: Sequence[bool], values: Sequence[float] | Array) -> Array:
    """The values that are shown, NaN for the others."""
    return np.where(shown, values, math.nan)


def _share(factor: Factor, value: float) -> float:
    """Place of a value in the screened range of its factor [%]."""
    low, high = float(factor.low), float(factor.high)
    return 100.0 * (float(value) - low) / (high - low)
