"""In short: the answer in one sentence, what it rests on, and what it does not say."""

from __future__ import annotations

from explorer.report.content import Block, Bullets, Caution, Facts, Section, Text
from explorer.report.diagnosis.findings import (
    NOISE_FALL,
    OVERALL,
    amplitudes_of,
    confirmation,
    edges,
    final_model,
    kind_of,
    named,
    out_of_sight,
    overall,
    pressed,
    raced,
    spelled,
    split_label,
    summary_label,
    summary_value,
)
from explorer.report.findings import Plain
from explorer.report.units_for_people import code, enumeration, fixed, p_value, percent

FAR = 2.0
"""Error over noise floor beyond which a model is called off: a true one keeps below 1.4 in 95 of 100 cases with eight
independent numbers (√(χ²₈/8)), and below 1.8 with two."""


def in_short(result: Plain) -> Section:
    """The answer for a reader who reads nothing else."""
    blocks: list[Block] = [Text(verdict_sentence(result)), Facts(tuple(_facts(result)))]
    blocks += [Caution(text) for text in cautions(result)]
    blocks += [Text("What this does not say:"), Bullets(tuple(limits(result)))]
    return Section("In short", tuple(blocks))


def verdict_sentence(result: Plain) -> str:
    """The verdict for an engineer, with what held-out data say of it."""
    names = named(result)
    match kind_of(result):
        case "no_missing_effect":
            at_an_end = pressed(result)
            but = (
                f" But it needs {enumeration(at_an_end)} at the end of the measured range for that."
                if at_an_end
                else ""
            )
            return (
                "Nothing is missing that these data could show: the calibrated declared model differs from the "
                f"measurement by no more than noise.{but}"
            )
        case "effect":
            opening = (
                "The fitted data ask for" if confirmation(result) == "contradicted" else "The declared model lacks"
            )
            return (
                f"{opening} {code(names[0])}: with {amplitudes_of(result['amplitudes'])} it agrees with "
                f"the fitted data, {_rivals(result)}. {confirmation_sentence(result)}"
            )
        case "effects":
            return (
                f"No single effect in the list is enough; {spelled(names[0])} together are, with "
                f"{amplitudes_of(result['amplitudes'])}. {confirmation_sentence(result)}"
            )
        case "ambiguous":
            choices = " or ".join(spelled(name) for name in names)
            return (
                f"The declared model lacks something, and these data cannot tell whether it is {choices}. "
                f"{_asked_for(result)}"
            )
        case "unexplained":
            sits = f" What is left, worst condition first: {'; '.join(result['where'])}." if result["where"] else ""
            seen = len(raced(result))
            which = f"none of the {seen} effects that these data can see" if seen else "no effect that was simulated"
            return f"The declared model lacks something that {which} explains.{sits}"


def _rivals(result: Plain) -> str:
    gone = result.get("ruled_out", [])  # not in results of before 2026-11-22
    if not gone:
        return "and no other effect in the list comes near"
    return f"as {enumeration([code(name) for name in gone])} would; the held-out data rule that out"


def confirmation_sentence(result: Plain) -> str:
    """What conditions that were not fitted say, by fresh simulations."""
    row = overall(result, "holdout")
    if row is None:
        return "No condition was held out, so nothing independent confirms it."
    numbers = (
        f"from {summary_value(result, OVERALL, row['before'])} to {summary_value(result, OVERALL, row['after'])}, "
        f"where noise alone gives {summary_value(result, OVERALL, row['noise_floor'])}"
    )
    return {
        "no holdout": "",
        "within noise": "The held-out data cannot confirm it: there the declared model is within the noise already.",
        "confirmed": f"On data that were not fitted the error falls {numbers}.",
        "not certain": f"On data that were not fitted the error goes {numbers}; noise may make that gain.",
        "contradicted": f"The held-out data do not confirm it: there the error goes {numbers}.",
    }[confirmation(result)]


def cautions(result: Plain) -> list[str]:
    """What keeps the numbers of this diagnosis from meaning more than they do, one sentence each."""
    found = []
    state = confirmation(result)
    if state == "no holdout":
        found.append(
            "Without held-out data the error after is counted on the data that chose the model; it is smaller than on "
            "new ones."
        )
    if result.get("ruled_out"):
        found.append(
            "The held-out data took part in the choice of the effect, among those that the fitted data left; the error "
            "after is that much less independent, and smaller than on new data."
        )
    if state == "contradicted" and named(result):
        found.append(
            "The correction does not carry over to the held-out conditions. The effect may stand in for another one, "
            "or its amplitude may depend on the set-up; do not use the corrected model beyond the fitted conditions."
        )
    held_out = overall(result, "holdout")
    if held_out is not None and (held_out["ratio"] or 0.0) > FAR:
        found.append(
            f"On held-out data even the final model is {fixed(held_out['ratio'], 1)} times as far off as noise alone "
            "makes it: it does not hold for those conditions as it does for the fitted ones."
        )
    found += edges(result, NOISE_FALL)
    found += [
        f"`{one['effect']}` stands at the end of its simulated range; the true amplitude may be larger, and its "
        "interval is cut there."
        for one in result["amplitudes"]
        if one["at_edge"] and named(result)
    ]
    differing = _differing(result)
    if differing:
        found.append(
            f"Measured and simulated pours scatter differently in {enumeration(differing)}; these take the measured "
            "spread. Something in the model or in the measurement differs in scatter, not only in the mean."
        )
    broken = {name: result["confirmation"][name]["broken"] for name in ("before", "after")}
    if max(broken.values()):
        found.append(
            f"Fresh pours that broke off or left nothing to be read: {broken['before']} of the declared model, "
            f"{broken['after']} of the final one. Means are given that a pour ends."
        )
    if result["floored"]:
        found.append(
            f"{enumeration(_short(result['floored']))} never vary in the simulations but differ in the data; they are "
            "compared with an assumed spread."
        )
    return found


def limits(result: Plain) -> list[str]:
    """What the answer leaves open."""
    hidden = out_of_sight(result)
    seen = len(raced(result))
    found = [
        f"Only the {len(result['effects'])} effects in the table were considered, {seen} of which these data can see; "
        "something outside the list is found as `unexplained` at best."
    ]
    if hidden:
        found.append(
            f"{enumeration([code(row['name']) for row in hidden])} cannot be seen in these data, or were not "
            "simulated; each may act all the same."
        )
    kind = kind_of(result)
    if kind == "no_missing_effect":
        found.append(
            "Not found is not absent: the section on what could have been seen says how weak an effect may hide."
        )
    if kind in ("effect", "effects", "ambiguous"):
        found.append(
            "An effect that is not in the list but changes the same numbers in the same proportions would look the "
            "same."
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


def _asked_for(result: Plain) -> str:
    if not result["next_experiment"]:
        return "No change of the rig that was tried would tell them apart."
    best = result["next_experiment"][0]["experiment"]
    if best["replicates"] is None:
        return f"Most telling would be {code(best['name'])}, though no hundred pours of it settle the question."
    pours = best["replicates"]
    return f"Measure {code(best['name'])} with {pours} pour{'s' * (pours > 1)} to tell."


def _facts(result: Plain) -> list[tuple[str, str]]:
    detect, before, after = result["gates"][0], result["t2"]["before"], result["t2"]["after"]
    measured = ", ".join(
        f"{row['condition']} ({'fitted' if row['role'] == 'fit' else 'held out'}, {row['replicates']} pours, "
        f"{len(row['summaries'])} numbers each)"
        for row in result["measured"]
    )
    fit = f"T² = {fixed(before[0], 1)} on {before[1]} degrees of freedom, p = {p_value(detect['p'])}"
    if result["amplitudes"]:
        fit += f"; {fixed(after[0], 1)} on {after[1]} by {final_model(result)}"
    facts = [
        ("Verdict", code(result["verdict"])),
        ("Measured", measured),
        ("Residual of the calibrated declared model", fit),
    ]
    for role, words in (("holdout", "Error on held-out data"), ("fit", "Error on fitted data")):
        row = overall(result, role)
        if row is not None:
            facts.append((words, _error_words(result, row)))
    facts.append(
        (
            "Rests on",
            f"{result['pours']['settings']} simulated settings ({result['pours']['run']} pours run now, the others "
            f"found in the store), {result['bootstrap']} bootstrap data sets per test; errors by "
            "fresh pours, not by the emulator",
        )
    )
    return facts


def _error_words(result: Plain, row: Plain) -> str:
    floor = f"noise floor {summary_value(result, OVERALL, row['noise_floor'])}"
    if not named(result):
        inside = f"{percent(row['coverage_before'])} of the pours inside the model's 90 % interval"
        return f"{summary_value(result, OVERALL, row['before'])}, {floor}; {inside}"
    inside = f"{percent(row['coverage_before'])} → {percent(row['coverage_after'])}"
    return (
        f"{summary_value(result, OVERALL, row['before'])} before, {summary_value(result, OVERALL, row['after'])} "
        f"after, {floor}; {inside} of the pours inside the model's 90 % interval"
    )


def _differing(result: Plain) -> list[str]:
    labels = iter(row["label"] for row in result["residuals"])
    flags = [differs for comparison in result["variances"] for differs in comparison["differs"]]
    return _short([label for label, differs in zip(labels, flags, strict=True) if differs])


def _short(labels: list[str]) -> list[str]:
    return [f"{summary_label(summary)} ({condition})" for condition, summary in map(split_label, labels)]
