"""Elementary effects of a Morris design: a table by size, and mu* against sigma."""

from __future__ import annotations

from doe.analysis.elementary_effects import ElementaryEffects
from explorer.design.result import DesignResult
from explorer.report.content import Block, Facts, Figure, Section, Spec, Table, Text
from explorer.report.figures.style import FACTOR, axis, chart, error_bars, finite, label, points
from explorer.units import enumeration, number, observable_title, observed, p_value, parameter_label, with_sign

MOST_NAMED = 5


def elementary(result: DesignResult) -> Section | None:
    """Effects of single steps; None for another design."""
    found = result.analysis.elementary
    if found is None:
        return None
    n = f"n = {found.steps - found.lost} steps of one factor each"
    blocks: list[Block] = [
        Text(
            "An elementary effect is what one step of one factor does to the response, carried on from low to high. μ* "
            "is the mean of their sizes: how much a factor acts. σ is their scatter: none where it acts linearly and "
            "alone, much where it bends, acts together with others, or where single runs are noisy."
        ),
        Facts(tuple(elementary_facts(found))),
        Figure("morris", morris_chart(result, found), f"{n}. Bars: 95 % of μ* (t)."),
        elementary_table(result, found),
    ]
    return Section("Elementary effects", tuple(blocks))


def told(found: ElementaryEffects) -> list[str]:
    """Factors whose mean effect differs significantly from zero, judged all at once."""
    return [one.factor for one in found.effects if one.p_holm < 0.05]


def elementary_words(found: ElementaryEffects) -> str:
    """The largest factors, and which differ significantly from zero."""
    largest = ", ".join(f"{one.factor} {number(one.mu_star)}" for one in found.ranked[:MOST_NAMED])
    return f"by μ* {largest}; mean effect told from zero: {enumeration(told(found))} (p < 0.05 after Holm's correction)"


def elementary_facts(found: ElementaryEffects) -> list[tuple[str, str]]:
    """Which factors act, and which act non-linearly or together with others."""
    bent = [one.factor for one in found.effects if one.sigma > one.mu_star > 0]
    return [
        ("Elementary effects", elementary_words(found)),
        ("Scatter above the effect (σ > μ*)", f"{enumeration(bent)}: bent, with others, or no more than noise"),
        ("Steps", f"{found.steps}, {found.lost} of them with a missing run"),
    ]


def elementary_table(result: DesignResult, found: ElementaryEffects) -> Table:
    """Every factor, the largest mu* first."""
    response, title = result.response.path, {factor.name: factor.path for factor in result.factors}
    rows = tuple(
        (
            one.factor,
            parameter_label(title[one.factor]),
            str(len(one.effects)),
            f"{observed(response, one.mu_star)} ± {number(one.mu_star_half_width)}",
            with_sign(number(one.mu, 4)),
            number(one.sigma, 4),
            number(one.sigma / one.mu_star if one.mu_star else None),
            p_value(one.p),
            p_value(one.p_holm),
        )
        for one in found.ranked
    )
    header = ("letter", "factor", "steps", "μ*", "μ", "σ", "σ/μ*", "p of μ", "p Holm")
    return Table(header, rows, "From low to high.")


def morris_chart(result: DesignResult, found: ElementaryEffects) -> Spec:
    """mu* against sigma, one point per factor."""
    marks = points(
        finite([one.mu_star for one in found.effects]),
        finite([one.sigma for one in found.effects]),
        "factor",
        FACTOR,
        mode="markers+text",
        text=[label(one.factor) for one in found.effects],
        textposition="top center",
        error_x=error_bars([one.mu_star_half_width for one in found.effects], FACTOR),
    )
    title = observable_title(result.response.path)
    layout = {"showlegend": False, "xaxis": axis(f"μ* of {title}"), "yaxis": axis("σ")}
    return chart([marks], layout, 380)
