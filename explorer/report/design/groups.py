"""Randomly drawn groups: variance components, tests against the right error, and the groups themselves."""

from __future__ import annotations

import math

from doe.analysis.random_groups import RandomFit
from explorer.design.result import DesignResult
from explorer.report.content import Block, Facts, Figure, Folded, Section, Spec, Table, Text
from explorer.report.design.names import means_table
from explorer.report.figures.style import FACTOR, axis, chart, horizontal_line, label, points
from explorer.units import enumeration, number, observable_title, observed, p_value, percent, term_text, with_sign

ACTS = 0.05


def groups(result: DesignResult) -> Section | None:
    """The model with random groups; None without them."""
    found = result.analysis.random
    if found is None:
        return None
    blocks: list[Block] = [
        Text(
            "The groups are taken as drawn at random from many, so that the answer is about all of them. Variances by "
            "restricted maximum likelihood (REML); every term is tested by F with Satterthwaite’s degrees of freedom "
            "of its own error: the scatter between groups where it is constant within them."
        ),
        Facts(tuple(group_facts(result, found))),
        components_table(result, found),
        tests_table(found),
        estimates_table(found),
    ]
    if found.means:
        blocks.append(means_table(result, found.means))
    n = f"n = {result.runs.valid} runs in {len(found.groups)} groups"
    caption = f"{n}. Predicted effects of the groups, shrunk towards zero by their own scatter."
    blocks += [Figure("groups", group_chart(result, found), caption)]
    return Section("Groups", (*blocks, Folded("All groups", (groups_table(found),))))


def group_facts(result: DesignResult, found: RandomFit) -> list[tuple[str, str]]:
    """What acts, and which share of the scatter lies between the groups."""
    acting = enumeration([term_text(one.source) for one in found.tests if one.p < ACTS])
    between, within = found.components
    response = result.response.path
    return [
        ("Terms that act", f"{acting} (p < 0.05 each alone, of {len(found.tests)} terms)"),
        (
            "Between groups",
            f"sd {observed(response, between.sd)}, {percent(between.share)} of the variance of one run; is it there at "
            f"all: p = {p_value(found.p_groups)}",
        ),
        ("Within a group", f"sd {observed(response, within.sd)}"),
    ]


def components_table(result: DesignResult, found: RandomFit) -> Table:
    """Both variances and standard deviations with their intervals."""
    rows = []
    for one in found.components:
        ends = [observed(result.response.path, math.sqrt(end)) for end in (one.low, one.high)]
        cells = (one.name, number(one.variance, 4), f"{number(one.low, 4)} … {number(one.high, 4)}")
        rows.append((*cells, observed(result.response.path, one.sd), " … ".join(ends), percent(one.share)))
    header = ("component", "variance", "95 %", "sd", "95 %", "share")
    return Table(header, tuple(rows), "Intervals: profile of the restricted likelihood.")


def tests_table(found: RandomFit) -> Table:
    """Every term against its own error."""
    rows = tuple(
        (
            term_text(one.source),
            str(one.df),
            number(one.df_error, 4),
            number(one.f),
            p_value(one.p),
        )
        for one in found.tests
    )
    return Table(("source", "df", "df of the error", "F", "p"), rows, "Each term beside all others.")


def estimates_table(found: RandomFit) -> Table:
    """Coefficients of numerical factors, and of factors with two names (−1 and +1)."""
    rows = tuple(
        (
            term_text(one.term),
            number(one.value, 5),
            f"± {number(one.standard_error)}",
            number(one.df, 4),
            p_value(one.p),
        )
        for one in found.coefficients
    )
    return Table(("term", "coded", "standard error", "df", "p"), rows, "Generalised least squares, coded.")


def groups_table(found: RandomFit) -> Table:
    """Every group: its runs and its predicted effect."""
    rows = tuple(
        (name, str(runs), with_sign(number(effect, 4)))
        for name, runs, effect in zip(found.groups, found.runs_of_group.tolist(), found.effects.tolist(), strict=True)
    )
    return Table(("group", "runs", "effect"), rows)


def group_chart(result: DesignResult, found: RandomFit) -> Spec:
    """The predicted effects of the groups, with the standard deviation between them."""
    sd = found.components[0].sd
    traces = [points([label(name) for name in found.groups], found.effects.tolist(), "effect", FACTOR)]
    layout = {
        "showlegend": False,
        "xaxis": axis("group", type="category"),
        "yaxis": axis(f"effect on {observable_title(result.response.path)}"),
        "shapes": [horizontal_line(sign * sd, FACTOR, 0, "dash") for sign in (-1, 1)],
    }
    return chart(traces, layout, 320)
