"""Charts of the optimum: the bootstrap cloud, and how far each factor can move while the model stays at the target."""

from __future__ import annotations

from itertools import combinations

from explorer.report.content import Spec
from explorer.report.figures.model import chosen_name, reference_name
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
from explorer.report.findings import Plain
from explorer.report.identified import BY_RULE, GIVES_TARGET, is_identified
from explorer.report.units_for_people import axis_title, parameter_label, parameter_range, unit_of_parameter


def cloud(result: Plain) -> Spec:
    """The chosen point of every bootstrap refit, for each pair of factors, with the optimum and the measured values."""
    found, factors = result["optimum"]["single"], result["optimum"]["factors"]
    pairs = list(combinations(range(len(factors)), 2))
    domains = side_by_side(len(pairs), 0.1)
    sizes = [unit_of_parameter(factor["path"]).size for factor in factors]
    refits = [[value / size for value, size in zip(point, sizes, strict=True)] for point in found["bootstrap_points"]]
    chosen = [value / size for value, size in zip(found["point"], sizes, strict=True)]
    measured = [value / size for value, size in zip(found["reference"], sizes, strict=True)]
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
            points([measured[i]], [measured[j]], reference_name(result), DUMMY, marker=cross, **shown),
            points([chosen[i]], [chosen[j]], chosen_name(result), CHOSEN, marker=star, **shown),
        ]
        for direction, k, other in (("x", i, "y"), ("y", j, "x")):
            title = axis_title(factors[k]["path"], factors[k]["name"])
            place = {"domain": domains[panel]} if direction == "x" else {}
            layout[f"{direction}axis{suffix(panel)}"] = axis(title, anchor=f"{other}{suffix(panel)}", **place)
    return chart(traces, layout, 360)


def ranges(result: Plain) -> Spec:
    """Per factor, as a share of its screened range: region, range that gives the target, optimum, measured value.

    An identified factor has the 95 % set of its optimum as well; of any other the point is a hollow star.
    """
    found, factors, region = result["optimum"]["single"], result["optimum"]["factors"], result["surface"]["region"]
    rows = [label(f"{factor['name']} · {parameter_label(factor['path'])}") for factor in factors]
    low = [c - h for c, h in zip(region["centre"], region["half_width"], strict=True)]
    high = [c + h for c, h in zip(region["centre"], region["half_width"], strict=True)]
    known = [is_identified(found, k) for k in range(len(factors))]
    set_low, set_high = (_where(known, found[end]) for end in ("point_low", "point_high"))
    bars = (
        ("region of the surface", low, high, DUMMY, 22),
        (GIVES_TARGET, found["solution_low"], found["solution_high"], TARGET, 12),
        ("95 % set of the optimum (bootstrap)", set_low, set_high, CHOSEN, 5),
    )
    traces: list[Json] = []
    for name, lows, highs, colour, width in bars:
        for k, (factor, row) in enumerate(zip(factors, rows, strict=True)):
            least, greatest = lows[k], highs[k]
            if least is None or greatest is None:
                continue
            text = parameter_range(factor["path"], least, greatest)
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
    chosen = [result["optimum"]["values"][factor["path"]] for factor in factors]
    for name, values, colour, symbol in (
        (reference_name(result), found["reference"], "#ffffff", "diamond"),
        ("optimum", _where(known, chosen), CHOSEN, "star"),
        (BY_RULE, _where([not one for one in known], chosen), CHOSEN, "star-open"),
    ):
        shares = [None if v is None else _share(factor, v) for factor, v in zip(factors, values, strict=True)]
        outlined = {"symbol": symbol, "size": 12, "line": {"color": INK, "width": 1.2}}
        if any(share is not None for share in shares):
            traces.append(points(shares, rows, name, colour, marker=outlined))
    layout = {
        "xaxis": axis("share of the screened range [%]", range=[-3, 103]),
        "yaxis": axis("", categoryorder="array", categoryarray=rows[::-1]),
    }
    return chart(traces, layout, 190 + 52 * len(rows))


def _where(shown: list[bool], values: list[float]) -> list[float | None]:
    """The values that are shown, None for the others."""
    return [value if show else None for show, value in zip(shown, values, strict=True)]


def _share(factor: Plain, value: float) -> float:
    """Place of a value in the screened range of its factor [%]."""
    return 100.0 * (value - factor["low"]) / (factor["high"] - factor["low"])
