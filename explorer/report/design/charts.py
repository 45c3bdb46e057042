"""Charts of an analysed design beside those of a study's surface: single runs, Box–Cox profile, path of extremes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from scipy import stats

from doe.analysis.analyse import FittedModel
from doe.analysis.model_adequacy import BoxCox, Diagnostics
from explorer.design.result import DesignResult
from explorer.report.content import Spec
from explorer.report.design.elementary import morris_chart
from explorer.report.design.groups import group_chart
from explorer.report.design.names import name_chart
from explorer.report.figures.style import (
    ASSUMPTION,
    CHOSEN,
    DUMMY,
    FACTOR,
    INTERVAL_BAND,
    TARGET,
    Json,
    axis,
    chart,
    finite,
    horizontal_band,
    horizontal_line,
    label,
    line,
    points,
    side_by_side,
    stacked,
    suffix,
    vertical_line,
)
from explorer.report.study_charts import Plot, Plots, optimum_plots, surface_plots
from explorer.units import observable_title, parameter_label

COLOURS = (FACTOR, CHOSEN, ASSUMPTION)
DASHES = ("solid", "dash", "dot")


def design_plots(result: DesignResult) -> Plots:
    """Charts of a study's surface, then single runs, Box–Cox profile and ridge; without a model, those of its kind."""
    model, fitted = result.analysis.model, result.fitted
    if model is None or fitted is None:
        return dict(_plots_without_model(result))
    plots = dict(surface_plots(fitted))
    if fitted.optimum is not None:
        plots |= optimum_plots(fitted, fitted.optimum)
    limits = "Dashed: limits beyond which a run stands out."
    plots["Single runs"] = Plot(partial(stacked, single_runs(model.diagnostics, result.labels)), limits, 2.0)
    if box_cox_profile(model.box_cox) is not None:
        caption = "Band: 95 % interval of the power."
        plots["Power of the response"] = Plot(partial(box_cox_profile, model.box_cox), caption)
    caption = "Highest and lowest response at a distance from the centre, 95 % bands; below: where the highest is."
    plots["Ridge"] = Plot(partial(stacked, ridge(result, model)), caption, 1.6)
    return plots


def _plots_without_model(result: DesignResult) -> Iterator[tuple[str, Plot]]:
    """The chart of elementary effects, names or random groups, as in its section of the report."""
    found = result.analysis
    if found.elementary is not None:
        caption = "μ*: how much a factor acts, bars 95 %. σ: how much it bends, acts with others, or is noise."
        yield "Elementary effects", Plot(partial(morris_chart, result, found.elementary), caption)
    if found.named is not None and found.named.means:
        yield "Means of names", Plot(partial(name_chart, result, found.named), "Of the model, 95 % intervals (t).")
    if found.random is not None:
        caption = "Predicted effects of the groups, shrunk towards zero by their own scatter."
        yield "Groups", Plot(partial(group_chart, result, found.random), caption)


def single_runs(found: Diagnostics, names: Sequence[str]) -> Spec:
    """Per run: the studentised residual with the limit for the largest of all, Cook's distance and leverage."""
    labels = [label(name) for name in names]
    places = list(range(1, len(labels) + 1))
    hover = {"text": labels, "hovertemplate": "run %{text}: %{y:.3g}<extra></extra>"}
    domains = side_by_side(3, 0.08)
    layout: Json = {"showlegend": False, "shapes": []}
    traces = []
    for panel, (values, title) in enumerate(
        (
            (found.external, "studentised residual"),
            (found.cooks_distance, "Cook's distance"),
            (found.leverage, "leverage"),
        )
    ):
        number = suffix(panel)
        place = {"xaxis": f"x{number}", "yaxis": f"y{number}"}
        traces.append(points(places, finite(values), title, FACTOR, **place, **hover))
        layout[f"xaxis{number}"] = axis("run of the sheet, by row", domain=domains[panel], anchor=f"y{number}")
        layout[f"yaxis{number}"] = axis(title, anchor=f"x{number}")
    if math.isfinite(found.outlier_limit):
        layout["shapes"] += [horizontal_line(sign * found.outlier_limit, CHOSEN, 0, "dash") for sign in (-1, 1)]
    layout["shapes"].append(horizontal_line(1.0, CHOSEN, 1, "dash"))
    if found.leverage_limit < 1.0:
        layout["shapes"].append(horizontal_line(found.leverage_limit, CHOSEN, 2, "dash"))
    return chart(traces, layout, 340)


def box_cox_profile(found: BoxCox) -> Spec | None:
    """ln SS over the power of the response, with its 95 % interval; None if there is no profile."""
    if found.note:
        return None
    powers, sums = found.powers.tolist(), found.log_sum_of_squares.tolist()
    traces = [{"type": "scatter", "mode": "lines", "x": powers, "y": sums, "line": line(FACTOR), "name": "ln SS"}]
    band = horizontal_band(min(sums), found.limit, INTERVAL_BAND)
    layout = {
        "showlegend": False,
        "xaxis": axis("power of the response"),
        "yaxis": axis("ln of the residual sum of squares"),
        "shapes": [band, vertical_line(found.best, CHOSEN), vertical_line(1.0, DUMMY, 0, "dash")],
    }
    return chart(traces, layout, 320)


def ridge(result: DesignResult, model: FittedModel) -> Spec:
    """Left: highest and lowest response within a distance of the centre, band 95 %; right: location of the highest."""
    df = model.surface.df_residual
    left, right = side_by_side(2, 0.12)
    traces: list[Json] = []
    for path, name, colour in ((model.highest, "highest", TARGET), (model.lowest, "lowest", DUMMY)):
        mean, half = path.predicted, float(stats.t.ppf(0.975, df)) * path.standard_error
        band = {"type": "scatter", "mode": "lines", "fill": "toself", "fillcolor": INTERVAL_BAND, "hoverinfo": "skip"}
        edges = np.concatenate([mean + half, (mean - half)[::-1]]).tolist()
        radius = path.radius.tolist()
        traces.append(band | {"x": radius + radius[::-1], "y": edges, "line": {"width": 0}, "showlegend": False})
        traces.append(
            {"type": "scatter", "mode": "lines", "x": radius, "y": mean.tolist(), "name": name, "line": line(colour)}
        )
    for k, factor in enumerate(result.factors):
        stroke = line(COLOURS[k % len(COLOURS)], DASHES[k // len(COLOURS) % len(DASHES)])
        traces.append(
            {"type": "scatter", "mode": "lines", "x": model.highest.radius.tolist(), "xaxis": "x2", "yaxis": "y2"}
            | {"y": model.highest.coded[:, k].tolist(), "line": stroke}
            | {"name": label(f"{factor.name}: {parameter_label(factor.path)}")}
        )
    layout = {
        "xaxis": axis("distance from the centre [half-widths]", domain=left),
        "yaxis": axis(observable_title(result.response.path)),
        "xaxis2": axis("distance from the centre [half-widths]", domain=right, anchor="y2"),
        "yaxis2": axis("coded level where it is highest", anchor="x2"),
    }
    return chart(traces, layout, 360)
