"""Charts of a diagnosis, as far as its result has content: probabilities, errors, residuals, piles, maps.

Errors are shown relative to the noise floor, residuals with the bands within which a correct model stays.
"""

from __future__ import annotations

from functools import partial

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.diagnose.result import NO_EFFECT, UNEXPLAINED, Residual
from doe.measurement.measurement import Role
from doe.measurement.residual_map import ResidualMap
from explorer.diagnosis.result import DiagnosisResult, PileProfiles
from explorer.report.content import Spec
from explorer.report.diagnosis.wording import feature_label, spelled
from explorer.report.figures.pours import profile
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
    points,
    rounded,
    side_by_side,
    suffix,
    vertical_line,
)
from explorer.report.study_charts import Plot, Plots

BEFORE, AFTER, MEASURED = ASSUMPTION, FACTOR, TARGET
ROW_HEIGHT = 30
"""Height of one row with two bars [px]."""
BAND = {TARGET: "rgba(39, 164, 119, 0.18)", FACTOR: "rgba(101, 110, 224, 0.18)", ASSUMPTION: "rgba(212, 120, 40, 0.18)"}
MM = 1e3
FEWEST, LEAST = 3, 0.005
"""Answers that are drawn or listed: at least this many, and all with at least this probability."""
MOST_RESIDUALS = 40
"""Features that are drawn at most; the table holds all."""
ROLES: dict[Role, str] = {"holdout": "held-out", "fit": "fitted"}


def diagnosis_plots(result: DiagnosisResult) -> Plots:
    """Title → plot: probabilities of the answers, residuals before and after, errors, piles."""
    caption = "Pale: with another effect, also counted in the pair's row. Dashed: from here on an effect is named."
    plots: Plots = {"Probability of each answer": Plot(partial(probability_chart, result), caption, 0.8)}
    if result.residuals:
        caption = "Dashed: 95 % for one feature; solid: for all of them. The farthest off, where there are many."
        plots["Residuals before and after"] = Plot(partial(residual_chart, result), caption, 1.5)
    for role, words in ROLES.items():
        if any(row.noise_floor > 0.0 for row in result.error.of(role)):
            caption = "Errors over what noise alone would leave; dashed: no worse than noise."
            plots[f"Error on {words} data"] = Plot(partial(error_chart, result, role), caption, 1.0)
    for picture in sorted(result.piles, key=lambda row: row.role != "holdout"):
        words = ROLES[picture.role]
        caption = "Mean height from the pile's own middle, mirrored; a band is one standard deviation between pours."
        plots[f"Pile, {words} condition {picture.condition}"] = Plot(partial(pile_chart, picture), caption, 0.6)
    return plots


def likely(result: DiagnosisResult) -> list[tuple[str, float]]:
    """The answers that get a row, the most probable first."""
    found = result.ranked()
    return [one for k, one in enumerate(found) if k < FEWEST or one[1] >= LEAST]


def probability_chart(result: DiagnosisResult) -> Spec:
    """Probability of every answer that gets a row, and of its effect beside another, with the threshold for a name.

    An effect beside another one is also in the row of the pair.
    """
    rows = likely(result)[::-1]
    colours = {NO_EFFECT: TARGET, UNEXPLAINED: DUMMY}
    beside = [row.beside if (row := result.effect_row(answer)) is not None else 0.0 for answer, _ in rows]
    traces: list[Json] = [
        {
            "type": "bar",
            "name": words,
            "orientation": "h",
            "x": [100.0 * p for p in shares],
            "y": [label(spelled(answer).replace("`", "")) for answer, _ in rows],
            "marker": {"color": [colours.get(answer, FACTOR) for answer, _ in rows], "opacity": opacity},
            "hovertemplate": f"%{{y}}<br>%{{x:.2f}} % {words}<extra></extra>",
        }
        for words, opacity, shares in (
            ("", 1.0, [p for _, p in rows]),
            ("with another effect", 0.3, beside),
        )
    ]
    layout: Json = {
        "xaxis": axis("probability [%]", range=[0, 100]),
        "yaxis": axis("", tickfont={"size": 12}),
        "bargap": 0.35,
        "barmode": "stack",
        "showlegend": False,
        "shapes": [vertical_line(100.0 * result.threshold, DUMMY, dash="dash")],
    }
    return chart(traces, layout, 110 + ROW_HEIGHT * len(rows))


def error_chart(result: DiagnosisResult, role: Role) -> Spec:
    """Errors before and after, divided by the noise floor, one row per observable."""
    rows = [row for row in result.error.of(role) if row.noise_floor > 0.0][::-1]
    names = [label(feature_label(row.observable)) for row in rows]
    traces = [
        points(ratios, names, words, colour, marker={"size": 10})
        for words, colour, ratios in (
            ("before", BEFORE, [row.before / row.noise_floor for row in rows]),
            ("after", AFTER, [row.after / row.noise_floor for row in rows]),
        )
    ]
    layout: Json = {
        "xaxis": axis("error / noise floor", rangemode="tozero"),
        "yaxis": axis("", tickfont={"size": 11}),
        "shapes": [vertical_line(1.0, DUMMY, dash="dash")],
    }
    return chart(traces, layout, 120 + ROW_HEIGHT * len(rows))


def drawn_residuals(result: DiagnosisResult) -> tuple[Residual, ...]:
    """Rows of the features with the largest residuals, before or after, in their original order."""
    rows = result.residuals
    sizes = [max(abs(row.z_before), abs(row.z_after)) for row in rows]
    chosen = sorted(range(len(rows)), key=lambda k: -sizes[k])[:MOST_RESIDUALS]
    return tuple(rows[k] for k in sorted(chosen))


def residual_chart(result: DiagnosisResult) -> Spec:
    """Residuals before and after [σ], with the bands within which a correct model stays."""
    rows = drawn_residuals(result)[::-1]
    names = [label(f"{row.condition} · {feature_label(row.feature)}") for row in rows]
    traces: list[Json] = [
        {
            "type": "bar",
            "orientation": "h",
            "x": sizes,
            "y": names,
            "name": words,
            "marker": {"color": colour},
            "hovertemplate": "%{y}<br>%{x:+.2f} σ<extra>" + words + "</extra>",
        }
        for words, colour, sizes in (
            ("after", AFTER, [row.z_after for row in rows]),
            ("before", BEFORE, [row.z_before for row in rows]),
        )
    ]
    one, every = bands(len(result.residuals))
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


def bands(features: int) -> tuple[float, float]:
    """Half-widths [σ] within which a correct model stays with chance 0.95: one feature, and all (Bonferroni)."""
    return float(stats.norm.isf(0.025)), float(stats.norm.isf(0.025 / features))


def pile_chart(picture: PileProfiles) -> Spec:
    """Profiles of one condition, mirrored about the middle, each with a band of one standard deviation [mm]."""
    radius = [MM * r for r in picture.radius.tolist()]
    x = [-r for r in reversed(radius)] + radius
    traces: list[Json] = []
    for words, found, colour, dash in (
        ("measured", picture.measured, MEASURED, "solid"),
        ("before", picture.before, BEFORE, "dot"),
        ("after", picture.after, AFTER, "dash"),
    ):
        mean, sd = ([MM * h for h in _mirrored(one)] for one in (found.mean, found.sd))
        traces += profile(words, x, mean, sd, (colour, BAND[colour], dash))
    # Not at equal scales: in a pile a third as high as wide, the profiles could not be told apart.
    layout: Json = {
        "xaxis": axis("distance from the pile's middle [mm]"),
        "yaxis": axis("mean height [mm]", rangemode="tozero"),
    }
    return chart(traces, layout, 320)


def _mirrored(values: npt.NDArray[np.float64]) -> list[float]:
    return [*reversed(values.tolist()), *values.tolist()]


def map_chart(picture: ResidualMap) -> Spec:
    """Measured minus poured height over the plate [mm], before and after, with lines of the measured height."""
    measured = MM * picture.measured
    n = len(measured)
    at = rounded(MM * picture.pixel * (np.arange(n) + 0.5 - n / 2))
    differences = (("before", picture.before), ("after", picture.after))
    reach = max(float(np.abs(MM * one.height).max()) for _, one in differences) or 1.0
    colours: Json = {"colorscale": BELOW_TO_ABOVE, "cmin": -reach, "cmax": reach}
    layout: Json = {
        "coloraxis": colours | {"colorbar": {"title": {"text": "measured − model [mm]"}}},
        "showlegend": False,
    }
    traces: list[Json] = []
    for panel, (words, difference) in enumerate(differences):
        axes = {"xaxis": f"x{suffix(panel)}", "yaxis": f"y{suffix(panel)}"}
        # Rows of a map go along x, rows of a heat map along y.
        traces.append(
            {
                "type": "heatmap",
                "name": words,
                "x": at,
                "y": at,
                "z": rounded(MM * difference.height.T),
                "customdata": difference.z.T.round(1).tolist(),
                "coloraxis": "coloraxis",
                "hovertemplate": "x %{x:.0f} mm, y %{y:.0f} mm<br>%{z:+.2f} mm, %{customdata:+.1f} σ<extra></extra>",
            }
            | axes
        )
        heights: Json = {"type": "contour", "x": at, "y": at, "z": rounded(measured.T), "ncontours": 6}
        lines: Json = {"contours": {"coloring": "none"}, "line": {"width": 0.8, "color": INK}, "hoverinfo": "skip"}
        traces.append(heights | lines | {"showscale": False} | axes)
        title = f"x [mm], {words}"
        layout[f"xaxis{suffix(panel)}"] = axis(title, domain=side_by_side(2, 0.1)[panel], anchor=f"y{suffix(panel)}")
        layout[f"yaxis{suffix(panel)}"] = axis("y [mm]", scaleanchor=f"x{suffix(panel)}", anchor=f"x{suffix(panel)}")
    return chart(traces, layout, 380)
