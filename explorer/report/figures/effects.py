"""Charts of a screening: Pareto of |t|, half-normal plot, and all effects of factors and assumptions side by side."""

from __future__ import annotations

from scipy import stats

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
    label,
    note,
    points,
    side_by_side,
    suffix,
    vertical_line,
)
from explorer.report.findings import ERROR_KEYS, ErrorName, Plain, factor_effects, half_width, t_of
from explorer.report.units_for_people import fixed, number, observable_title, parameter_label, unit_of_observable

ROW_HEIGHT = 19
"""Height of one bar or interval [px]."""
LABELLED = 12
"""Effects that carry their name in the half-normal plot; the smaller ones overlap and tell it by hover."""


def pareto(screening: Plain) -> Spec | None:
    """|t| of every column against each error, with the limits for one factor and for all; None without an error."""
    errors = errors_at_hand(screening)
    return pareto_against(screening, errors) if errors else None


def errors_at_hand(screening: Plain) -> list[ErrorName]:
    """The errors against which effects can be judged, the deciding one first."""
    return [e for e in ("replicates", "dummies") if _testable(screening["analysis"], e)]


def pareto_against(screening: Plain, errors: list[ErrorName]) -> Spec:
    """The same against ``errors``, side by side; there has to be one."""
    analysis = screening["analysis"]
    effects = sorted(analysis["effects"], key=lambda effect: t_of(effect, errors[0]) or -1.0)
    titles = _titles(screening)
    rows = [label(titles[effect["name"]]) for effect in effects]
    colours = [DUMMY if effect["is_dummy"] else FACTOR for effect in effects]
    domains = side_by_side(len(errors))
    traces: list[Json] = []
    layout: Json = {"showlegend": False, "shapes": [], "annotations": [], "bargap": 0.3}
    layout["yaxis"] = axis("", tickfont={"size": 11}) | {"domain": [0, 0.96]}
    for k, error in enumerate(errors):
        estimate = analysis[ERROR_KEYS[error]]
        sizes = [t_of(effect, error) for effect in effects]
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
        title = f"|t| against the {error} ({estimate['df']} degrees of freedom)"
        layout[f"xaxis{suffix(k)}"] = axis(title, domain=domains[k], rangemode="tozero", anchor="y")
        limits = (("t_limit", "one factor", "dash"), ("t_limit_bonferroni", "all factors", "solid"))
        for (key, words, dash), anchor in zip(limits, ("right", "left"), strict=True):
            layout["shapes"].append(_limit(estimate[key], k, dash))
            text = f"{words}: {fixed(estimate[key])}"
            layout["annotations"].append(note(text, estimate[key], 1.0, 0, xanchor=anchor, yanchor="bottom"))
            layout["annotations"][-1]["xref"] = f"x{suffix(k)}"
    return chart(traces, layout, 110 + ROW_HEIGHT * len(rows))


def half_normal(screening: Plain) -> Spec:
    """|effect| over the quantile that the same rank has in half-normal noise, with Lenth's margins."""
    analysis = screening["analysis"]
    unit = unit_of_observable(screening["response"])
    known = [effect for effect in analysis["effects"] if effect["effect"] is not None]
    known = sorted(known, key=lambda effect: abs(effect["effect"]))
    quantile = [float(stats.halfnorm.ppf((k + 0.5) / len(known))) for k in range(len(known))]
    traces = []
    for is_dummy, name, colour in ((False, "factors", FACTOR), (True, "dummies", DUMMY)):
        chosen = [k for k, effect in enumerate(known) if effect["is_dummy"] is is_dummy]
        if chosen:
            sizes = [unit.of(abs(known[k]["effect"])) for k in chosen]
            names = [label(known[k]["name"]) for k in chosen]
            shown = [name if k >= len(known) - LABELLED else "" for k, name in zip(chosen, names, strict=True)]
            more = {"mode": "markers+text", "text": shown, "textposition": "middle left", "textfont": {"size": 11}}
            more |= {"customdata": names, "hovertemplate": "%{customdata}: %{y:.2f}<extra></extra>"}
            traces.append(points([quantile[k] for k in chosen], sizes, name, colour, **more))
    margins = {"Lenth's margin, one effect": "margin", "all effects": "simultaneous_margin"}
    layout: Json = {
        "xaxis": axis("half-normal quantile", range=[-0.12, max(quantile) * 1.08]),
        "yaxis": axis("|effect| on " + observable_title(screening["response"]), rangemode="tozero"),
        "shapes": [],
        "annotations": [],
    }
    for (words, key), dash in zip(margins.items(), ("dash", "solid"), strict=True):
        level = analysis["lenth"][key]
        if level is not None:
            place = {"xref": "x domain", "yref": "y"}
            stroke = {"color": DUMMY, "dash": dash, "width": 1.2}
            layout["shapes"].append(
                {"type": "line", **place, "x0": 0, "x1": 1, "y0": unit.of(level), "y1": unit.of(level), "line": stroke}
            )
            text = {"text": f"{words} {number(unit.of(level))}{unit.symbol}", "showarrow": False, "font": {"size": 11}}
            anchor = {"x": 0.01, "y": unit.of(level), "xanchor": "left", "yanchor": "bottom"}
            layout["annotations"].append(text | place | anchor)
    return chart(traces, layout, 420)


def all_effects(result: Plain) -> Spec:
    """Effects of factors and assumptions with 95 % intervals in one chart, sorted by size."""
    response = result["screening"]["response"]
    unit = unit_of_observable(response)
    groups = [("factors", result["screening"], FACTOR, "circle")]
    if result["assumptions"] is not None:
        groups.append(("assumptions about the set-up", result["assumptions"], ASSUMPTION, "diamond"))
    order: list[tuple[float, str]] = []
    traces = []
    for group, part, colour, symbol in groups:
        titles, analysis = _titles(part), part["analysis"]
        untestable = {entry["factor"] for entry in part["not_testable"]}
        effects = factor_effects(analysis)[::-1]
        order += [(abs(effect["effect"]), label(titles[effect["name"]])) for effect in effects]
        # A trace of its own for each mark: the legend shows the mark of a trace's first point.
        for name, mark, is_hollow in (
            (group, symbol, False),
            (f"{group}, not testable", f"{symbol}-open", True),
        ):
            shown = [effect for effect in effects if (effect["name"] in untestable) is is_hollow]
            if not shown:
                continue
            widths = [half_width(analysis, effect) for effect in shown]
            traces.append(
                points(
                    [unit.of(effect["effect"]) for effect in shown],
                    [label(titles[effect["name"]]) for effect in shown],
                    name,
                    colour,
                    marker={"symbol": mark},
                    error_x=error_bars([None if w is None else unit.of(w) for w in widths], colour),
                    hovertemplate="%{y}<br>%{x:+.2f}" + unit.symbol + "<extra></extra>",
                )
            )
    layout: Json = {
        "xaxis": axis("effect, low → high, on " + observable_title(response), zeroline=True, zerolinewidth=1.5),
        "yaxis": axis("", categoryorder="array", categoryarray=[row for _, row in sorted(order)])
        | {"tickfont": {"size": 11}},
    }
    return chart(traces, layout, 130 + ROW_HEIGHT * len(order))


def _titles(part: Plain) -> dict[str, str]:
    """Column → what stands on the axis: name and parameter of a factor, name of a dummy."""
    parameters = {factor["name"]: parameter_label(factor["path"]) for factor in part["factors"]}
    return {
        column: f"{column} · {parameters[column]}" if column in parameters and "_" not in column
        # A name that spells its parameter out needs no second wording.
        else column.replace("_", " ")
        for column in part["columns"]
    }  # fmt: skip


def _testable(analysis: Plain, error: ErrorName) -> bool:
    return analysis[ERROR_KEYS[error]] is not None and any(t_of(e, error) is not None for e in analysis["effects"])


def _limit(t: float, panel: int, dash: str) -> Json:
    shape = vertical_line(t, CHOSEN, panel, dash)
    return shape | {"yref": "y domain"}
