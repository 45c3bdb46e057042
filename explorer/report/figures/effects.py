"""Charts of a two-level design: Pareto of |t|, half-normal plot, main effects, and all effects side by side.

Main effects are drawn as the mean of the response at the low and the high level of each factor; all effects are those
of factors and of assumptions about the set-up.
"""

from __future__ import annotations

import math
from typing import Protocol

from scipy import stats

from doe.analysis.screening import ErrorSource, FactorEffect, Screening
from doe.stages.screening import ScreeningResult
from doe.studies.study import Factor
from explorer.report.content import Spec
from explorer.report.figures.style import (
    ASSUMPTION,
    CHOSEN,
    DUMMY,
    FACTOR,
    Json,
    axis,
    chart,
    error_bars,
    finite,
    label,
    line,
    note,
    points,
    side_by_side,
    suffix,
    vertical_line,
)
from explorer.units import counted, fixed, number, observable_title, parameter_label, unit_of_observable

ROW_HEIGHT = 19
"""Height of one bar or interval [px]."""
LABELLED = 12
"""Effects labelled by name in the half-normal plot; smaller ones overlap and show their name on hover."""
MOST = 8
"""Factors drawn at most: those with the largest effects."""
ACROSS = 4
"""Charts side by side."""
GAP, ROW_GAP = 0.03, 0.16
"""Space between charts [share of the width, of the height]."""


class EffectsOf(Protocol):
    """Effects of a two-level design and the meaning of its columns: a screening, or a design of any laboratory."""

    @property
    def analysis(self) -> Screening:
        """Effects and tests of all columns."""

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns."""

    @property
    def factors(self) -> tuple[Factor, ...]:
        """The factors of the columns that are not dummies."""

    @property
    def response(self) -> str:
        """Observable of the effects."""


def pareto(screening: EffectsOf) -> Spec | None:
    """|t| of every column against each error, with the limits for one factor and for all; None without an error."""
    errors = errors_at_hand(screening.analysis)
    return pareto_against(screening, errors) if errors else None


def errors_at_hand(analysis: Screening) -> list[ErrorSource]:
    """The errors against which effects can be judged, the decisive one first."""
    sources: tuple[ErrorSource, ...] = ("replicates", "dummies")
    return [
        source
        for source in sources
        if analysis.error(source) is not None and any(math.isfinite(_t(e, source)) for e in analysis.effects)
    ]


def pareto_against(screening: EffectsOf, errors: list[ErrorSource]) -> Spec:
    """The Pareto chart against ``errors``, side by side; there must be at least one."""
    analysis = screening.analysis
    effects = sorted(analysis.effects, key=lambda effect: t if math.isfinite(t := _t(effect, errors[0])) else -1.0)
    titles = _titles(screening)
    rows = [label(titles[effect.name]) for effect in effects]
    colours = [DUMMY if effect.is_dummy else FACTOR for effect in effects]
    domains = side_by_side(len(errors))
    traces: list[Json] = []
    layout: Json = {"showlegend": False, "shapes": [], "annotations": [], "bargap": 0.3}
    layout["yaxis"] = axis("", tickfont={"size": 11}) | {"domain": [0, 0.96]}
    for k, error in enumerate(errors):
        estimate = analysis.error(error)
        assert estimate is not None
        sizes = finite(_t(effect, error) for effect in effects)
        traces.append(
            {
                "type": "bar",
                "orientation": "h",
                "x": sizes,
                "y": rows,
                "name": error,
                "marker": {"color": colours},
                "xaxis": f"x{suffix(k)}",
                "hovertemplate": "%{y}<br>|t| = %{x:.2f}<extra></extra>",
            }
        )
        title = f"|t| against the {error} ({counted(estimate.df, 'degree of freedom')})"
        layout[f"xaxis{suffix(k)}"] = axis(title, domain=domains[k], rangemode="tozero", anchor="y")
        for limit, words, dash, anchor in (
            (estimate.t_limit, "one factor", "dash", "right"),
            (estimate.t_limit_bonferroni, "all factors", "solid", "left"),
        ):
            layout["shapes"].append(vertical_line(limit, CHOSEN, k, dash) | {"yref": "y domain"})
            text = f"{words}: {fixed(limit)}"
            layout["annotations"].append(note(text, limit, 1.0, 0, xanchor=anchor, yanchor="bottom"))
            layout["annotations"][-1]["xref"] = f"x{suffix(k)}"
    return chart(traces, layout, 110 + ROW_HEIGHT * len(rows))


def half_normal(screening: EffectsOf) -> Spec:
    """|effect| over the quantile that the same rank has in half-normal noise, with Lenth's margins."""
    analysis, unit = screening.analysis, unit_of_observable(screening.response)
    known = [effect for effect in analysis.effects if math.isfinite(effect.effect)]
    known = sorted(known, key=lambda effect: abs(effect.effect))
    quantile = [float(stats.halfnorm.ppf((k + 0.5) / len(known))) for k in range(len(known))]
    traces = []
    for is_dummy, name, colour in ((False, "factors", FACTOR), (True, "dummies", DUMMY)):
        chosen = [k for k, effect in enumerate(known) if effect.is_dummy is is_dummy]
        if chosen:
            sizes = [unit.of(abs(known[k].effect)) for k in chosen]
            names = [label(known[k].name) for k in chosen]
            shown = [name if k >= len(known) - LABELLED else "" for k, name in zip(chosen, names, strict=True)]
            more = {"mode": "markers+text", "text": shown, "textposition": "middle left", "textfont": {"size": 11}}
            more |= {"customdata": names, "hovertemplate": "%{customdata}: %{y:.4g}<extra></extra>"}
            traces.append(points([quantile[k] for k in chosen], sizes, name, colour, **more))
    lenth = analysis.lenth
    margins = {"Lenth's margin, one effect": lenth.margin, "all effects": lenth.simultaneous_margin}
    layout: Json = {
        "xaxis": axis("half-normal quantile", range=[-0.12, max(quantile) * 1.08]),
        "yaxis": axis("|effect| on " + observable_title(screening.response), rangemode="tozero"),
        "shapes": [],
        "annotations": [],
    }
    for (words, level), dash in zip(margins.items(), ("dash", "solid"), strict=True):
        if math.isfinite(level):
            place = {"xref": "x domain", "yref": "y"}
            stroke = {"color": DUMMY, "dash": dash, "width": 1.2}
            layout["shapes"].append(
                {"type": "line", **place, "x0": 0, "x1": 1, "y0": unit.of(level), "y1": unit.of(level), "line": stroke}
            )
            text = {"text": f"{words} {number(unit.of(level))}{unit.symbol}", "showarrow": False, "font": {"size": 11}}
            anchor = {"x": 0.01, "y": unit.of(level), "xanchor": "left", "yanchor": "bottom"}
            layout["annotations"].append(text | place | anchor)
    return chart(traces, layout, 420)


def main_effects(screening: EffectsOf) -> Spec | None:
    """Small charts with one axis, the largest effects first; None if no effect could be estimated.

    The interval of a level's mean follows from that of the effect e = ȳ(high) − ȳ(low) of a balanced design: its
    half-width is that of e divided by √2.
    """
    analysis, unit = screening.analysis, unit_of_observable(screening.response)
    effects = analysis.factor_effects()[:MOST]
    if not effects or math.isnan(analysis.mean):
        return None
    titles = _titles(screening)
    middle = unit.of(analysis.mean)
    traces: list[Json] = []
    layout: Json = {"showlegend": False, "shapes": [], "annotations": []}
    rows = -(-len(effects) // ACROSS)
    for k, effect in enumerate(effects):
        shift = 0.5 * unit.of(effect.effect)
        width = unit.of(analysis.half_width(effect)) / 2**0.5
        place = {"xaxis": f"x{suffix(k)}", "yaxis": f"y{suffix(k)}"}
        drawn = {"mode": "lines+markers", "line": line(FACTOR), "error_y": error_bars([width, width], FACTOR)}
        name = effect.name
        hover = {"hovertemplate": label(name) + " %{x}: %{y:.4g}" + unit.symbol + "<extra></extra>"}
        traces.append(
            points(["low", "high"], [middle - shift, middle + shift], name, FACTOR, **drawn, **place, **hover)
        )
        layout |= _place(k, rows, titles[name])
        layout["shapes"].append(
            {"type": "line", "xref": f"x{suffix(k)} domain", "yref": f"y{suffix(k)}", "x0": 0, "x1": 1}
            | {"y0": middle, "y1": middle, "line": line(DUMMY, "dot")}
        )
    layout["yaxis"]["title"] = {"text": observable_title(screening.response)}
    return chart(traces, layout, 230 * rows)


def _place(k: int, rows: int, title: str) -> Json:
    width, height = (1.0 - GAP * (ACROSS - 1)) / ACROSS, (1.0 - ROW_GAP * (rows - 1)) / rows
    column, row = k % ACROSS, k // ACROSS
    left, top = column * (width + GAP), 1.0 - row * (height + ROW_GAP)
    x = axis(title, domain=[left, left + width], anchor=f"y{suffix(k)}", range=[-0.4, 1.4])
    x["title"]["font"] = {"size": 10}
    y = axis("", domain=[max(0.0, top - height), top], anchor=f"x{suffix(k)}", showticklabels=column == 0)
    return {f"xaxis{suffix(k)}": x, f"yaxis{suffix(k)}": y | ({"matches": "y"} if k else {})}


def all_effects(screening: ScreeningResult, assumptions: ScreeningResult | None) -> Spec:
    """Effects of factors and assumptions with 95 % intervals in one chart, sorted by size."""
    response = screening.response
    unit = unit_of_observable(response)
    groups = [("factors", screening, FACTOR, "circle")]
    if assumptions is not None:
        groups.append(("assumptions about the set-up", assumptions, ASSUMPTION, "diamond"))
    order: list[tuple[float, str]] = []
    traces = []
    for group, part, colour, symbol in groups:
        titles, analysis = _titles(part), part.analysis
        untestable = {entry.factor for entry in part.not_testable}
        effects = analysis.factor_effects()[::-1]
        order += [(abs(effect.effect), label(titles[effect.name])) for effect in effects]
        # A trace of its own for each mark: the legend shows the mark of a trace's first point.
        for name, mark, is_hollow in (
            (group, symbol, False),
            (f"{group}, not testable", f"{symbol}-open", True),
        ):
            shown = [effect for effect in effects if (effect.name in untestable) is is_hollow]
            if not shown:
                continue
            widths = [unit.of(analysis.half_width(effect)) for effect in shown]
            traces.append(
                points(
                    [unit.of(effect.effect) for effect in shown],
                    [label(titles[effect.name]) for effect in shown],
                    name,
                    colour,
                    marker={"symbol": mark},
                    error_x=error_bars(widths, colour),
                    hovertemplate="%{y}<br>%{x:+.3~g}" + unit.symbol + "<extra></extra>",
                )
            )
    layout: Json = {
        "xaxis": axis("effect, low → high, on " + observable_title(response), zeroline=True, zerolinewidth=1.5),
        "yaxis": axis("", categoryorder="array", categoryarray=[row for _, row in sorted(order)])
        | {"tickfont": {"size": 11}},
    }
    return chart(traces, layout, 130 + ROW_HEIGHT * len(order))


def _titles(part: EffectsOf) -> dict[str, str]:
    """Column → its text on the axis: name and parameter of a factor, name of a dummy."""
    parameters = {factor.name: parameter_label(factor.path) for factor in part.factors}
    return {
        column: f"{column} · {parameters[column]}" if column in parameters and "_" not in column
        # A name that spells out its parameter needs no second text.
        else column.replace("_", " ")
        for column in part.columns
    }  # fmt: skip


def _t(effect: FactorEffect, source: ErrorSource) -> float:
    """|t| of an effect against an error; NaN if it was not tested."""
    test = effect.test_by(source)
    return math.nan if test is None else abs(test.t)
