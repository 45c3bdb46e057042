"""The answer: what is missing, how certain it is, and what it does not say."""

from __future__ import annotations

from doe.diagnose.result import NO_EFFECT, UNEXPLAINED, EffectRow, Place
from doe.holdout import OVERALL, HeldOut
from explorer.diagnosis.result import CORRECTED, CORRECTED_STUDY, DiagnosisResult, ErrorRow, Kind, answers
from explorer.report.content import Banner, Block, Bullets, Caution, Facts, Figure, Section, Table, Text, Word
from explorer.report.diagnosis.charts import likely, probability_chart
from explorer.report.diagnosis.evidence import strained
from explorer.report.diagnosis.wording import (
    FOLLOW_UPS_SO_FAR,
    amplitudes_of,
    chance,
    feature_in,
    feature_label,
    feature_value,
    given_text,
    literature_bound,
    members,
    model_words,
    share_of_bound,
    spelled,
    with_fit,
)
from explorer.units import MISSING, code, counted, enumeration, fixed, p_value, percent, signed
from solver.effects import EFFECTS, Stage

FAR = 2.0
"""Error over noise floor above which a model is reported as off: a true model stays below 1.4 in 95 of 100 cases with
eight independent numbers (√(χ²₈/8)), and below 1.8 with two."""
WIDE = 1.5
"""Ratio of the variances of measured replicates and simulated pours from which it is mentioned."""
LOOSE = 0.3
"""Probability of data as far from a named effect as these, below which a note says that another may hide beside it.
Three in ten correct names lie below it by chance. Of 20 names of one effect by scans (root 1) six did: three of 17
correct ones, both that were one of two effects, and the one for an outside effect (``docs/how_often_right.md``)."""
ADHESIONS = {name for name, effect in EFFECTS.items() if getattr(effect, "stage", None) == Stage.ADHESION}
"""Effects that pull surfaces together."""


# In short


WORDS: dict[Kind, Word] = {
    "no_missing_effect": Word.NOTHING_MISSING,
    "effect": Word.EFFECT_FOUND,
    "effects": Word.EFFECT_FOUND,
    "ambiguous": Word.NO_ANSWER,
    "unexplained": Word.UNEXPLAINED,
}


def banner(result: DiagnosisResult) -> Banner:
    """The answer as a verdict."""
    found = enumeration([spelled(one).replace("`", "").replace("_", " ") for one in result.named])
    of = f"{found}, {chance(result.missing(result.named[0]))}" if result.named else ""
    return Banner(WORDS[result.kind], of, verdict_sentence(result), _what_next(result))


def _what_next(result: DiagnosisResult) -> str:
    match result.kind:
        case "no_missing_effect":
            return (
                "Use the calibrated model; the section on what could have been seen says what may still hide."
                f"{_check(result)}"
            )
        case "effect" | "effects":
            return (
                f"Pour the corrected material, and calibrate it with its study: `{CORRECTED}` and "
                f"`{CORRECTED_STUDY}`, which `explorer diagnose … --apply` writes beside this report. What else is "
                f"missing beside it, {_asking_further(result)} asks.{_check(result)}"
            )
        case "ambiguous":
            return _with_command(result)
        case "unexplained":
            further = ""
            if result.handed_on():
                further = (
                    " Two effects at once look like one that comes near: what is missing beside it, "
                    f"{_asking_further(result)} asks."
                )
            return (
                "Pour the same set-up again, and check scale, units and the set-up before looking for new physics."
                + further
            )


def _check(result: DiagnosisResult) -> str:
    """Which measurements on single bodies would check the answer; empty if none would."""
    return f" {_with_command(result)}" if result.next_experiment else ""


def _with_command(result: DiagnosisResult) -> str:
    """What to measure, and the command that uses it."""
    return f"{follow_up_text(result)} `explorer diagnose … --follow-up` takes them."


def _asking_further(result: DiagnosisResult) -> str:
    """The command that looks for what else is missing."""
    return f"`explorer diagnose … --given {result.order.out}`"


def in_short(result: DiagnosisResult) -> Section:
    """The answer for a reader who reads nothing else."""
    fitted = sum(row.replicates for row in result.measured if row.role == "fit")
    blocks: list[Block] = [
        Text(verdict_sentence(result)),
        Facts(tuple(_facts(result))),
        Figure(
            "probabilities",
            probability_chart(result),
            f"Posterior probability of each answer (n = {sum(row.features for row in result.offered)} features of "
            f"{counted(fitted, 'measured pour')}). Pale: with another effect, also counted in the pair's row; dashed: "
            f"{percent(result.threshold)}, from which on the most probable effect is named.",
        ),
        _probability_table(result),
    ]
    blocks += [Caution(text) for text in cautions(result)]
    blocks += [Text("What this does not say:"), Bullets(tuple(limits(result)))]
    return Section("In short", tuple(blocks))


def verdict_sentence(result: DiagnosisResult) -> str:
    """The verdict for an engineer, with what held-out data say about it, and what the model already had."""
    if not result.given:
        return _verdict(result)
    known = enumeration([code(name) for name in result.given])
    return f"The declared model holds {known} here, by an earlier diagnosis. {_verdict(result)}"


def _verdict(result: DiagnosisResult) -> str:
    if result.taken_back and result.held_out is not None:
        return _taken_back(result, result.held_out)
    match result.kind:
        case "no_missing_effect":
            best = result.ranked()[1]
            return (
                "Nothing is missing that these data could show: the calibrated declared model explains them, with "
                f"probability {_sure(result.probability(NO_EFFECT))}. The next answer is {spelled(best[0])}, "
                f"{chance(best[1])}."
            )
        case "effect":
            (name,) = result.named
            return (
                f"The declared model lacks {code(name)}, with probability {_sure(result.missing(name))}"
                f"{_alone(result, name)}. It agrees with the fitted data at {_amplitudes(result, name)}. "
                f"{confirmation_sentence(result)}"
            )
        case "effects":
            (pair,) = result.named
            return (
                f"The declared model lacks two effects at once, {spelled(pair)}, with probability "
                f"{_sure(result.missing(pair))}; no single effect comes near. They agree with the fitted data at "
                f"{_amplitudes(result, pair)}. {confirmation_sentence(result)}"
            )
        case "ambiguous":
            left = [f"{spelled(one)} ({chance(result.probability(one))})" for one in answers(result.verdict)]
            opening = (
                "These data"
                if NO_EFFECT in answers(result.verdict)
                else "The declared model lacks something; these data"
            )
            told = [
                f"{opening} leave {len(left)} answers: {enumeration(left)}.",
                _in_common(result),
                follow_up_text(result),
            ]
            return " ".join(text for text in told if text)
        case "unexplained":
            return f"{_unexplained(result)} {_sits(result)}"


def _alone(result: DiagnosisResult, name: str) -> str:
    """Whether the data show that a named effect is alone."""
    p = result.probability(name)
    return "" if p >= result.threshold else f", alone ({chance(p)}) or with another effect"


def _in_common(result: DiagnosisResult) -> str:
    """What is settled although several answers remain: an effect common to all, or that all are adhesions."""
    left = [set(members(one)) for one in answers(result.verdict)]
    if shared := sorted(set.intersection(*left)):
        p = sum(row.probability for row in result.effects if set(shared) <= set(members(row.name)))
        return f"In all of them {spelled('+'.join(shared))} is missing, alone or with something else ({chance(p)})."
    if set.union(*left) <= ADHESIONS:
        p = sum(row.probability for row in result.effects if set(members(row.name)) <= ADHESIONS)
        return f"All of them are laws of adhesion: that surfaces stick is settled ({chance(p)}), by which law is not."
    return ""


def confirmation_sentence(result: DiagnosisResult) -> str:
    """What conditions that were not fitted say, from fresh simulations."""
    row = result.overall("holdout")
    if row is None:
        return "No condition was held out, so nothing independent confirms it."
    numbers = (
        f"from {feature_value(result, OVERALL, row.before)} to {feature_value(result, OVERALL, row.after)}, "
        f"where noise alone gives {feature_value(result, OVERALL, row.noise_floor)}"
    )
    return {
        "no holdout": "",
        "within noise": "The held-out data cannot confirm it: there the declared model is within the noise already.",
        "confirmed": f"On data that were not fitted the error falls {numbers}.",
        "not certain": f"On data that were not fitted the error goes {numbers}; noise may make that gain.",
        "not confirmed": f"The held-out data do not confirm it: there the error goes {numbers}.",
    }[result.confirmed()]


def cautions(result: DiagnosisResult) -> list[str]:
    """Limits on the meaning of the numbers of this diagnosis, one sentence each."""
    found = []
    state = result.confirmed()
    if state == "no holdout":
        found.append(
            "Without held-out data the error after is counted on the data that chose the model; it is smaller than on "
            "new ones."
        )
    if state == "not confirmed" and result.named:
        found.append(
            "The correction does not carry over to the held-out conditions. The effect may stand in for another one, "
            "or its amplitude may depend on the set-up; do not use the corrected model beyond the fitted conditions."
        )
    row = result.overall("holdout")
    if row is not None and row.ratio > FAR:
        model = "even the final model" if result.added else "the declared model"
        found.append(
            f"On held-out data {model} is {fixed(row.ratio, 1)} times as far off as noise alone "
            "makes it: it does not hold for those conditions as it does for the fitted ones."
        )
    found += strained(result)
    final = result.effect_row(result.final)
    if final is not None:
        found += [
            f"{code(one.effect)} fits best at the largest amplitude that was considered; the true one may be "
            "larger, and the interval is cut there."
            for one in final.amplitudes
            if one.at_end
        ]
    if final is not None and result.kind == "effect" and final.p < LOOSE:
        found.append(
            f"Data as far off {spelled(final.name)} as these come up in {percent(final.p)} of cases if nothing else is "
            "missing. That is no contradiction, but the stronger one of two effects shows like this: "
            f"{_asking_further(result)} asks whether it is alone."
        )
    if result.scatter > WIDE:
        found.append(
            f"Measured pours scatter with {fixed(result.scatter)} times the variance of simulated ones. The noise "
            "of the data is widened by that; something in the model or in the measurement differs in scatter, not only "
            "in the mean."
        )
    before, after = result.confirmation.before.broken, result.confirmation.after.broken
    if max(before, after):
        found.append(
            f"Fresh pours that broke off or left nothing to be read: {before} of the declared model, "
            f"{after} of the final one. Means are those of the others."
        )
    found += _not_compared(result)
    return found


def _not_compared(result: DiagnosisResult) -> list[str]:
    """Conditions whose summaries fewer than two fresh pours of a model gave."""
    models = result.confirmation.before, result.confirmation.after
    before, after = ({row.condition: row.pours for row in model.conditions} for model in models)
    found = []
    for row in result.measured:
        if min(before[row.condition], after[row.condition]) < 2:
            untested = row.role == "holdout" and after[row.condition] < 2
            found.append(
                f"{row.condition} is in no error of this report: fewer than two fresh pours of the declared or of the "
                f"final model gave all its summaries.{' It does not test the answer.' if untested else ''}"
            )
    return found


def limits(result: DiagnosisResult) -> list[str]:
    """What the answer leaves open."""
    found = [
        f"Only {len(result.ranges)} effects were considered, and pairs of them only where something "
        "outside the library would else be likely; whatever else is missing is found as `unexplained` at best."
    ]
    kind = result.kind
    if kind == "no_missing_effect":
        found.append(
            "Not found is not absent: the section on what could have been seen says how weak an effect may hide."
        )
    if result.added:
        found.append(
            "An effect outside the library that changes the same features in the same proportions would look the same."
        )
        found.append(
            "Amplitudes hold together with the declared contact law, shapes and parameter ranges; they are not "
            "measured constants of the material."
        )
    if kind == "unexplained":
        found.append(
            "Nothing here tells a physical effect from a mistake in the measurement (a scale, a unit, a wrong set-up); "
            "look there first."
        )
    return found


def _taken_back(result: DiagnosisResult, told: HeldOut) -> str:
    fitted = answers(result.taken_back)
    first = " or ".join(f"{spelled(one)} ({chance(result.probability(one))})" for one in fitted)
    return (
        f"The fitted data give {first}, but the held-out data contradict it, so it is taken back: "
        f"{feature_label(told.summary)} of condition {told.condition} is {fixed(told.farthest, 1)} standard "
        f"errors from fresh pours of {model_words(told.label)} (p = {p_value(told.p)}, corrected for the number "
        f"of summaries{with_fit(told)}). The answer is that something is missing or wrong that none of the effects "
        f"explains in all conditions. {confirmation_sentence(result) if result.added else ''}".rstrip()
    )


def _unexplained(result: DiagnosisResult) -> str:
    best, p = result.ranked()[0]
    row = result.effect_row(best)
    if row is not None:
        return (
            f"The declared model lacks something. {spelled(best)} comes nearest ({chance(p)}), and yet does not "
            f"fit: data as far off it as these have p = {p_value(row.p)}."
        )
    if best == UNEXPLAINED:
        return (
            f"The declared model lacks something that none of the {len(result.ranges)} effects explains, with "
            f"probability {_sure(p)}."
        )
    return "The calibrated declared model does not fit the data, and no effect comes nearer to them."


def _sits(result: DiagnosisResult) -> str:
    """Where the residual is, in a sentence."""
    worst = result.where[0]
    return (
        f"{percent(worst.share)} of the squared residual is in condition {worst.condition}; farthest off there "
        f"is {feature_label(worst.feature)}, by {signed(worst.z, 1)} standard errors."
    )


def _amplitudes(result: DiagnosisResult, label: str) -> str:
    row = result.effect_row(label)
    assert row is not None
    found = [
        f"{amplitudes_of([one for one in row.amplitudes if one.effect == name])}, {share} of the strongest that "
        "the literature supports"
        for name, share in zip(members(label), _of_bounds(row), strict=True)
    ]
    return "; and ".join(found)


def _of_bounds(row: EffectRow) -> list[str]:
    """Amplitudes relative to the strongest that the literature supports, effect by effect."""
    values = {name: [one.value for one in row.amplitudes if one.effect == name] for name in members(row.name)}
    return [percent(share_of_bound(name, own)) for name, own in values.items()]


def follow_up_text(result: DiagnosisResult) -> str:
    """What would tell the remaining answers apart, or check the one given, and with which chance."""
    if not result.order.plan_next:
        return "What could tell them apart was not looked for (`--no-next`)."
    if not result.next_experiment:
        return "No change of the rig that was tried would tell them apart."
    first = result.next_experiment[0]
    best, pours = first.experiment, first.pours
    numbers = enumeration(list(dict.fromkeys(quantity.replace("_", " ") for _, quantity in first.bodies)))
    if not pours:
        others = enumeration([spelled(label) for label in first.rivals[1:]])
        return f"To check it, measure {numbers} of single bodies, without a pour: that tells it from {others}."
    what = f"{pours} pours of {code(best.name)}"
    if first.bodies:
        what += f", with {numbers} of single bodies,"
    text = f"{what} would single out the right one with a chance of {percent(best.chance)}."
    # Counted on first follow-ups alone.
    return text if result.order.follow_up else f"{text} {FOLLOW_UPS_SO_FAR}"


def _facts(result: DiagnosisResult) -> list[tuple[str, str]]:
    compared = {row.condition: row.features for row in result.offered}
    measured = ", ".join(
        f"{row.condition} ({'fitted' if row.role == 'fit' else 'held out'}, {counted(row.replicates, 'pour')}, "
        + (
            f"{compared[row.condition]} features compared)"
            if row.condition in compared
            else f"{len(row.summaries)} summaries predicted)"
        )
        for row in result.measured
    )
    facts = [("Verdict", code(result.verdict)), ("Measured", measured)]
    if result.given:
        sizes = "; ".join(given_text(name, amplitude) for name, amplitude in result.given.items())
        facts.append(("In the model already", f"{sizes}; calibrated with the other parameters about that"))
    row = result.effect_row(result.final)
    if row is not None:
        bounds = "; ".join(
            f"{code(name)} up to {literature_bound(name)} ({EFFECTS[name].literature})" for name in members(row.name)
        )
        facts.append((f"Amplitude of {spelled(row.name)}", _amplitudes(result, row.name)))
        facts.append(("Supported by the literature", bounds))
    facts += [("Largest residual", f"{feature_in(one)}, {signed(one.z)} σ") for one in _worst(result)]
    for words, total in (
        ("Error on held-out data", result.overall("holdout")),
        ("Error on fitted data", result.overall("fit")),
    ):
        if total is not None:
            facts.append((words, _error_words(result, total)))
    facts.append(
        (
            "Rests on",
            f"{result.pours.settings} simulated settings ({result.pours.run} pours run now, the others "
            "found in the store); errors by fresh pours, not by the regression",
        )
    )
    return facts


def _worst(result: DiagnosisResult) -> list[Place]:
    return sorted(result.where, key=lambda one: -abs(one.z))[:1]


def _error_words(result: DiagnosisResult, row: ErrorRow) -> str:
    floor = f"noise floor {feature_value(result, OVERALL, row.noise_floor)}"
    if not result.added:
        inside = f"{percent(row.coverage_before)} of the pours inside the model's 90 % interval"
        return f"{feature_value(result, OVERALL, row.before)}, {floor}; {inside}"
    inside = f"{percent(row.coverage_before)} → {percent(row.coverage_after)}"
    return (
        f"{feature_value(result, OVERALL, row.before)} before, {feature_value(result, OVERALL, row.after)} "
        f"after, {floor}; {inside} of the pours inside the model's 90 % interval"
    )


def _probability_table(result: DiagnosisResult) -> Table:
    rows = []
    for answer, p in likely(result):
        row = result.effect_row(answer)
        if row is None:
            rows.append((spelled(answer), chance(p), MISSING, MISSING, MISSING))
        else:
            sizes, bounds = amplitudes_of(row.amplitudes), ", ".join(_of_bounds(row))
            rows.append((spelled(answer), chance(p), chance(row.missing), sizes, bounds))
    rest = max(0.0, 1.0 - sum(p for _, p in likely(result)))
    rows.append(("all other answers together", chance(rest), MISSING, MISSING, MISSING))
    return Table(
        ("answer", "probability", "alone or with others", "amplitude", "of the literature's bound"),
        tuple(rows),
        f"The most probable effect or pair is named from {percent(result.threshold)} on; after a "
        "follow-up alone and with others together.",
    )


def _sure(p: float) -> str:
    return "over 99 %" if p >= 0.995 else percent(p, 1)
