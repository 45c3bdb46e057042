"""Charts of a diagnosis: errors over the noise floor, residuals with bands, patterns, the pile."""

from __future__ import annotations

from explorer.report.content import Spec
from explorer.report.diagnosis.findings import residual_label, summary_label
from explorer.report.figures.style import (
    ASSUMPTION,
    BELOW_TO_ABOVE,
    DUMMY,
    FACTOR,
    INK,
    TARGET,
    Json,
    axis,
    chart,
    label,
    line,
    points,
    vertical_line,
)
from explorer.report.findings import Plain
from explorer.report.units_for_people import fixed, parameter_label

BEFORE, AFTER, MEASURED = ASSUMPTION, FACTOR, TARGET
ROW_HEIGHT = 30
"""Height of one row with two bars [px]."""
BAND = {TARGET: "rgba(77, 173, 112, 0.18)", FACTOR: "rgba(76, 93, 209, 0.18)", ASSUMPTION: "rgba(212, 126, 44, 0.18)"}
MM = 1e3


def error_chart(result: Plain, role: str) -> Spec:
    """Errors before and after divided by the noise floor, one row per observable."""
    rows = [row for row in result["error"][role] if row["noise_floor"]][::-1]
    names = [label(summary_label(row["observable"])) for row in rows]
    traces = [
        points([row[key] / row["noise_floor"] for row in rows], names, words, colour, marker={"size": 10})
        for key, words, colour in (("before", "before", BEFORE), ("after", "after", AFTER))
    ]
    layout: Json = {
        "xaxis": axis("error / noise floor", rangemode="tozero"),
        "yaxis": axis("", tickfont={"size": 11}),
        "shapes": [vertical_line(1.0, DUMMY, dash="dash")],
    }
    return chart(traces, layout, 120 + ROW_HEIGHT * len(rows))


def residual_chart(result: Plain, one: float, every: float) -> Spec:
    """Residuals before and after [σ] with the bands ± ``one`` and ± ``every``."""
    rows = result["residuals"][::-1]
    names = [label(residual_label(row["label"])) for row in rows]
    traces: list[Json] = [
        {
            "type": "bar",
            "orientation": "h",
            "x": [row[key] for row in rows],
            "y": names,
            "name": words,
            "marker": {"color": colour},
            "hovertemplate": "%{y}<br>%{x:+.2f} σ<extra>" + words + "</extra>",
        }
        for key, words, colour in (("z_after", "after", AFTER), ("z_before", "before", BEFORE))
    ]
    layout: Json = {
        "xaxis": axis("measured − model [σ]", zeroline=True),
        "yaxis": axis("", tickfont={"size": 11}),
        "barmode": "group",
        "bargap": 0.3,
        "legend": {"traceorder": "reversed", "orientation": "h", "x": 0, "y": 1.02, "yanchor": "bottom"},
        "shapes": [
            vertical_line(sign * level, DUMMY, dash=dash)
            for level, dash in ((one, "dash"), (every, "solid"))
            for sign in (-1, 1)
        ],
    }
    return chart(traces, layout, 120 + ROW_HEIGHT * len(rows))


def signature_chart(result: Plain) -> Spec:
    """Residual and signatures as columns of length one over the fitted numbers, and the parameters' own rows."""
    drawn = result["signatures"]
    size = sum(value * value for value in drawn["residual"]) ** 0.5
    columns = [[value / size for value in drawn["residual"]] if size else drawn["residual"], *drawn["vectors"]]
    rows = [label(residual_label(row["label"])) for row in result["residuals"]]
    rows += [label(f"measured {parameter_label(row['name'])}") for row in result["parameters"]]
    heights = [list(row) for row in zip(*columns, strict=True)]
    names = ["residual", *drawn["names"]]
    return _heat_map(heights, names, rows, 150 + 20 * len(rows), "%{y}<br>%{x}: %{z:.2f}")


def cosine_chart(result: Plain) -> Spec:
    """Cosines among residual and signatures, written into their fields."""
    drawn = result["signatures"]
    names = ["residual", *drawn["names"]]
    rows = [[1.0, *drawn["residual_cosine"]]]
    rows += [[own, *others] for own, others in zip(drawn["residual_cosine"], drawn["cosines"], strict=True)]
    spec = _heat_map(rows, names, names, 170 + 26 * len(names), "%{y}, %{x}: %{z:.2f}")
    spec["data"][0] |= {
        "text": [[fixed(value) for value in row] for row in rows],
        "texttemplate": "%{text}",
        "textfont": {"size": 10, "color": INK},
    }
    return spec


def pile_chart(picture: Plain) -> Spec:
    """Profiles of one condition, mirrored about the middle, each with a band of one standard deviation [mm]."""
    radius = [MM * r for r in picture["radius"]]
    x = [-r for r in reversed(radius)] + radius
    traces: list[Json] = []
    for key, colour, dash in (("measured", MEASURED, "solid"), ("before", BEFORE, "dot"), ("after", AFTER, "dash")):
        profile = picture[key]
        mean = [None if h is None else MM * h for h in _mirrored(profile["mean"])]
        known = [
            (at, MM * (middle - spread), MM * (middle + spread))
            for at, middle, spread in zip(x, _mirrored(profile["mean"]), _mirrored(profile["sd"]), strict=True)
            if middle is not None and spread is not None
        ]
        traces.append(
            {
                "type": "scatter",
                "mode": "lines",
                "x": [at for at, _, _ in known] + [at for at, _, _ in known[::-1]],
                "y": [high for _, _, high in known] + [max(0.0, low) for _, low, _ in known[::-1]],
                "fill": "toself",
                "fillcolor": BAND[colour],
                "line": {"width": 0},
                "hoverinfo": "skip",
                "showlegend": False,
                "name": f"{key} ± sd",
            }
        )
        stroke = line(colour, dash, 2.2)
        traces.append({"type": "scatter", "mode": "lines", "x": x, "y": mean, "name": key, "line": stroke})
    layout: Json = {
        "xaxis": axis("distance from the pile's middle [mm]"),
        "yaxis": axis("mean height [mm]", scaleanchor="x", rangemode="tozero"),
    }
    return chart(traces, layout, 320)


def _mirrored(values: list[float | None]) -> list[float | None]:
    return [*reversed(values), *values]


def _heat_map(rows: list[list[float]], names: list[str], labels: list[str], height: int, hover: str) -> Spec:
    trace: Json = {
        "type": "heatmap",
        "z": rows,
        "x": [label(name) for name in names],
        "y": labels,
        "zmin": -1.0,
        "zmax": 1.0,
        "colorscale": BELOW_TO_ABOVE,
        "hovertemplate": hover + "<extra></extra>",
        "colorbar": {"thickness": 12},
    }
    layout: Json = {
        "xaxis": axis("", tickangle=-40, tickfont={"size": 11}),
        "yaxis": axis("", autorange="reversed", tickfont={"size": 11}),
    }
    return chart([trace], layout, height)
