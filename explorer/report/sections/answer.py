"""The answer of a study: in short, its verification, what moves the response, and the optimum."""

from __future__ import annotations

import math
from collections.abc import Sequence

from doe.analysis.screening import SIGNIFICANT
from doe.analysis.surface_anova import ratio
from doe.analysis.t_tests import Sample
from doe.analysis.verification import Verification
from doe.stages.screening import ScreeningResult
from doe.stages.surface import CONTRADICTION
from doe.stages.verification import VerificationResult
from doe.studies.factors import MIN_BODIES
from doe.studies.study_result import StudyResult, valid_runs
from doe.target import Target
from explorer.report.content import Banner, Block, Caution, Facts, Figure, Section, Strong, Struck, Table, Text, Word
from explorer.report.figures.effects import all_effects
from explorer.report.figures.pours import pile_outlines
from explorer.report.figures.pours import verification as verification_chart
from explorer.report.identified import BY_RULE, settings
from explorer.units import (
    MISSING,
    code,
    duration,
    enumeration,
    fixed,
    number,
    observable_label,
    observed,
    p_value,
    parameter_label,
    percent,
    with_sign,
)


def banner(result: StudyResult) -> Banner:
    """Whether the material is calibrated: fresh pours decide; a surface that is only noise decides nothing."""
    single, targets, tests = result.optimum.single, result.study.targets, result.verification.tests
    verdicts = {one.verdict for one in tests}
    poured, said = _poured(targets, tests), _said(targets, tests)
    shown = (single.better_than_noise, *(anova.better_than_noise for anova in result.surface.anova[1:]))
    noisy = [one for one, good in zip(targets, shown, strict=True) if not good]
    ends = (observed(targets[0].observable, end) for end in (single.reachable_low, single.reachable_high))
    reach = " … ".join(ends)
    if not single.reached and verdicts != {"equivalent"}:
        first = targets[0].observable
        named = f" ({observable_label(first)})" if len(targets) > 1 else ""
        return Banner(
            Word.OUT_OF_REACH,
            "",
            f"No setting of the region gives {observed(first, single.target)}{named}: the model reaches {reach}, and "
            f"{poured}.",
            "Widen the ranges of the factors that act, or add a factor that is missing: for round bodies rolling "
            "resistance, `effect.rolling_resistance.rolling_friction`.",
        )
    joint = result.optimum.posterior
    if len(targets) > 1 and joint is not None and joint.p < CONTRADICTION and verdicts != {"equivalent"}:
        return Banner(
            Word.OUT_OF_REACH,
            "",
            f"No setting of the region gives all targets at once (χ², p = {p_value(joint.p)}), and {poured}.",
            "Look at how each target was measured, widen the ranges of the factors that act, or ask "
            "`explorer diagnose` whether the model lacks an effect.",
        )
    if noisy:
        of = f" of the {enumeration([observable_label(one.observable) for one in noisy])}" if len(targets) > 1 else ""
        sigmas = enumeration([observed(one.observable, result.pilot.noise[one.observable].sigma) for one in noisy])
        return Banner(
            Word.NOT_CALIBRATED,
            "",
            f"The response surface{of} is not better than noise, so the chosen point is no calibration, although "
            f"{poured}."
            if verdicts == {"equivalent"}
            else f"The response surface{of} is not better than noise, and {poured}.",
            "Pour more replicates per point, or widen the ranges until the factors show above the noise of one pour, "
            f"σ = {sigmas}.",
        )
    if "different" in verdicts:
        return Banner(
            Word.NOT_CALIBRATED,
            "",
            f"{poured}: {said}",
            "Start again around the point found, with narrower ranges; if it stays, ask `explorer diagnose` whether "
            "the model lacks an effect.",
        )
    if verdicts != {"equivalent"}:
        return Banner(
            Word.NO_ANSWER,
            "",
            f"{poured}: {said}",
            f"Pour more than {max(one.simulated.n for one in tests)} times in the verification, or state a margin that "
            "this noise can show.",
        )
    margins = " and ".join(f"± {observed(one.observable, one.margin)}" for one in result.study.targets)
    open_ = [one.name for one in settings(result.optimum) if not one.identified]
    return Banner(
        Word.CALIBRATED,
        margins,
        f"{poured}: {said}",
        f"Take the ranges of {enumeration(open_)} as the answer, and add a second measurement (another rig or "
        "observable) to fix them."
        if open_
        else "Use these values, and check them on a test that was not fitted.",
    )


def _poured(targets: Sequence[Target], tests: Sequence[Verification]) -> str:
    """For every target, what the fresh pours gave beside what was measured."""
    pairs = [
        f"{observed(one.observable, test.simulated.mean)} against {observed(one.observable, one.mean)} measured"
        for one, test in zip(targets, tests, strict=True)
    ]
    if len(pairs) > 1:
        pairs = [f"{pair} ({observable_label(one.observable)})" for pair, one in zip(pairs, targets, strict=True)]
    pours = enumeration([str(n) for n in sorted({test.simulated.n for test in tests})])
    return f"{pours} fresh pours at the chosen setting gave {enumeration(pairs)}"


def _said(targets: Sequence[Target], tests: Sequence[Verification]) -> str:
    """The verdict on one target, or the short verdicts on several."""
    if len(targets) == 1:
        return verdict(targets[0], tests[0])
    pairs = zip(targets, tests, strict=True)
    return "; ".join(f"{_outcome(one, test)} ({observable_label(one.observable)})" for one, test in pairs) + "."


ANSWER = 3
"""Cells of a setting's row before its numbers: name, label, whether it is identified."""


def holds(result: StudyResult) -> bool:
    """Whether the parameters found may be used: the material is calibrated."""
    return banner(result).word is Word.CALIBRATED


def parameters(result: StudyResult) -> Section:
    """The calibrated parameters; struck out if the verdict says that they are not calibrated."""
    good = holds(result)
    rows = []
    for one in settings(result.optimum):
        known = f"95 % set {one.confidence_set}" if one.identified else f"not identified; {BY_RULE}: {one.chosen}"
        value = one.chosen if one.identified or one.feasible == MISSING else one.feasible
        rows.append(
            (one.name, one.label, Strong(value), known) if good else (one.name, one.label, Struck(value), known)
        )
    how = "Bold: the answer; of a factor that the target does not identify it is the range that gives the target."
    caption = how if good else "Struck out: these values do not calibrate the material."
    return Section(
        "Parameters", (Table(("factor", "parameter", "value", "how well it is known"), tuple(rows), caption),)
    )


def overview(result: StudyResult) -> Section:
    """The study in a few lines, with the warnings that go with them, and the resolution of every stage."""
    blocks: list[Block] = [Facts(tuple(_facts(result)))]
    blocks += [Caution(text) for text in cautions(result)]
    blocks.append(_resolutions(result))
    return Section("In short", tuple(blocks))


def cautions(result: StudyResult) -> list[str]:
    """Limits on the meaning of the numbers of this study, one sentence each."""
    found = []
    fallback = [s.name for s in result.screening.selected if not s.reason.startswith(SIGNIFICANT)]
    if fallback:
        found.append(
            f"{enumeration(fallback)} went on without being significant, in the order of the study's fallback list; "
            "what later stages say about them is the shape of noise unless their intervals say otherwise."
        )
    if result.screening.analysis.pure_error is None:
        found.append("One pour per row: significance rests on the dummy columns alone, with few degrees of freedom.")
    missing = result.screening.analysis.missing_rows
    if missing:
        rows = enumeration([str(row + 1) for row in missing])
        one, has, is_ = ("row", "has", "is") if len(missing) == 1 else ("rows", "have", "are")
        found.append(f"Screening {one} {rows} {has} no valid pour and {is_} analysed as missing.")
    walk = result.ascent
    if walk.approach is not None and not walk.approach.reached:
        found.append("The steepest ascent did not meet all targets; the surface stands over the whole of the ranges.")
    elif walk.approach is None and not walk.bracket.reached:
        found.append("The steepest ascent did not pass the target; the surface stands around its nearest step.")
    optimum = result.optimum.single
    if len(result.study.targets) == 1 and not optimum.better_than_noise:
        found.append("The response surface is not better than noise: the optimum is a point, not a calibration.")
    observable = result.study.targets[0].observable
    if len(result.study.targets) == 1 and not optimum.reached:
        found.append(
            f"The target {observed(observable, optimum.target)} ({observable_label(observable)}) lies outside what the "
            "model reaches in its region, "
            f"{observed(observable, optimum.reachable_low)} … {observed(observable, optimum.reachable_high)}; "
            "the optimum is where it comes nearest."
        )
    elif len(result.study.targets) == 1 and optimum.unidentified:
        found.append(
            f"One number cannot fix several parameters: {enumeration(optimum.unidentified)} can take at least half "
            "of the region while the model stays at the target."
        )
    pairs = zip(result.verification.targets, result.verification.tests, strict=True)
    return found + [text for target, test in pairs for text in precision_cautions(target, test)]


def precision_cautions(target: Target, test: Verification) -> list[str]:
    """Notes where an error is smaller than the replicates can show, or a spread was not measured."""
    found = []
    error, spread = test.relative_error_percent, test.simulated.standard_error
    name = observable_label(target.observable)
    share = 100 * ratio(spread, abs(target.mean))
    if error < share:
        found.append(
            f"{name[0].upper()}{name[1:]}: the relative error of {fixed(error)} % is smaller than the standard error "
            f"of the simulated mean, {observed(target.observable, spread)} = "
            f"{fixed(share)} %. Pours this noisy cannot show an error this small."
        )
    if target.sd is not None and target.sd_source != "measured":
        found.append(
            f"{name[0].upper()}{name[1:]}: the measurement's standard deviation "
            f"{observed(target.observable, target.sd)} is {target.sd_source}, not measured; "
            + ("the Welch and equivalence tests lean on it." if target.n else "the tests take its mean as exact.")
        )
    return found


def _facts(result: StudyResult) -> list[tuple[str, str]]:
    study, profile, totals = result.study, result.study.profile, result.runs
    analysis = result.screening.analysis
    chosen = [
        f"{one.name} ({one.label})" + (f" = {one.chosen}" if one.identified else f": {one.answer}")
        for one in settings(result.optimum)
    ]
    several = len(study.targets) > 1
    grams = "" if profile.mass is None else f"{number(1e3 * profile.mass)} g, "
    named = [(target, f" ({observable_label(target.observable)})" if several else "") for target in study.targets]
    outcomes = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in sorted(totals.by_outcome.items()))
    return [
        (
            "Study",
            f"{code(study.name)}, profile {profile.name}: {grams}{profile.spheres} shapes",
        ),
        ("Runs", f"{totals.total} pours: {outcomes}; {percent(1 - totals.valid / totals.total, 1)} not valid"),
        *((f"Noise of one pour{of}", _noise(result, target)) for target, of in named),
        ("Significant factors", f"{enumeration(analysis.significant())} (Holm, against the {analysis.error_source})"),
        ("Largest unknown", assumption_statement(result)),
        ("Optimum", "; ".join(chosen) if holds(result) else Struck("; ".join(chosen))),
        *(
            (f"Verification{of}", _verified(target, test))
            for (target, of), test in zip(named, result.verification.tests, strict=True)
        ),
        ("Time", duration(result.timing.total_s)),
    ]


def _noise(result: StudyResult, target: Target) -> str:
    name, noise = target.observable, result.pilot.noise[target.observable]
    return (
        f"σ = {observed(name, noise.sigma)} (95 % interval {observed(name, noise.low)} … {observed(name, noise.high)}, "
        f"{noise.runs} seeds; {observable_label(name)})"
    )


def _verified(target: Target, test: Verification) -> str:
    name = target.observable
    return (
        f"{observed(name, test.simulated.mean)} over {test.simulated.n} fresh pours against "
        f"{observed(name, test.target.mean)}: {test.verdict}; relative error {fixed(test.relative_error_percent)} %"
    )


def assumption_statement(result: StudyResult) -> str:
    """Which unknown of the set-up moves the response most, beside the largest factor and the noise."""
    screening, assumptions = result.screening, result.assumptions
    assumed = () if assumptions is None else assumptions.analysis.factor_effects()
    factors = screening.analysis.factor_effects()
    if assumptions is None or not assumed or not factors:
        return "this study declares no assumption"
    unknown, largest, response = assumed[0], factors[0], screening.response
    where = {factor.name: factor.path for factor in (*screening.factors, *assumptions.factors)}
    text = (
        f"{parameter_label(where[unknown.name])} moves the response by {observed(response, abs(unknown.effect))} over "
        f"its assumed range; the largest factor, {largest.name} ({parameter_label(where[largest.name])}), by "
        f"{observed(response, abs(largest.effect))} over its own"
    )
    if largest.effect:
        text += f" (ratio {number(abs(unknown.effect) / abs(largest.effect), 2)})"
    noise = result.pilot.noise.get(response)
    if noise is not None and noise.sigma:
        text += f"; one pour scatters by σ = {observed(response, noise.sigma)}"
    if unknown.name not in assumptions.analysis.significant():
        text += ". No assumption is significant after Holm's correction"
    return text


def _resolutions(result: StudyResult) -> Table:
    observable, response = result.study.targets[0].observable, result.screening.response
    sizes = {
        "screening": _of_screening(result.screening, response),
        "ascent": f"{observed(observable, result.ascent.smallest_difference)} between two steps",
        "surface": f"{observed(observable, result.surface.smallest_main_effect[0])} from low to high of a factor",
        "verification": f"{observed(observable, result.verification.smallest_difference[0])} from the target",
    }
    if result.scan is not None:
        sizes["scan"] = f"{observed(result.scan.observable, result.scan.smallest_difference)} between two values"
    if result.assumptions is not None:
        sizes["assumptions"] = _of_screening(result.assumptions, response)
    rows = []
    for stage, seen in result.runs.outcomes().items():
        pours, valid = seen.total(), valid_runs(seen)
        rows.append((stage, str(pours), str(valid), percent(1 - valid / pours, 1), sizes.get(stage, "–")))
    tries = result.study.tries
    return Table(
        ("stage", "pours", "valid", "not valid", "smallest effect it could see"),
        tuple(rows),
        "Smallest effect: found with chance 0.8 at level 0.05, one effect at a time. Every mean is over "
        "valid pours; one that is not valid is kept with its outcome. "
        f"For one replicate at most {tries} {'seed is' if tries == 1 else 'seeds are'} tried.",
    )


def _of_screening(screening: ScreeningResult, response: str) -> str:
    error = screening.analysis.deciding_error
    if error is None:
        return "–"
    return (
        f"{observed(response, error.smallest_detectable_effect)} from low to high; "
        f"{observed(response, error.smallest_detectable_effect_bonferroni)} for all factors at once"
    )


def verification(result: StudyResult) -> Section:
    """Per target: samples, tests, equivalence, and relative error beside the noise."""
    stage = result.verification
    seeds = len({run.seed for run in stage.runs})
    blocks: list[Block] = [
        Text(
            f"{len(stage.runs)} pours at the optimum with {seeds} seeds that no other stage used; "
            f"{percent(stage.no_pile_share, 1)} are not valid. Means are over valid pours."
        )
    ]
    for index, (target, test) in enumerate(zip(stage.targets, stage.tests, strict=True)):
        blocks += _of_target(stage, index, target, test)
    return Section("Verification", tuple(blocks))


def piles(result: StudyResult) -> Section | None:
    """Mean silhouettes at the reference setting and at the optimum; None if none were kept."""
    found = result.piles
    if not found:
        return None
    n = enumeration([f"{pile.pours} pours at the {pile.name}" for pile in found])
    caption = (
        f"Mean silhouettes over n = {n}, each from four sides; bands: ± 1 SD between pours; both axes on one scale."
    )
    return Section("The pile", (Figure("pile", pile_outlines(found, {}), caption),))


def _of_target(stage: VerificationResult, index: int, target: Target, test: Verification) -> list[Block]:
    name = target.observable
    words = observable_label(name)
    caption = (
        f"n = {test.simulated.n} valid fresh pours, one point each; diamonds: means with 95 % intervals (t); band: "
        "target ± equivalence margin, fixed before any run."
    )
    return [
        Text(f"{words[0].upper()}{words[1:]}: {verdict(target, test)}"),
        Figure(f"verification-{index + 1}", verification_chart(stage, index), caption),
        _samples(target, test),
        _tests(target, test),
    ]


def verdict(target: Target, test: Verification) -> str:
    """The outcome in one sentence, the equivalence test first: finding no difference does not prove agreement."""
    name, deciding = target.observable, test.deciding
    words = f"{_outcome(target, test)}{'; more pours are needed to tell' if test.verdict == 'cannot tell' else ''}."
    if deciding is None or math.isnan(deciding.low):
        return words
    interval = f"{_difference(name, deciding.low)} … {_difference(name, deciding.high)}"
    return f"{words} Difference {_difference(name, deciding.difference)}, 95 % interval {interval}."


def _outcome(target: Target, test: Verification) -> str:
    margin = observed(target.observable, target.margin)
    return {
        "equivalent": f"equivalent to the measurement within ± {margin}",
        "different": f"different from the measurement, and not shown to lie within ± {margin}",
        "cannot tell": f"neither different nor shown to lie within ± {margin}",
    }[test.verdict]


def _samples(target: Target, test: Verification) -> Table:
    name = target.observable
    rows = []
    samples = [("simulated", test.simulated), ("measured", test.target)]
    if target.before_mean is not None:
        sd, n = target.before_sd, target.before_n
        samples.append(("the model before", Sample(target.before_mean, math.nan if sd is None else sd, n or 0)))
    for words, sample in samples:
        spread = observed(name, sample.sd)
        if words == "measured" and math.isfinite(sample.sd) and target.sd_source != "measured":
            spread += f" ({target.sd_source})"
        error = observed(name, sample.standard_error)
        rows.append((words, observed(name, sample.mean), spread, str(sample.n or MISSING), error))
    share = 100 * ratio(test.simulated.standard_error, abs(target.mean))
    caption = (
        f"Relative error {fixed(test.relative_error_percent)} %; standard error of the simulated mean "
        f"{fixed(share)} % of the target."
    )
    return Table(("", "mean", "sd", "n", "standard error"), tuple(rows), caption)


def _tests(target: Target, test: Verification) -> Table:
    name = target.observable
    rows: list[tuple[str, ...]] = []
    for found, words in (
        (test.welch, "Welch, two samples"),
        (test.pooled, "Student, two samples, equal variances"),
        (test.one_sample, "one sample against the measured mean"),
    ):
        if found is None:
            continue
        interval = f"{_difference(name, found.low)} … {_difference(name, found.high)}"
        rows.append(
            (
                words,
                _difference(name, found.difference),
                f"{percent(found.level)}: {interval}",
                fixed(found.t),
                fixed(found.df, 1),
                p_value(found.p),
            )
        )
    equivalence = test.equivalence
    if equivalence is not None:
        interval = f"{_difference(name, equivalence.low)} … {_difference(name, equivalence.high)}"
        margin = observed(name, equivalence.margin)
        rows.append(
            (
                f"equivalence within ± {margin} (TOST)",
                MISSING,
                f"{percent(equivalence.level)}: {interval}",
                MISSING,
                MISSING,
                p_value(equivalence.p),
            )
        )
    if not rows:
        rows.append(("no test: one pour, or no spread", *[MISSING] * 5))
    caption = "Difference = simulated − measured. A small p of the equivalence test speaks for agreement."
    return Table(("test", "difference", "interval", "t", "df", "p"), tuple(rows), caption)


def _difference(name: str, value: float) -> str:
    """A difference with its sign and unit."""
    return with_sign(observed(name, value))


def effects(result: StudyResult) -> Section:
    """All effects in one chart, and what the calibration depends on."""
    response = observable_label(result.screening.response)
    text = f"Effects on {response}, each over its own range, with 95 % intervals."
    blocks: list[Block] = [Text(text)]
    title = "What moves the angle" if "angle" in response else "What moves the response"
    if result.assumptions is not None:
        statement = assumption_statement(result)
        blocks.append(Text(f"What the calibration hangs on: {statement}."))
    caption = (
        f"Effect = mean at the high level − mean at the low level, with its 95 % interval (t); n = "
        f"{result.screening.analysis.runs} valid pours in {result.screening.analysis.rows} rows."
    )
    if any(part is not None and part.not_testable for part in (result.screening, result.assumptions)):
        caption += f" Not testable: acts on fewer than {MIN_BODIES} bodies."
    return Section(title, (*blocks, Figure("effects", all_effects(result.screening, result.assumptions), caption)))
