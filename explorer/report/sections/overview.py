"""In short: what was run, what was found, and what each stage could have seen."""

from __future__ import annotations

from doe.analysis.screening import SIGNIFICANT
from doe.analysis.verification import Verification
from doe.stages.screening import ScreeningResult
from doe.studies.study_result import StudyResult, valid_runs
from doe.target import Target
from explorer.report.content import Block, Caution, Facts, Section, Table
from explorer.report.identified import settings
from explorer.units import (
    code,
    duration,
    enumeration,
    fixed,
    number,
    observable_label,
    observed,
    parameter_label,
    percent,
)


def overview(result: StudyResult) -> Section:
    """The study in a few lines, the warnings that belong to them, and the resolution of every stage."""
    blocks: list[Block] = [Facts(tuple(_facts(result)))]
    blocks += [Caution(text) for text in cautions(result)]
    blocks.append(_resolutions(result))
    return Section("In short", tuple(blocks))


def cautions(result: StudyResult) -> list[str]:
    """What keeps the numbers of this study from meaning more than they do, one sentence each."""
    found = []
    fallback = [s.name for s in result.screening.selected if s.reason != SIGNIFICANT]
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
        found.append(f"Screening row {rows} has no valid pour and is analysed as missing.")
    if not result.ascent.bracket.reached:
        found.append("The steepest ascent did not pass the target; the surface stands around its nearest step.")
    optimum = result.optimum.single
    if not optimum.better_than_noise:
        found.append("The response surface is not better than noise: the optimum is a point, not a calibration.")
    observable = result.study.targets[0].observable
    if not optimum.reached:
        found.append(
            f"The target {observed(observable, optimum.target)} lies outside what the model reaches in its region, "
            f"{observed(observable, optimum.reachable_low)} … {observed(observable, optimum.reachable_high)}; "
            "the optimum is where it comes nearest."
        )
    elif optimum.unidentified:
        found.append(
            f"One number cannot fix several parameters: {enumeration(optimum.unidentified)} can take at least half "
            "of the region while the model stays at the target."
        )
    pairs = zip(result.verification.targets, result.verification.tests, strict=True)
    return found + [text for target, test in pairs for text in precision_cautions(target, test)]


def precision_cautions(target: Target, test: Verification) -> list[str]:
    """Where an error is smaller than what the replicates can show, and where a spread was not measured."""
    found = []
    error, spread = test.relative_error_percent, test.simulated.standard_error
    name = observable_label(target.observable)
    if error < 100 * spread / abs(target.mean):
        found.append(
            f"{name[0].upper()}{name[1:]}: the relative error of {fixed(error)} % is smaller than the standard error "
            f"of the simulated mean, {observed(target.observable, spread)} = "
            f"{fixed(100 * spread / abs(target.mean))} %. Pours this noisy cannot show an error this small."
        )
    if target.sd is not None and target.sd_source != "measured":
        found.append(
            f"{name[0].upper()}{name[1:]}: the measurement's standard deviation "
            f"{observed(target.observable, target.sd)} is {target.sd_source}, not measured; the Welch and "
            "equivalence tests lean on it."
        )
    return found


def _facts(result: StudyResult) -> list[tuple[str, str]]:
    study, profile, totals = result.study, result.study.profile, result.runs
    observable = study.targets[0].observable
    noise, test, analysis = result.pilot.noise[observable], result.verification.tests[0], result.screening.analysis
    chosen = [
        f"{one.name} ({one.label})" + (f" = {one.chosen}" if one.identified else f": {one.answer}")
        for one in settings(result.optimum)
    ]
    outcomes = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in sorted(totals.by_outcome.items()))
    return [
        (
            "Study",
            f"{code(study.name)}, profile {profile.name}: {number(1e3 * profile.mass)} g, {profile.spheres} shapes",
        ),
        ("Runs", f"{totals.total} pours: {outcomes}; {percent(1 - totals.valid / totals.total, 1)} not valid"),
        (
            "Noise of one pour",
            f"σ = {observed(observable, noise.sigma)} (95 % interval {observed(observable, noise.low)} … "
            f"{observed(observable, noise.high)}, {noise.runs} seeds; {observable_label(observable)})",
        ),
        ("Significant factors", f"{enumeration(analysis.significant())} (Holm, against the {analysis.error_source})"),
        ("Largest unknown", assumption_statement(result)),
        ("Optimum", "; ".join(chosen)),
        (
            "Verification",
            f"{observed(observable, test.simulated.mean)} over {test.simulated.n} fresh pours against "
            f"{observed(observable, test.target.mean)}: {test.verdict}; "
            f"relative error {fixed(test.relative_error_percent)} %",
        ),
        ("Time", duration(result.timing.total_s)),
    ]


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
