"""Charts of what several targets say together: their contours superimposed, and the posterior of the factors."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from doe.analysis.joint_posterior import JointPosterior
from doe.studies.study import Factor
from explorer.report.content import Spec
from explorer.report.figures.model import FittedTarget, chosen_star, pair_panels
from explorer.report.figures.style import (
    ASSUMPTION,
    CHOSEN,
    DUMMY,
    FACTOR,
    INK,
    INTERVAL_BAND,
    TARGET,
    Json,
    axis,
    chart,
    label,
    line,
    rounded,
    side_by_side,
    suffix,
)
from explorer.report.figures.surface import GRID, section, sides
from explorer.units import axis_title, observable_label, parameter_range, unit_of_parameter

COLOURS = (TARGET, ASSUMPTION, FACTOR, DUMMY, CHOSEN)
"""Colours of the targets, in their order; repeated from the sixth on."""
WITHIN = "rgba(39, 164, 119, 0.28)"
FAINT_TO_FULL = [[0.0, "rgba(101, 110, 224, 0)"], [1.0, FACTOR]]


def overlaid(targets: Sequence[FittedTarget]) -> Spec:
    """Where each model gives its target, over each pair of factors, the others at the optimum.

    Full line: the target; dotted: target ± margin; filled: every target within its margin.
    """
    first = targets[0]
    panels, layout = pair_panels(first)
    traces: list[Json] = []
    for panel in panels:
        x, y = sides(first, panel, GRID)
        missed = [_missed(one, panel.pair) for one in targets]
        flat: Json = {"type": "contour", "x": x, "y": y, "showscale": False, "hoverinfo": "skip", **panel.axes}
        # plotly shades the region where a constraint does not hold.
        inside = {"type": "constraint", "operation": ">", "value": 1.0}
        traces.append(
            flat
            | {"z": rounded(np.abs(missed).max(axis=0)), "contours": inside, "fillcolor": WITHIN, "line": {"width": 0}}
            | {"name": "all within their margins", "showlegend": panel.in_legend}
        )
        for k, (one, grid) in enumerate(zip(targets, missed, strict=True)):
            colour, z = COLOURS[k % len(COLOURS)], rounded(grid)
            name = label(observable_label(one.observable))
            for start, end, size, width, dash in ((0.0, 0.0, 1.0, 3, "solid"), (-1.0, 1.0, 2.0, 1.2, "dot")):
                drawn = {"coloring": "none", "start": start, "end": end, "size": size}
                traces.append(
                    flat
                    | {"z": z, "contours": drawn, "line": {"color": colour, "width": width, "dash": dash}}
                    | {"name": name, "legendgroup": name, "showlegend": panel.in_legend and dash == "solid"}
                )
        traces += chosen_star(first, panel)
    return chart(traces, layout, 420)


def _missed(one: FittedTarget, pair: tuple[int, int]) -> np.ndarray:
    """(model − target)/margin on the section over a pair of factors."""
    assert one.target is not None
    return (section(one, pair, GRID) - one.target) / one.margin


def corner(posterior: JointPosterior, factors: Sequence[Factor]) -> Spec:
    """The posterior of each factor on the diagonal, with its 95 % interval, and of each pair below it."""
    k = len(factors)
    domains = side_by_side(k, 0.09)
    sizes = [unit_of_parameter(factor.path).size for factor in factors]
    middles = [_middles(posterior, j) / sizes[j] for j in range(k)]
    pairs = dict(zip(combinations(range(k), 2), posterior.pair_density, strict=True))
    traces: list[Json] = []
    layout: Json = {"showlegend": False, "shapes": []}
    for row in range(k):
        for column in range(row + 1):
            panel = row * k + column
            x, y = f"x{suffix(panel)}", f"y{suffix(panel)}"
            title = axis_title(factors[column].path, factors[column].name) if row == k - 1 else ""
            layout[f"xaxis{suffix(panel)}"] = axis(title, domain=domains[column], anchor=y, showticklabels=row == k - 1)
            beside = factors[row].name if column == 0 and row else ""  # a panel is too low for more
            layout[f"yaxis{suffix(panel)}"] = axis(
                beside, domain=domains[k - 1 - row], anchor=x, showticklabels=column == 0 and row > 0
            )
            place: Json = {"xaxis": x, "yaxis": y}
            if row == column:
                traces.append(_marginal(posterior, row, middles[row], factors[row]) | place)
                ends = [float(end[row]) / sizes[row] for end in (posterior.low, posterior.high)]
                band = {
                    "type": "rect",
                    "xref": x,
                    "yref": f"{y} domain",
                    "x0": ends[0],
                    "x1": ends[1],
                    "y0": 0,
                    "y1": 1,
                }
                layout["shapes"].append(band | {"fillcolor": INTERVAL_BAND, "line": {"width": 0}, "layer": "below"})
            else:
                # The first factor of a pair runs along the first axis of its density, which is here the x axis.
                density = pairs[column, row].T
                traces.append(
                    {"type": "heatmap", "x": middles[column].tolist(), "y": middles[row].tolist()}
                    | {
                        "z": (density / density.max()).round(4).tolist(),
                        "colorscale": FAINT_TO_FULL,
                        "showscale": False,
                    }
                    | {"hovertemplate": "%{x:.4g}, %{y:.4g}: %{z:.2f} of the peak<extra></extra>"}
                    | place
                )
    return chart(traces, layout, 190 * k)


def _middles(posterior: JointPosterior, j: int) -> np.ndarray:
    cells = posterior.density.shape[1]
    low, high = posterior.axis_low[j], posterior.axis_high[j]
    return np.asarray(low + (np.arange(cells) + 0.5) * (high - low) / cells)


def _marginal(posterior: JointPosterior, j: int, middles: np.ndarray, factor: Factor) -> Json:
    density = posterior.density[j] / posterior.density[j].max()
    told = parameter_range(factor.path, float(posterior.low[j]), float(posterior.high[j]))
    return {
        "type": "scatter",
        "mode": "lines",
        "x": middles.tolist(),
        "y": density.round(4).tolist(),
        "line": line(INK) | {"shape": "hvh"},
        "hovertemplate": f"%{{x:.4g}}<extra>95 %: {told}</extra>",
    }
