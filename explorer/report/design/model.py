"""The effects of a two-level design, and the fitted polynomial of any design: tests, equations, ANOVA, single runs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from doe.analysis.analyse import DesignAnalysis, FittedModel
from doe.analysis.contrasts import Curvature
from doe.analysis.few_terms import FewTermsModel
from doe.analysis.mixture import Blend, MixtureFit
from doe.analysis.model_adequacy import BoxCox, Diagnostics
from doe.analysis.screening import FactorEffect
from explorer.design.result import DesignResult, DrawnEffects, SheetFactor
from explorer.report.content import Block, Bullets, Facts, Figure, Folded, Section, Table, Text
from explorer.report.design.charts import box_cox_profile, single_runs
from explorer.report.figures.effects import half_normal, main_effects, pareto
from explorer.report.figures.model import MOST_PANELS, FittedTarget, profiler
from explorer.report.figures.surface import contours, fit, height_over, residual_quantiles
from explorer.report.sections.surface import anova_table, equation, variance_table
from explorer.units import (
    MISSING,
    counted,
    enumeration,
    fixed,
    number,
    observed,
    p_value,
    parameter_value,
    percent,
    term_text,
    with_sign,
)

MOST_ALIASES = 4
"""Effects sharing a column that are listed by name at most."""
MOST_DRAWN = 40
"""Contrasts in a chart at most; the table has all."""


def mixture(result: DesignResult) -> Section | None:
    """Scheffé's polynomial for components that add up to a whole; None for other designs."""
    found = result.analysis.mixture
    if found is None:
        return None
    text = Text(
        "The coefficient of a single part is the response where this part has all the room above the lows; that of a "
        "product says by how much two parts together differ from their mean (a quarter of it in equal shares)."
    )
    return Section("Mixture", (text, mixture_table(result, found), variance_table(found.rows)))


def mixture_table(result: DesignResult, found: MixtureFit) -> Table:
    """Coefficients of the polynomial with their errors."""
    rows = tuple(
        (term_text(term), observed(result.response.path, value), number(error), p_value(p))
        for term, value, error, p in zip(
            found.terms, found.coefficients.tolist(), found.standard_errors.tolist(), found.p.tolist(), strict=True
        )
    )
    return Table(("term", "coefficient", "standard error", "p"), rows, f"Scheffé's {found.order} polynomial.")


def blend_words(result: DesignResult, blend: Blend) -> str:
    """A blend and its response."""
    parts = [
        f"{one.name} = {parameter_value(one.path, amount)}"
        for one, amount in zip(result.factors, blend.amounts.tolist(), strict=True)
    ]
    return f"{observed(result.response.path, blend.predicted)} ± {number(blend.standard_error)} at {enumeration(parts)}"


def effects(result: DesignResult) -> Section | None:
    """Effects and their tests; None for a design that is not of two levels."""
    part = result.effects
    if part is None:
        return None
    drawn = _only(part, largest(part.analysis.effects))
    blocks: list[Block] = [
        Text(
            "An effect is the mean at the high level less the mean at the low one. Of an interaction it is half the "
            "difference of the effects of one factor at both levels of the other."
        ),
        Facts(tuple(_errors(part))),
    ]
    n = f"n = {result.runs.valid} runs in {result.runs.rows} rows"
    bars = pareto(drawn)
    if bars is not None:
        lines = f"{n}. Lines: the |t| at which p = 0.05 for one effect (dashed) and for all (solid, Bonferroni)."
        blocks.append(Figure("pareto", bars, lines))
    caption = (
        f"{n}. Noise alone would follow a straight line through the origin; what stands above it acts. Lines: Lenth’s "
        "margins, 95 %."
    )
    blocks.append(Figure("half-normal", half_normal(drawn), caption))
    chart = main_effects(_only(part, _of_factors(part)))
    if chart is not None:
        blocks.append(
            Figure("main-effects", chart, f"{n}. The largest ones; whiskers: 95 % intervals (t); dotted: mean.")
        )
    blocks.append(effect_table(part))
    if result.analysis.effects is not None and result.analysis.effects.few_terms:
        blocks += [Text("Few terms that explain the runs:"), few_terms_table(result.analysis.effects.few_terms)]
    if part.curvature is not None:
        blocks.append(Text(curvature(part.curvature, part.response)))
    if part.analysis.notes:
        blocks.append(Bullets(part.analysis.notes))
    return Section("Effects", tuple(blocks))


def largest(effects: Sequence[FactorEffect]) -> tuple[FactorEffect, ...]:
    """The effects for which a chart has room, in their order."""
    kept = {effect.name for effect in sorted(effects, key=_rank)[:MOST_DRAWN]}
    return tuple(effect for effect in effects if effect.name in kept)


def effect_table(part: DrawnEffects) -> Table:
    """All contrasts by decreasing size."""
    rows = []
    for effect in sorted(part.analysis.effects, key=_rank):
        name, deciding = effect.name, part.analysis.deciding_test(effect)
        by_replicates, by_columns = effect.by_replicates, effect.by_dummies
        rows.append(
            (
                term_text(name) + (" (error)" if effect.is_dummy else ""),
                also_holds(part.aliases.get(name, ())),
                with_sign(number(effect.effect or 0.0, 5)),
                number(effect.sum_of_squares, 5),
                fixed(effect.contribution_percent, 2),
                MISSING if by_replicates is None else p_value(by_replicates.p),
                MISSING if by_columns is None else p_value(by_columns.p),
                MISSING if deciding is None else p_value(deciding.p_holm),
            )
        )
    header = (
        *("effect", "also holds", "size", "sum of squares", "share [%]"),
        *("p replicates", "p columns", "p Holm"),
    )
    caption = "Sums of squares of row means; p columns: against the columns marked as error."
    return Table(header, tuple(rows), caption)


def also_holds(aliases: Sequence[str]) -> str:
    """What else shares the column of an effect; many aliases of one size are counted."""
    parts = {one.lstrip("-").partition(" ")[0] for one in aliases if " " in one}
    if len(aliases) > MOST_ALIASES and len(parts) == 1:
        return f"±{parts.pop()} of {len(aliases)} interactions"
    return ", ".join(aliases).replace("*", " × ").replace("-", "−") or MISSING


def few_terms_table(models: Sequence[FewTermsModel]) -> Table:
    """Models with few terms, the best first."""
    rows = tuple(
        (
            " ".join(
                f"{with_sign(number(b, 4))} {term.replace('*', ' × ')}"
                for term, b in zip(one.terms, one.coefficients[1:], strict=True)
            ),
            *(fixed(value, 4) for value in (one.r_squared, one.r_squared_adjusted)),
            fixed(one.aicc, 1),
            p_value(one.p),
        )
        for one in models
    )
    caption = (
        "Searched among all models of up to three main effects and interactions, each interaction beside one of its "
        "factors; coefficients, coded. p: share of permuted responses whose best model of that size explains as much. "
        "Runs that tell them apart should confirm the choice."
    )
    return Table(("model", "R²", "adjusted", "AICc", "p"), rows, caption)


def curvature(found: Curvature, response: str) -> str:
    """The test of the centre runs, in a sentence."""
    return (
        f"Curvature: the corners lie {observed(response, found.difference)} from the centre runs "
        f"(F = {number(found.f)} on 1 and {counted(found.df_error, 'degree of freedom')}, p = {p_value(found.p)})."
    )


def _rank(effect: FactorEffect) -> float:
    return -abs(effect.effect) if math.isfinite(effect.effect) else 0.0


def _of_factors(part: DrawnEffects) -> tuple[FactorEffect, ...]:
    names = {factor.name for factor in part.factors}
    return tuple(effect for effect in part.analysis.effects if effect.name in names)


def _only(part: DrawnEffects, effects: tuple[FactorEffect, ...]) -> DrawnEffects:
    return replace(part, analysis=replace(part.analysis, effects=effects))


def _errors(part: DrawnEffects) -> list[tuple[str, str]]:
    analysis, response = part.analysis, part.response
    lenth = analysis.lenth
    found = [
        (
            "Lenth",
            f"pseudo standard error {number(lenth.pseudo_standard_error, 4)}, margin {number(lenth.margin, 4)}, "
            f"for all effects at once {number(lenth.simultaneous_margin, 4)}",
        )
    ]
    for error, title, of in (
        (analysis.pure_error, "Error by replicates", "σ of a run"),
        (analysis.dummy_error, "Error by columns without a factor", "σ of a row's mean"),
    ):
        if error is not None:
            found.append(
                (
                    title,
                    f"{of} = {observed(response, error.sigma)}, {counted(error.df, 'degree of freedom')}; margin of "
                    f"one effect {observed(response, error.margin)}, of all "
                    f"{observed(response, error.margin_bonferroni)}; seen with chance 0.8: "
                    f"{observed(response, error.smallest_detectable_effect)}",
                )
            )
    return found


def model(result: DesignResult) -> Section | None:
    """Equations, analysis of variance and charts; None if the runs support no model."""
    found, fitted = result.analysis.model, result.fitted
    if found is None or fitted is None:
        return None
    anova, response = found.anova, result.response.path
    coded, actual = equation(found.surface, result.factors, response)
    blocks: list[Block] = [
        fit_summary(result.analysis),
        Facts(
            (
                ("Equation, coded", f"{coded} (each factor from −1 to +1)"),
                ("Equation, actual", actual + units_of_factors(result.factors)),
                ("R²", f"{fixed(anova.r_squared, 4)}; adjusted {fixed(anova.r_squared_adjusted, 4)}; predicted "
                       f"{fixed(anova.r_squared_predicted, 4)} (PRESS {number(anova.press, 4)}), by whole rows "
                       f"{fixed(anova.r_squared_predicted_by_row, 4)}"),
                ("Scatter", f"σ = {observed(response, anova.sigma)}, mean {observed(response, anova.mean)}, "
                            f"coefficient of variation {percent(anova.cv_percent / 100, 2)}"),
                ("Adequate precision", f"{fixed(anova.adequate_precision)} (above 4 is wanted)"),
            )
        ),
        anova_table(anova),
        coefficient_table(found),
    ]  # fmt: skip
    if anova.notes:
        blocks.append(Bullets(anova.notes))
    return Section("Model", (*blocks, *_charts(fitted)))


def units_of_factors(factors: Sequence[SheetFactor]) -> str:
    """Units of an equation's letters, in brackets; empty for plain numbers."""
    units = [f"{factor.name} in {factor.unit}" for factor in factors if factor.unit]
    return f" ({', '.join(units)})" if units else ""


def fit_summary(analysis: DesignAnalysis) -> Table:
    """The three orders of polynomial side by side."""
    rows = []
    for one in analysis.fits:
        if not one.estimable:
            rows.append((one.order, str(one.terms), *([MISSING] * 7)))
            continue
        rows.append(
            (
                *(one.order, str(one.terms), str(one.df_residual), p_value(one.p)),
                *(p_value(one.lack_of_fit_p), number(one.sigma, 4)),
                *(fixed(r2, 4) for r2 in (one.r_squared, one.r_squared_adjusted, one.r_squared_predicted)),
            )
        )
    header = (
        *("order", "terms", "df of the error", "p of what it adds", "p lack of fit", "σ"),
        *("R²", "adjusted", "predicted"),
    )
    return Table(header, tuple(rows), "What these runs can bear; – where they cannot separate the terms.")


def coefficient_table(found: FittedModel) -> Table:
    """Coded and actual coefficients of the model's terms."""
    fitted = found.surface
    rows = tuple(
        (term_text(term), number(coded, 5), f"± {number(error, 3)}", number(actual, 6))
        for term, is_in, coded, error, actual in zip(
            fitted.terms,
            fitted.included,
            fitted.coefficients,
            found.anova.coefficient_standard_errors,
            fitted.coefficients_natural,
            strict=True,
        )
        if is_in
    )
    return Table(("term", "coded", "standard error", "actual"), rows)


def diagnostics(result: DesignResult) -> Section | None:
    """Whether any run disagrees with the model, and whether another scale of the response would be better."""
    model, fitted = result.analysis.model, result.fitted
    if model is None or fitted is None:
        return None
    found, labels = model.diagnostics, result.labels
    n = f"n = {result.runs.valid} runs"
    facts = [
        ("Outliers", _which(found.outliers, labels, f"|studentised residual| > {number(found.outlier_limit)}, "
                                                       "p = 0.05 for the largest of all")),
        ("Influence", _which(found.influential, labels, "Cook's distance > 1")),
        ("Leverage", _leverage(found, labels)),
        ("Normality of the residuals", f"Shapiro–Wilk p = {p_value(found.shapiro_p)}"),
        ("Box–Cox", box_cox_words(model.box_cox)),
    ]  # fmt: skip
    blocks: list[Block] = [
        Facts(tuple(facts)),
        Figure("fit", fit(fitted), f"{n}, one mark each; residuals are studentized externally."),
        Figure(
            "residual-quantiles",
            residual_quantiles(fitted),
            f"{n}. Ordered studentized residuals against Student’s t: those of a right model with normal noise follow "
            "the line.",
        ),
        Figure("single-runs", single_runs(found, labels), f"{n}, by row of the sheet. Dashed: the limits named above."),
    ]
    profile = box_cox_profile(model.box_cox)
    if profile is not None:
        caption = f"{n}. Box–Cox profile; band: 95 % interval; red: the best power; dashed: no transformation."
        blocks.append(Figure("box-cox", profile, caption))
    return Section("Diagnostics", (*blocks, Folded("All runs against the model", (run_table(result, model),))))


def run_table(result: DesignResult, model: FittedModel) -> Table:
    """Every run with its residual and its weight in the fit."""
    fitted, found, response = model.surface, model.diagnostics, result.response.path
    rows = tuple(
        (
            label,
            observed(response, fitted.observed[k]),
            observed(response, fitted.predicted[k]),
            number(found.residual[k]),
            number(found.leverage[k]),
            number(found.internal[k]),
            number(found.external[k]),
            number(found.cooks_distance[k]),
            number(found.dffits[k]),
        )
        for k, label in enumerate(result.labels)
    )
    header = (
        *("run", "observed", "predicted", "residual", "leverage", "internally studentised"),
        *("externally studentised", "Cook's distance", "DFFITS"),
    )
    return Table(header, rows)


def box_cox_words(found: BoxCox) -> str:
    """The profile in words."""
    if found.note:
        return f"no profile: {found.note}"
    ends = (found.powers[0], found.powers[-1])
    best, low, high = (
        f"{number(power)} or beyond" if power in ends else number(power)
        for power in (found.best, found.low, found.high)
    )
    where = f"best power {best}, 95 % {low} … {high} (t² of the residual degrees of freedom)"
    if found.suggestion == "none":
        return f"{where}; it holds 1, so the response stays as it is"
    return f"{where}; it does not hold 1: {found.suggestion} would fit better"


def _charts(fitted: FittedTarget) -> list[Block]:
    where = "the middle" if fitted.optimum is None else "the chosen setting"
    n = f"n = {len(fitted.model.observed)} runs"
    caption = f"{n}. Fitted model along each factor through {where}; band: 95 % of the mean (t)."
    blocks: list[Block] = [Figure("profiler", profiler(fitted, fitted.section_point), caption)]
    if 2 <= len(fitted.factors) <= MOST_PANELS:
        caption = f"{n}. Fitted model through {where}; the points of the design are projected on each panel."
        blocks.append(Figure("contours", contours(fitted), caption))
        blocks.append(
            Figure(
                "surface",
                height_over(fitted, (0, 1)),
                f"{n}, drawn at their own height. Fitted model over A and B through {where}.",
            )
        )
    elif len(fitted.factors) > MOST_PANELS:
        blocks.append(Text(f"Contours are drawn for up to {MOST_PANELS} factors; `--only` keeps the ones that act."))
    return blocks


def _leverage(found: Diagnostics, labels: Sequence[str]) -> str:
    limit = found.leverage_limit
    if limit >= 1.0:
        # A leverage is at most one; with so many terms per run, the rule says nothing.
        return f"at most {number(found.leverage.max())}; too few runs per term for the rule 2p/n"
    return _which(found.leveraged, labels, f"above 2p/n = {number(limit)}")


def _which(positions: Sequence[int], labels: Sequence[str], rule: str) -> str:
    return f"{enumeration([f'run {labels[k]}' for k in positions])} ({rule})"
