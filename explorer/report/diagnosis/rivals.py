"""What else could look like the answer, what would tell, and what could have been seen."""

from __future__ import annotations

import math

from doe.diagnose.result import NO_EFFECT, UNEXPLAINED, EffectRow
from doe.diagnose.verdict import NOTHING_FROM, THRESHOLD
from explorer.diagnosis.result import DiagnosisResult, answers
from explorer.report.content import Block, Bullets, Caution, Section, Table, Text
from explorer.report.diagnosis.wording import chance, members, size_text
from explorer.units import MISSING, code, enumeration, fixed, percent, signed
from solver.effects import EFFECTS

VISIBLE = 4.0
"""Shift [standard errors of the data] at which an effect stands out."""
ALIKE = 0.7
"""|cosine| of two shifts from which they are called alike: half of the square of one is in the other."""
FAIR = 0.5
"""Chance of an answer below which a set-up is called unlikely to give one."""
MOST_LEVERS = 6


# What else could look the same


def rivals(result: DiagnosisResult) -> Section:
    """Effects that shift the data in a similar way, and the experiments that would tell the answers apart."""
    blocks: list[Block] = [Text(_alike_words(result))]
    pairs = _alike(result)
    if pairs:
        rows = tuple((code(a), code(b), signed(cosine), chance(result.probability(b))) for a, b, cosine in pairs)
        header = ("effect", "looks like", "cosine", "probability of the latter")
        blocks.append(Table(header, rows, "Of the shifts by their best fits, after recalibration."))
    blocks += _ranked(result)
    names = _in_question(result)
    if names:
        blocks.append(Text("Experiments that reveal one effect by itself:"))
        blocks.append(Bullets(tuple(f"{code(name)}: {EFFECTS[name].lever}" for name in names)))
    more = [f"{row.scan_would_add} in {row.condition}" for row in result.offered if row.scan_would_add]
    if more:
        blocks.append(
            Text(f"Scans of the piles would add features: {enumeration(more)}. More features tell more answers apart.")
        )
    if result.kind == "unexplained":
        blocks.append(
            Text(
                "Before looking for new physics: pour the same set-up again, check scale and units of what was "
                "measured, and the set-up itself. A condition with another outlet height or feed rate shows whether "
                "the residual goes with the rig or with the material."
            )
        )
    return Section("What else could look the same, and what would tell", tuple(blocks))


def _alike_words(result: DiagnosisResult) -> str:
    names = _asked(result)
    if not names:
        return (
            f"Two effects whose best fits shift the features with a |cosine| of {fixed(ALIKE, 1)} or more are hard to "
            "tell apart by data like these."
        )
    those = enumeration([code(name) for name in names])
    near = sorted({b for _, b, _ in _alike(result)})
    if not near:
        return f"No other effect shifts these features as {those} would (all |cosine| below {fixed(ALIKE, 1)})."
    return (
        f"What shifts the features much as {those} would, with a |cosine| of {fixed(ALIKE, 1)} or more, is told apart "
        "only by the rest of the pattern; fewer or noisier data would not do."
    )


def _alike(result: DiagnosisResult) -> list[tuple[str, str, float]]:
    """Pairs (effect in the answer, other, cosine); among all effects if the answer names none."""
    names = set(_asked(result))
    found = []
    for first, second, cosine in result.similar:
        if abs(cosine) < ALIKE or (names and not names & {first, second}):
            continue
        found.append((first, second, cosine) if not names or first in names else (second, first, cosine))
    return found


def _asked(result: DiagnosisResult) -> list[str]:
    """Single effects in the answer, also if it was taken back."""
    labels = [one for one in answers(result.taken_back or result.verdict) if one not in (NO_EFFECT, UNEXPLAINED)]
    return list(dict.fromkeys(name for label in labels for name in members(label)))


def _in_question(result: DiagnosisResult) -> list[str]:
    """Effects in the answer and those that look like them; empty if it has no effect."""
    names = _asked(result)
    return list(dict.fromkeys([*names, *(other for _, other, _ in _alike(result) if names)]))[:MOST_LEVERS]


def _ranked(result: DiagnosisResult) -> list[Block]:
    rows = tuple(
        (
            code(row.experiment.name),
            f"{row.pours} pours: {percent(row.experiment.chance)}",
            f"{fixed(row.experiment.separation)} σ",
        )
        for row in result.next_experiment
        if row.pours
    )
    if not rows:
        return []
    blocks: list[Block] = [
        Text("Set-ups of the first fitted condition, poured with every answer that is left; the most telling first:"),
        Table(
            ("set-up", "chance of an answer", "least separation of one pour"),
            rows,
            f"Chance: how often made-up data give the right answer ({percent(THRESHOLD)} for a name, "
            f"{percent(NOTHING_FROM)} for nothing missing). "
            "Separation: distance of the two answers that are closest, in σ of one pour and of the prediction.",
        ),
    ]
    if all(row.experiment.chance < FAIR for row in result.next_experiment):
        blocks.append(Caution("None of these set-ups is likely to tell the answers apart."))
    return blocks


# What could have been seen


def could_have_seen(result: DiagnosisResult) -> Section | None:
    """Approximate amplitude at which each effect would have stood out; None if something was found."""
    if result.kind != "no_missing_effect":
        return None
    rows = []
    for name in (one.name for one in result.ranges):
        row = result.effect_row(name)
        seen = (MISSING, MISSING)
        if row is not None:
            seen = f"{fixed(strength_at_end(result, row), 1)} σ", visible_from(result, row)
        rows.append((code(name), *seen, EFFECTS[name].lever))
    text = (
        f"An effect that shifts the features by {fixed(VISIBLE, 0)} standard errors of these data, recalibration "
        "counted, stands out of the noise; to be named it has to be unlike the others as well. Weaker ones may act."
    )
    caption = "By proportion to the shift of the reference amplitude, which was poured; never beyond the range."
    header = ("effect", "strength at the end of its range", "stands out from about", "what reveals it")
    return Section("What could have been seen", (Text(text), Table(header, tuple(rows), caption)))


def strength_at_end(result: DiagnosisResult, row: EffectRow) -> float:
    """Shift [σ] at the largest amplitude of an effect's range, scaled from that at its reference amplitude."""
    return row.strength * _end(result, row) / math.hypot(*row.reference)


def visible_from(result: DiagnosisResult, row: EffectRow) -> str:
    """The amplitude that shifts by ``VISIBLE``, in words; says so if the range ends before it."""
    if strength_at_end(result, row) < VISIBLE:
        return "not for certain, even at its bound"
    return size_text(row.name, math.hypot(*row.reference) * VISIBLE / row.strength)


def _end(result: DiagnosisResult, row: EffectRow) -> float:
    """Size of the end of the range in the direction of the reference amplitude."""
    bounds = result.range_of(row.name)
    ends = zip(row.reference, bounds.low, bounds.high, strict=True)
    return min(abs(low if one < 0.0 else high) for one, low, high in ends if one != 0.0)
