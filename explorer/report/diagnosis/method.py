"""How the answer was reached: what the data offered, the method in six lines, text for a paper, how to repeat."""

from __future__ import annotations

import shlex

from doe.declared.model import effect_of
from doe.holdout import OVERALL
from explorer.diagnosis.result import DiagnosisResult, answers
from explorer.report.content import Block, Bullets, Code, Section, Table, Text
from explorer.report.diagnosis.charts import likely
from explorer.report.diagnosis.wording import (
    amplitudes_of,
    chance,
    feature_label,
    feature_value,
    model_words,
    spelled,
    with_fit,
)
from explorer.units import code, counted, duration, enumeration, fixed, number, p_value, parameter_label, percent

OFFERS = {"scalars": "scalars", "profile": "scalars and height profiles", "scan": "scalars and scans of the surface"}


def data(result: DiagnosisResult) -> Section:
    """Conditions, what each offers, what a scan would add, what is not used, and the scatter."""
    offered = {row.condition: row for row in result.offered}
    rows = []
    for row in result.measured:
        fitted = offered.get(row.condition)
        more = 0 if fitted is None else fitted.scan_would_add
        rows.append(
            (
                row.condition,
                "fitted" if row.role == "fit" else "held out",
                row.rig.replace("_", " "),
                str(row.replicates),
                "summaries" if fitted is None else OFFERS[fitted.offer],
                str(len(row.summaries) if fitted is None else fitted.features),
                f"{more} features" if more else "nothing more",
                enumeration([feature_label(name) for name in row.summaries]),
            )
        )
    header = ("condition", "role", "rig", "pours", "offers", "compared", "a scan would add", "summaries")
    caption = (
        "Features are chosen by name before any value is looked at, and read the same way from data and runs. Of a "
        "profile or a scan: ten rings of equal width about the funnel's axis; the core is the inner half; heights of "
        "classes are in thicknesses of a body. Held-out conditions are compared by their summaries alone."
    )
    blocks: list[Block] = [Table(header, tuple(rows), caption)]
    for words, items in (
        ("Not used:", result.data.ignored),
        ("Changed in reading:", result.data.notes),
        ("Offered, but left out because no pour varies or gives it:", list(map(_left_out, result.left_out))),
    ):
        if items:
            blocks += [Text(words), Bullets(tuple(items))]
    scatter = result.scatter
    words = (
        "no more than simulated ones"
        if scatter <= 1.0
        else f"with {fixed(scatter)} times the variance of simulated ones, and the noise of the data is widened by that"
    )
    if all(row.alone for row in result.measured if row.role == "fit"):
        blocks.append(Text("No condition has two values: pours are taken to scatter as simulated ones do."))
    else:
        blocks.append(Text(f"Measured pours of a condition scatter {words}."))
    return Section("Data", tuple(blocks))


def _left_out(label: str) -> str:
    condition, _, feature = label.rpartition(": ")
    return f"{feature_label(feature)} ({condition})"


def for_a_paper(result: DiagnosisResult) -> Section:
    """Methods and result as two paragraphs of plain English."""
    return Section("For a paper", (Text(_methods(result)), Text(_result(result))))


def _methods(result: DiagnosisResult) -> str:
    rule = {name: number(value) for name, value in vars(result.rule).items()}
    conditions = enumeration(
        [f"{row.condition} ({row.features} features, {_pours(result, row.condition)})" for row in result.offered]
    )
    why = "the name rested on how far its parameters were off their means"
    if result.rule.hidden < 1.0:
        why = f"kept {100.0 * result.rule.hidden:g} % or more with its parameters measured at their best fit"
    fitted = f", unless the calibrated declared model fitted (p ≥ {rule['doubted']}) and {why}"
    doubted = fitted if result.rule.doubted < 1.0 else ""
    calibrated = [row.name for row in result.parameters if effect_of(row.name) not in result.given]
    moved = enumeration([parameter_label(name) for name in calibrated])
    held = ""
    if result.given:
        named = enumeration([code(name) for name in result.given])
        held = f"By an earlier diagnosis the declared model held {named}, calibrated within 60 % of what was found. "
    return held + (
        f"The measured pours of {conditions} were compared with discrete-element simulations of the declared model, "
        f"alone and with each of {len(result.ranges)} candidate effects. Features of the pile were whitened by the "
        f"covariance of one simulated pour. A Bayesian linear regression on {result.pours.settings} simulated "
        "settings predicted them for every effect at any amplitude; the calibrated parameters "
        f"({moved}) were integrated out over their independent measurements. Prior probabilities were "
        f"{rule['prior_nothing']} that nothing is missing, {rule['prior_outside']} for something outside the library "
        f"and {rule['prior_pairs']} for two effects at once, the rest shared alike by the single effects; evidence was "
        f"raised to the power {number(result.temperature)}. The most probable effect or pair was named from a "
        f"posterior probability of {number(result.threshold)} on, after a follow-up alone and beside others together"
        f"{doubted}."
    )


def _result(result: DiagnosisResult) -> str:
    if result.kind == "unexplained" and not result.taken_back:
        left = [answer for answer, _ in likely(result)]
    else:
        left = answers(result.taken_back or result.verdict)
    odds = enumeration([f"{spelled(one)} {chance(result.probability(one))}" for one in left])
    sentence = f"The posterior probabilities were: {odds}."
    if len(left) == 1:
        sentence = f"The posterior probability of {spelled(left[0])} was {chance(result.probability(left[0]))}."
    row = result.effect_row(result.final)
    if row is not None:
        sentence += (
            f" The amplitude of {spelled(row.name)} was {amplitudes_of(row.amplitudes)}; data as far off the "
            f"best fit as these have p = {p_value(row.p)}."
        )
    if result.kind == "unexplained" and not result.taken_back:
        best = result.effect_row(left[0])
        rejected = "" if best is None else f" {spelled(left[0])} does not fit the data (p = {p_value(best.p)})."
        sentence += f"{rejected} No effect of the library was accepted as an explanation."
    total = result.overall("holdout")
    if total is not None:
        after = f", of the final model {feature_value(result, OVERALL, total.after)}" if result.added else ""
        sentence += (
            " On held-out conditions the root-mean-square error of the calibrated declared model, in standard "
            f"deviations of a measured pour, was {feature_value(result, OVERALL, total.before)}{after}, with a "
            f"noise floor of {feature_value(result, OVERALL, total.noise_floor)}."
        )
    told = result.held_out
    if result.taken_back and told is not None:
        sentence += (
            f" The held-out data contradicted that answer ({feature_label(told.summary)} in {told.condition}, "
            f"p = {p_value(told.p)}{with_fit(told)}), and it was withdrawn."
        )
    return sentence


def _pours(result: DiagnosisResult, condition: str) -> str:
    (pours,) = (row.replicates for row in result.measured if row.condition == condition)
    return counted(pours, "pour")


def how_reached(result: DiagnosisResult) -> Section:
    """The method in six lines, with the numbers of its rules."""
    rule = {name: number(value) for name, value in vars(result.rule).items()}
    # A result from before this condition existed was judged without it.
    why = "the name would stand were its parameters measured right where it wants them"
    if result.rule.hidden < 1.0:
        why = f"it has less than {100.0 * result.rule.hidden:g} % even with its parameters measured at their best fit"
    unlikely = f", and unlikely under the declared model (p < {rule['doubted']}, or {why})"
    doubted = unlikely if result.rule.doubted < 1.0 else ""
    taken = f"answer back where a summary contradicts it at p < {rule['contradicted']}, corrected for their number."
    if result.rule.together:
        taken = (
            "answer back where fitted and held-out data together (Fisher; the farthest held-out summary, corrected for "
            f"their number) are as far off it as in less than {percent(result.rule.contradicted)} of cases."
        )
    pairs = "" if result.rule.pairs_at_once else ", a pair by pours of a follow-up only,"
    features = sum(row.features for row in result.offered)
    lines = (
        f"The same {features} features are read from measured and simulated piles. Their far tails are drawn in, and "
        "they are whitened by the covariance of one simulated pour.",
        f"{result.pours.settings} settings are poured: the declared model with its parameters moved, every "
        f"effect at an amplitude that shifts the data by about {rule['strong']} standard errors (or at the end of its "
        "range), and more of whatever stays in question.",
        "One regression over all pours gives every model at every amplitude, with its uncertainty. Parameters are "
        "integrated out over their measurements, so what recalibration can do counts for no effect.",
        f"Probabilities follow from Student's t densities of the data, averaged over amplitudes, signs and directions, "
        f"and from the priors: {rule['prior_nothing']} for nothing missing, {rule['prior_outside']} for something "
        f"outside the library, {rule['prior_pairs']} for pairs, the rest for single effects. The temperature is "
        f"{number(result.temperature)}; below 1 the answer is less sure than the evidence says.",
        f"The most probable effect or pair{pairs} is named if it reaches {percent(result.threshold)} (after a "
        "follow-up, which could not tell what is beside it: alone and with others together) and the data are likely "
        f"under it (p ≥ {rule['fits']}){doubted}. "
        f"Else nothing is missing if that has {percent(result.rule.nothing_at_once)} or more "
        f"({percent(result.rule.nothing_from)} after a follow-up), unexplained if something outside is the most "
        "probable, and ambiguous otherwise: the smallest set of answers that holds "
        f"{percent(result.rule.credible)}.",
        "Fresh pours of the declared and the final model give the errors. Held-out data never choose; they take an "
        + taken,
    )
    blocks: list[Block] = [Bullets(lines)]
    told = result.held_out
    if told is not None:
        blocks.append(
            Text(
                f"Held-out data: farthest from fresh pours of {model_words(told.label)} is "
                f"{feature_label(told.summary)} of {told.condition}, by {fixed(told.farthest, 1)} "
                f"standard errors, p = {p_value(told.p)}{with_fit(told)}."
            )
        )
    return Section("How the answer was reached", tuple(blocks))


def repeat(result: DiagnosisResult) -> Section:
    """The command that reproduces the answer; pours in the store are not run again."""
    pours = result.pours
    text = (
        f"{pours.settings} settings of the declared model and its effects, each poured in every fitted condition; "
        f"{pours.run} pours were run in {duration(result.timing.total_s)}, the others were in the store. "
        "Pours have seeds of their own, so that the same order gives the same answer. `diagnosis.json` holds every "
        "number of this report."
    )
    versions = tuple((name, version or "not installed") for name, version in result.versions.items())
    return Section("How to repeat", (Text(text), Code(command(result)), Table(("program", "version"), versions)))


def command(result: DiagnosisResult) -> str:
    """The order as a command line."""
    order = result.order
    parts = ["explorer", "diagnose", result.data.folder, "--out", order.out]
    if order.effects:
        parts += ["--effects", ",".join(order.effects)]
    if order.budget is not None:
        parts += ["--budget", str(order.budget)]
    if order.seed:
        parts += ["--seed", str(order.seed)]
    if order.follow_up:
        parts += ["--follow-up", order.follow_up]
    if order.given:
        parts += ["--given", order.given]
    if not order.plan_next:
        parts.append("--no-next")
    return shlex.join(parts)
