"""The response surface of one target with what charts mark on it, its profiler, and how well its optimum is known.

The same charts draw a study's surface and that of a design from any laboratory; both come as `FittedTarget`. The
profiler shows the model along each factor through one point, with its interval, and the target.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import numpy.typing as npt

from doe.analysis.surface import Surface
from doe.analysis.surface_anova import SurfaceAnova
from doe.stages.surface import OptimumResult, SurfaceResult
from doe.studies.study import Factor
from doe.studies.study_result import AnyStudy
from doe.target import Target
from explorer.report.content import Spec
from explorer.report.figures.style import (
    CHOSEN,
    CLOUD,
    DUMMY,
    FACTOR,
    INK,
    INTERVAL_BAND,
    MARGIN_BAND,
    TARGET,
    Json,
    axis,
    chart,
    label,
    line,
    points,
    rounded,
    side_by_side,
    suffix,
)
from explorer.report.identified import BY_RULE, GIVES_TARGET, all_identified
from explorer.units import (
    axis_title,
    observable_title,
    parameter_label,
    parameter_range,
    unit_of_observable,
    unit_of_parameter,
)

Array = npt.NDArray[np.float64]

TRACE_POINTS = 31
"""Points along each factor of the profiler."""
MOST_PANELS = 3
"""Number of factors up to which every pair has a panel."""
ROW_GAP = 0.13
"""Space between two rows of the profiler, for the title of the axis [share of the height]."""


@dataclass(frozen=True)
class FittedTarget:
    """A target's response surface over k factors: natural values in SI, the response in the unit of the store."""

    model: Surface
    anova: SurfaceAnova
    factors: tuple[Factor, ...]
    design: Array
    """Natural levels of the points of the design, shape (points, k)."""
    observable: str
    target: float | None
    margin: float
    optimum: OptimumResult | None
    reference_name: str = "measured parameters"
    """Name for the reference values of the factors."""

    @property
    def low(self) -> Array:
        """Lower end of the region, shape (k,)."""
        return self.model.region.centre - self.model.region.half_width

    @property
    def high(self) -> Array:
        """Upper end of the region, shape (k,)."""
        return self.model.region.centre + self.model.region.half_width

    @property
    def chosen(self) -> list[float] | None:
        """The optimum in the order of the factors (natural values); None before there is one."""
        return None if self.optimum is None else [self.optimum.values[factor.path] for factor in self.factors]

    @property
    def chosen_name(self) -> str:
        """Name of the chosen point."""
        return "optimum" if self.optimum is None or all_identified(self.optimum) else BY_RULE

    @property
    def section_point(self) -> list[float]:
        """Point of sections through the surface (natural values): the optimum, before it the middle of the region."""
        return self.chosen or self.model.region.centre.tolist()


@dataclass(frozen=True)
class PairPanel:
    """A panel over two factors, the first along x: their numbers, and the sizes of their units [SI].

    ``axes``: keys that put a trace into it; ``in_legend``: whether it is the first of its row, whose traces the legend
    lists.
    """

    pair: tuple[int, int]
    sizes: tuple[float, float]
    axes: Json
    in_legend: bool


def pair_panels(fitted: FittedTarget) -> tuple[list[PairPanel], Json]:
    """A panel for each pair of factors (at least one), side by side, and the layout of their axes."""
    factors = fitted.factors
    pairs = list(combinations(range(len(factors)), 2))
    panels: list[PairPanel] = []
    layout: Json = {}
    for panel, ((i, j), domain) in enumerate(zip(pairs, side_by_side(len(pairs), 0.1), strict=True)):
        x, y = f"x{suffix(panel)}", f"y{suffix(panel)}"
        across, up = (axis_title(factors[k].path, factors[k].name) for k in (i, j))
        layout |= {
            f"xaxis{suffix(panel)}": axis(across, domain=domain, anchor=y),
            f"yaxis{suffix(panel)}": axis(up, anchor=x),
        }
        sizes = unit_of_parameter(factors[i].path).size, unit_of_parameter(factors[j].path).size
        panels.append(PairPanel((i, j), sizes, {"xaxis": x, "yaxis": y}, panel == 0))
    return panels, layout


def chosen_star(fitted: FittedTarget, panel: PairPanel) -> list[Json]:
    """The chosen point in a panel, if there is one."""
    if fitted.chosen is None:
        return []
    x, y = (fitted.chosen[k] / size for k, size in zip(panel.pair, panel.sizes, strict=True))
    star = {"size": 13, "symbol": "star", "line": {"color": "#ffffff", "width": 1}}
    return [points([x], [y], fitted.chosen_name, CHOSEN, marker=star, showlegend=panel.in_legend, **panel.axes)]


def fitted_targets(result: AnyStudy) -> tuple[FittedTarget, ...]:
    """One per target of a study; none before its response surface."""
    if result.surface is None:
        return ()
    return tuple(_fitted(result.surface, k, target, result.optimum) for k, target in enumerate(result.study.targets))


def _fitted(surface: SurfaceResult, k: int, target: Target, optimum: OptimumResult | None) -> FittedTarget:
    return FittedTarget(
        model=surface.models[k],
        anova=surface.anova[k],
        factors=surface.factors,
        design=surface.natural,
        observable=target.observable,
        target=target.mean,
        margin=target.margin,
        optimum=optimum,
    )


def profiler(fitted: FittedTarget, natural: Sequence[float]) -> Spec:
    """One row per factor: mean of the response over its range, the others at ``natural`` (SI), band 95 %."""
    factors, unit = fitted.factors, unit_of_observable(fitted.observable)
    here = fitted.model.region.coded(natural)
    k, coded = len(factors), np.linspace(-1.0, 1.0, TRACE_POINTS)
    along = np.broadcast_to(here, (k, TRACE_POINTS, k)).copy()
    for row in range(k):
        along[row, :, row] = coded
    means = fitted.model.predict(along) / unit.size
    widths = fitted.model.half_width(along) / unit.size
    height = unit.of(float(fitted.model.predict(here)))
    traces: list[Json] = []
    layout: Json = {"showlegend": False, "shapes": []}
    goal = None if fitted.target is None else unit.of(fitted.target)
    ends = [float(np.min(means - widths)), float(np.max(means + widths)), *([] if goal is None else [goal])]
    room = 0.05 * (max(ends) - min(ends))
    region = fitted.model.region
    for row, factor in enumerate(factors):
        size = unit_of_parameter(factor.path).size
        x = ((region.centre[row] + region.half_width[row] * coded) / size).tolist()
        at = natural[row] / size
        low, high = rounded(means[row] - widths[row]), rounded(means[row] + widths[row])
        place: Json = {"xaxis": f"x{suffix(row)}", "yaxis": f"y{suffix(row)}"}
        band: Json = {"type": "scatter", "mode": "lines", "fill": "toself", "fillcolor": INTERVAL_BAND}
        traces += [
            band | place | {"x": x + x[::-1], "y": high + low[::-1], "line": {"width": 0}, "hoverinfo": "skip"},
            {"type": "scatter", "mode": "lines", "x": x, "y": rounded(means[row]), "line": line(FACTOR)}
            | place
            | {"hovertemplate": "%{x:.4g}: %{y:.4g}<extra></extra>"},
            points([at], [height], "here", CHOSEN, marker={"size": 10}, **place),
        ]
        layout |= _row(row, k, axis_title(factor.path, factor.name), [min(ends) - room, max(ends) + room])
        if goal is not None:
            layout["shapes"] += _goal(row, goal, unit.of(fitted.margin))
    layout["yaxis"]["title"] = {"text": observable_title(fitted.observable)}
    return chart(traces, layout, 170 * k)


def _row(row: int, rows: int, title: str, limits: list[float]) -> Json:
    gap = min(ROW_GAP, 0.5 / rows)  # the rows keep at least half of the height, however many there are
    height = (1.0 - gap * (rows - 1)) / rows
    top = 1.0 - row * (height + gap)
    return {
        f"xaxis{suffix(row)}": axis(title, anchor=f"y{suffix(row)}"),
        f"yaxis{suffix(row)}": axis("", anchor=f"x{suffix(row)}", domain=[max(0.0, top - height), top], range=limits),
    }


def _goal(row: int, goal: float, margin: float) -> list[Json]:
    """The target across a row, with its margin."""
    domain = {"xref": f"x{suffix(row)} domain", "yref": f"y{suffix(row)}", "x0": 0, "x1": 1}
    return [
        {"type": "rect", **domain, "y0": goal - margin, "y1": goal + margin, "fillcolor": MARGIN_BAND}
        | {"line": {"width": 0}, "layer": "below"},
        {"type": "line", **domain, "y0": goal, "y1": goal, "line": line(TARGET, "dash")},
    ]


def prediction(fitted: FittedTarget, natural: Sequence[float]) -> tuple[float, float]:
    """Mean of the model at ``natural`` (SI) and half its 95 % interval, in the displayed unit."""
    here, unit = fitted.model.region.coded(natural), unit_of_observable(fitted.observable)
    return unit.of(float(fitted.model.predict(here))), unit.of(float(fitted.model.half_width(here)))


def cloud(fitted: FittedTarget) -> Spec:
    """The chosen point of every bootstrap refit, for each pair of factors, with optimum and measured values."""
    assert fitted.optimum is not None
    sizes = np.array([unit_of_parameter(factor.path).size for factor in fitted.factors])
    found = fitted.optimum.single
    refits, measured = (found.bootstrap_points / sizes).T.tolist(), (found.reference / sizes).tolist()
    dots = {"size": 4, "color": CLOUD}
    diamond = {"size": 10, "symbol": "diamond", "color": "#ffffff", "line": {"color": INK, "width": 1.5}}
    panels, layout = pair_panels(fitted)
    traces: list[Json] = []
    for panel in panels:
        i, j = panel.pair
        shown: Json = panel.axes | {"showlegend": panel.in_legend}
        traces += [
            points(refits[i], refits[j], "bootstrap refits", FACTOR, marker=dots, **shown),
            points([measured[i]], [measured[j]], fitted.reference_name, DUMMY, marker=diamond, **shown),
            *chosen_star(fitted, panel),
        ]
    return chart(traces, layout, 360)


def ranges(fitted: FittedTarget) -> Spec:
    """Per factor, as a share of its screened range: region, what the targets allow, optimum, measured value.

    One target allows the range that gives it and, for an identified factor, the 95 % set of its optimum. Several allow
    the 95 % interval of their posterior; without a posterior, what the first target alone allows is shown. The point of
    a factor that is not identified is a hollow star.
    """
    assert fitted.optimum is not None
    assert fitted.chosen is not None
    optimum, factors = fitted.optimum, fitted.factors
    found, several = optimum.single, optimum.compromise is not None
    rows = [label(f"{factor.name} · {parameter_label(factor.path)}") for factor in factors]
    known = [optimum.estimates[factor.path].identified for factor in factors]
    bars = [("region of the surface", fitted.low, fitted.high, DUMMY, 22)]
    if several and (joint := optimum.posterior) is not None:
        bars.append(("95 % interval by all targets", joint.low, joint.high, TARGET, 12))
    else:
        alone = ", first target alone" if several else ""
        set_low, set_high = (_where(known, end) for end in (found.point_low, found.point_high))
        bars += [
            (f"{GIVES_TARGET}{alone}", found.solution_low, found.solution_high, TARGET, 12),
            (f"95 % set of the optimum (bootstrap){alone}", set_low, set_high, CHOSEN, 5),
        ]
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
    """The values that are shown; NaN for the others."""
    return np.where(shown, values, math.nan)


def _share(factor: Factor, value: float) -> float:
    """Position of a value in the screened range of its factor [%]."""
    low, high = float(factor.low), float(factor.high)
    return 100.0 * (float(value) - low) / (high - low)
