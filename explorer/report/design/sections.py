"""Sections of the report of a design, in the order of the page: what was found, then how."""

from __future__ import annotations

import math
import shlex
from collections.abc import Callable, Sequence

import numpy as np

from doe.analysis.canonical import Canonical, RidgePath
from doe.analysis.screening import Screening
from doe.analysis.surface_anova import AnovaRow
from doe.analysis.t_tests import Sample
from doe.stages.surface import OptimumResult
from explorer.design.result import DesignResult
from explorer.report.content import Banner, Block, Caution, Code, Facts, Figure, Section, Table, Text, Word
from explorer.report.design.charts import ridge
from explorer.report.design.elementary import elementary, elementary_facts, elementary_words, told
from explorer.report.design.groups import ACTS, group_facts, groups
from explorer.report.design.model import blend_words, diagnostics, effects, mixture, model, units_of_factors
from explorer.report.design.names import fit_facts, names, target_words
from explorer.report.design.surrogate import better_words, surrogate, target_facts
from explorer.report.figures.model import MOST_PANELS, cloud, ranges
from explorer.report.figures.surface import solutions
from explorer.report.identified import GIVES_TARGET, cloud_caution, rule, settings
from explorer.report.methods import design_methods
from explorer.report.sections.optimum import ranges_caption
from explorer.report.sections.surface import equation
from explorer.units import (
    MISSING,
    enumeration,
    fixed,
    number,
    observed,
    observed_number,
    p_value,
    parameter_label,
    parameter_value,
    percent,
    term_text,
    with_sign,
)

WHOLE = ("block", "model", "residual", "lack_of_fit", "pure_error", "total")
"""Rows of an analysis of variance that are not terms."""
REPEAT_RUNS = "Repeat runs: replicates or centre runs show how large the noise is."


def target(result: DesignResult) -> Section | None:
    """The settings that give the target; None if no target was given, or none were found."""
    fitted, optimum, response = result.fitted, result.optimum, result.response.path
    if fitted is None or optimum is None:
        return None
    found = optimum.single

    def between(low: float, high: float) -> str:
        return f"{observed(response, low)} … {observed(response, high)}"

    mean = between(found.predicted_low, found.predicted_high)
    facts = [
        ("Answer", found.statement),
        ("Model there", f"{observed(response, found.predicted)}, 95 % of the mean {mean}"),
        ("Reachable in the region", between(found.reachable_low, found.reachable_high)),
        ("Compatible with the target", f"{percent(found.compatible_share)} of the region, at 95 %"),
    ]  # fmt: skip
    further = result.analysis.at_target
    if further is not None:
        facts += [
            ("One further run there", f"± {number(further.one_run)} about the model, 95 %"),
            ("95 % of all further runs", f"± {number(further.most_runs)} about the model, with a confidence of 95 %"),
        ]
    if not found.target_standard_error:
        facts.append(("The target itself", "taken as exact; `--target-error` states its standard error"))
    blocks: list[Block] = [Facts(tuple(facts)), settings_table(result, optimum)]
    n = f"n = {result.runs.valid} runs in {result.runs.rows} rows"
    surface = solutions(fitted)
    if surface is not None:
        blocks.append(
            Figure(
                "solutions", surface, f"{n}. Every setting on the green surface gives the target in the fitted model."
            )
        )
    blocks.append(Figure("ranges", ranges(fitted), ranges_caption(optimum, n)))
    if 1 < len(result.factors) <= MOST_PANELS:
        caption = (
            f"n = {len(found.bootstrap_points)} refits to resampled {found.resampling} (bootstrap); each dot is the "
            f"solution nearest the reference. {percent(found.share_reached)} of the refits reach the target. "
            + cloud_caution(optimum)
        )
        blocks.append(Figure("cloud", cloud(fitted), caption.rstrip()))
    return Section("Target", tuple(blocks))


def settings_table(result: DesignResult, optimum: OptimumResult) -> Table:
    """Every factor at the target: its value if it is identified, the range that gives the target, its reference."""
    rows = tuple(
        (*setting.cells, parameter_value(factor.path, factor.reference))
        for setting, factor in zip(settings(optimum), result.factors, strict=True)
    )
    header = ("letter", "factor", "identified", GIVES_TARGET, "of low … high", "setting", "95 % set", "reference")
    nearest = "Of all settings that give the target, the one nearest the reference."
    return Table(header, rows, rule(optimum, "reference") or nearest)


def shape(result: DesignResult) -> Section | None:
    """Canonical analysis of a full second-order model, and the path of steepest ascent of any model."""
    model, response = result.analysis.model, result.response.path
    if model is None:
        return None
    canonical = model.canonical
    blocks: list[Block] = []
    if canonical is None:
        blocks.append(Text("The model has not all squares, and so no stationary point of its own."))
    else:
        blocks += [Facts(tuple(_stationary(result, canonical))), axes_table(result, canonical)]
    for path, words in ((model.highest, "highest"), (model.lowest, "lowest")):
        blocks.append(path_table(result, path, words, response))
    caption = (
        f"n = {result.runs.valid} runs. Band: 95 % of the mean (t). The path ends at the distance of the furthest run "
        "and may leave low … high."
    )
    return Section("Shape and ridge", (*blocks, Figure("ridge", ridge(result, model), caption)))


def axes_table(result: DesignResult, canonical: Canonical) -> Table:
    """Eigenvalues with the directions of these curvatures of the surface."""
    rows = tuple(
        (number(value, 4), *(number(direction[k], 3) for direction in canonical.eigenvectors))
        for k, value in enumerate(canonical.eigenvalues)
    )
    header = ("eigenvalue", *(factor.name for factor in result.factors))
    return Table(header, rows, "Canonical axes, coded: y = y_s + Σ eigenvalue · w².")


def path_table(result: DesignResult, path: RidgePath, words: str, response: str) -> Table:
    """The extreme on spheres of growing radius."""
    rows = tuple(
        (
            number(radius),
            *(parameter_value(f.path, value) for f, value in zip(result.factors, natural, strict=True)),
            observed(response, mean),
            "–" if math.isnan(error) else f"± {number(error)}",
        )
        for radius, natural, mean, error in zip(
            path.radius, path.natural.tolist(), path.predicted, path.standard_error, strict=True
        )
    )
    header = ("distance", *(factor.name for factor in result.factors), "model", "standard error")
    return Table(header, rows, f"Ridge: the {words} response at a distance from the centre [half-widths].")


def _stationary(result: DesignResult, canonical: Canonical) -> list[tuple[str, str]]:
    kind = canonical.kind
    if kind == "ridge":
        return [("Stationary point", "none: a ridge, at least one eigenvalue is zero")]
    place = "inside" if canonical.inside else "outside"
    at = [
        f"{f.name} = {parameter_value(f.path, value)}"
        for f, value in zip(result.factors, canonical.stationary_natural.tolist(), strict=True)
    ]
    coded = ", ".join(number(value, 4) for value in canonical.stationary_coded)
    return [
        ("Stationary point", f"a {kind} {place} the region: {enumeration(at)} (coded {coded})"),
        ("Model there", observed(result.response.path, canonical.stationary_response)),
    ]


def sections_of(result: DesignResult) -> tuple[Section, ...]:
    """Every section for which ``result`` has content."""
    found = (make(result) for make in SECTIONS)
    return tuple(section for section in found if section is not None)


def banner(result: DesignResult) -> Banner:
    """The settings for the target if one was given, else what acts."""
    found, response = result.analysis, result.response.path
    optimum = result.optimum
    if optimum is not None:
        open_ = [one.name for one in settings(optimum) if not one.identified]
        single = optimum.single
        if not single.reached:
            reach = f"{observed(response, single.reachable_low)} … {observed(response, single.reachable_high)}"
            return Banner(
                Word.OUT_OF_REACH,
                "",
                f"No setting of the region gives {observed(response, single.target)}: the model reaches {reach}.",
                "Make runs beyond low … high of the factors that act, or look for a factor that is missing.",
            )
        if found.model is not None and not found.model.anova.better_than_noise:
            return Banner(
                Word.NO_ANSWER,
                "",
                "The model is not better than noise, so the setting for the target is a point and no answer.",
                REPEAT_RUNS,
            )
        return Banner(
            Word.TARGET_REACHED,
            observed(response, single.target),
            single.statement,
            f"Take the ranges of {enumeration(open_)} as the answer; a second response, or more runs, would fix them."
            if open_
            else "Run the setting found, a few times, and compare.",
        )
    if found.surrogate_target is not None:
        words = target_facts(result, found.surrogate_target)[0][1]
        if not found.surrogate_target.reached:
            return Banner(Word.OUT_OF_REACH, "", f"By the process: {words}.", "Make runs beyond low … high.")
        of = observed(response, found.surrogate_target.target)
        return Banner(Word.TARGET_REACHED, of, f"By the process: {words}.", "Run the setting found, and compare.")
    if found.named is not None and result.target is not None and any(one.setting for one in found.named.groups):
        words = target_words(result, found.named)
        if not any(one.setting and one.setting.reached for one in found.named.groups):
            what = f"The model gives {observed(response, result.target)} with {words}."
            return Banner(Word.OUT_OF_REACH, "", what, "Make runs beyond low … high, or with other names.")
        return Banner(Word.TARGET_REACHED, observed(response, result.target), f"With {words}.", "Run one of them.")
    acts = _acting_names(result)
    if acts:
        return Banner(
            Word.EFFECT_FOUND,
            enumeration(acts),
            f"Of {result.runs.valid} runs: {acting_words(result)}.",
            _then(result),
        )
    if not _tested(result):
        return Banner(Word.NO_ANSWER, "", f"Of {result.runs.valid} runs: {acting_words(result)}.", REPEAT_RUNS)
    return Banner(
        Word.NO_EFFECT,
        "",
        f"Of {result.runs.valid} runs: {acting_words(result)}.",
        "Add replicates or widen low … high; `explorer design --sigma` says what a design will see.",
    )


def _then(result: DesignResult) -> str:
    """What to do once something acts; blends and randomly drawn groups take no target."""
    if result.analysis.mixture is not None:
        return "Run the highest and the lowest blend again, and compare."
    if result.analysis.random is not None:
        return "Ask for the settings of a value, the groups as blocks: `explorer analyse … --block … --target`."
    return "Ask for the settings of a value: `explorer analyse … --target`."


def acting_words(result: DesignResult) -> str:
    """What acts by the tests of a two-level design, or by the terms of the model."""
    found = result.analysis
    if found.effects is not None:
        return acting(found.effects.screening)
    if found.mixture is not None:
        row = found.mixture.rows[0]
        return (
            f"the blend changes the response (p = {p_value(row.p)})"
            if row.p < 0.05
            else f"no change by the blend is seen (p = {p_value(row.p)})"
        )
    if found.elementary is not None:
        return elementary_words(found.elementary)
    if found.random is not None:
        return group_facts(result, found.random)[0][1]
    if found.named is not None:
        return terms_that_act(found.named.rows)
    return "no model could be fitted" if found.model is None else terms_that_act(found.model.anova.rows)


def _acting_names(result: DesignResult) -> list[str]:
    found = result.analysis
    if found.effects is not None:
        screening = found.effects.screening
        tests = {e.name: test for e in screening.effects if not e.is_dummy and (test := screening.deciding_test(e))}
        if any(math.isfinite(test.p) for test in tests.values()):
            return [name for name, test in tests.items() if test.p_holm < 0.05]
        return [e.name for e in screening.effects if not e.is_dummy and abs(e.effect) > screening.lenth.margin]
    if found.mixture is not None:
        return [factor.factor for factor in result.factors] if found.mixture.rows[0].p < 0.05 else []
    if found.elementary is not None:
        return told(found.elementary)
    if found.random is not None:
        return [term_text(one.source) for one in found.random.tests if one.p < ACTS]
    anova = found.model.anova if found.model is not None else found.named
    rows = [] if anova is None else [row for row in anova.rows if row.source not in WHOLE]
    return [term_text(row.source) for row in rows if row.p < 0.05]


def _tested(result: DesignResult) -> bool:
    """Whether anything was tested: without scatter or a model, finding no effect means nothing."""
    found = result.analysis
    if found.effects is not None:
        return True  # at least by Lenth's margin
    if found.mixture is not None:
        return math.isfinite(found.mixture.rows[0].p)
    if found.elementary is not None:
        return any(math.isfinite(one.p) for one in found.elementary.effects)
    if found.random is not None:
        return any(math.isfinite(one.p) for one in found.random.tests)
    anova = found.model.anova if found.model is not None else found.named
    return anova is not None and any(math.isfinite(row.p) for row in anova.rows if row.source not in WHOLE)


def in_short(result: DesignResult) -> Section:
    """The answer in a few lines, and what the letters stand for."""
    runs, response, found = result.runs, result.response.path, result.analysis
    facts = [("Runs", f"{runs.valid} with a result at {runs.rows} rows, {runs.missing} without")]
    if found.effects is not None:
        facts.append(("Factors that act", acting(found.effects.screening)))
        if found.effects.few_terms:
            best = found.effects.few_terms[0]
            terms = enumeration([term_text(term) for term in best.terms])
            facts.append(
                (
                    "Few terms that explain the runs",
                    f"{terms}: R² {fixed(best.r_squared)}, p = {p_value(best.p)} by permutation of a search that takes "
                    "interactions; confirm it by further runs",
                )
            )
    if found.model is not None:
        anova = found.model.anova
        surface = found.model.surface
        if surface.block_names:
            effects = zip(surface.block_names, surface.block_effects, strict=True)
            told = ", ".join(f"{name} {with_sign(observed_number(response, effect))}" for name, effect in effects)
            facts.append(("Blocks", f"{told}; they add up to zero, and the model is their mean"))
        if found.effects is None:
            facts.append(("Terms that act", terms_that_act(anova.rows)))
        coded, actual = equation(found.model.surface, result.factors, response)
        r2 = (anova.r_squared, anova.r_squared_adjusted, anova.r_squared_predicted)
        facts += [
            ("Equation, coded", coded),
            ("Equation, actual", actual + units_of_factors(result.factors)),
            ("R², adjusted, predicted", ", ".join(fixed(value, 4) for value in r2)),
            ("Scatter of one run", observed(response, anova.sigma)),
        ]
    if found.mixture is not None:
        blends = found.mixture
        facts += [
            ("Highest blend", blend_words(result, blends.highest)),
            ("Lowest blend", blend_words(result, blends.lowest)),
            ("Looked for", f"over all blends within low … high, in steps of {percent(blends.step)} of the room"),
            ("R², adjusted, predicted", ", ".join(fixed(value, 4) for value in blends.shares_explained)),
            ("Scatter of one run", observed(response, blends.sigma)),
        ]
    if found.surrogate is not None:
        facts.append(("Predicts better", better_words(result)))
    if found.surrogate_target is not None:
        facts += target_facts(result, found.surrogate_target)
    if found.elementary is not None:
        facts += elementary_facts(found.elementary)
    if found.random is not None:
        facts += group_facts(result, found.random)
    if found.named is not None:
        facts += [("Terms that act", terms_that_act(found.named.rows)), *fit_facts(result, found.named)]
        if result.target is not None:
            facts.append(("Target", f"given by {target_words(result, found.named)}"))
    if found.optimum is not None:
        facts.append(("Target", found.optimum.statement))
    cautions: list[Block] = [Caution(text) for text in found.notes]
    return Section("In short", (Facts(tuple(facts)), *cautions, factor_table(result)))


def acting(analysis: Screening) -> str:
    """Which effects are significant, and by which test."""
    words = "the columns without a factor" if analysis.pure_error is None else "the replicates"
    tests = {e.name: test for e in analysis.effects if not e.is_dummy and (test := analysis.deciding_test(e))}
    tested = {name: test for name, test in tests.items() if math.isfinite(test.p)}
    if tested:
        alone = [name for name, test in tested.items() if test.p < 0.05]
        all_at_once = [name for name, test in tested.items() if test.p_holm < 0.05]
        return (
            f"against {words}: {enumeration(alone)} (p < 0.05 each alone); {enumeration(all_at_once)} after Holm's "
            "correction"
        )
    margin = analysis.lenth.margin
    beyond = [effect.name for effect in analysis.effects if abs(effect.effect) > margin]
    return f"beyond Lenth's margin {number(margin)}: {enumeration(beyond)}"


def terms_that_act(rows: Sequence[AnovaRow]) -> str:
    """Terms of the model with p < 0.05, each alone."""
    terms = [row for row in rows if row.source not in WHOLE]
    acting = [term_text(row.source) for row in terms if row.p < 0.05]
    if all(math.isnan(row.p) for row in terms):
        return "cannot be told without scatter"
    return f"{enumeration(acting)} (p < 0.05 each alone, of {len(terms)} terms)"


def factor_table(result: DesignResult) -> Table:
    """Letters, names and ranges of the factors."""
    rows = tuple(
        (factor.name, parameter_label(factor.path), enumeration(levels), MISSING, MISSING)
        if levels
        else (
            factor.name,
            parameter_label(factor.path),
            parameter_value(factor.path, factor.low),
            parameter_value(factor.path, factor.high),
            parameter_value(factor.path, factor.reference),
        )
        for factor, levels in zip(result.factors, result.names, strict=True)
    )
    return Table(("letter", "factor", "low (−1)", "high (+1)", "reference"), rows)


def all_runs(result: DesignResult) -> Section | None:
    """Every row of the design with its results."""
    fitted, response = result.fitted, result.response.path
    if fitted is None:
        return None
    model = fitted.model
    rows = []
    for row, natural in enumerate(fitted.design.tolist()):
        own = np.flatnonzero(model.row_of_run == row)
        results: tuple[str, ...] = (MISSING,) * 3
        if own.size:
            sample = Sample.of(model.observed[own])
            results = tuple(observed(response, value) for value in (sample.mean, sample.sd, model.predicted[own[0]]))
        levels = (parameter_value(f.path, value) for f, value in zip(result.factors, natural, strict=True))
        names = enumeration([result.labels[k] for k in own]) if own.size else MISSING
        rows.append((names, *levels, *results))
    header = ("run", *(factor.name for factor in result.factors), "result", "sd", "model")
    return Section("Runs", (Table(header, tuple(rows)),))


def repeat(result: DesignResult) -> Section:
    """The command that reproduces the answer."""
    found = result.analysis
    text = "The same sheet gives the same numbers"
    if found.optimum is not None:
        text = "Bootstrap refits have a fixed seed, so the same sheet gives the same numbers"
    if found.model is not None or found.named is not None:
        text = f"Sums of squares are partial (Type III). {text}"
    text += "; `result.json` holds all of them."
    versions = tuple((name, version or "not installed") for name, version in result.versions.items())
    command = Code(shlex.join(result.command))
    return Section("How to repeat", (Text(text), command, Table(("program", "version"), versions)))


def methods(result: DesignResult) -> Section:
    """The paragraph for a paper."""
    return design_methods(result)[0]


SECTIONS: tuple[Callable[[DesignResult], Section | None], ...] = (
    in_short,
    target,
    effects,
    mixture,
    model,
    names,
    groups,
    elementary,
    surrogate,
    diagnostics,
    shape,
    all_runs,
    methods,
    repeat,
)
