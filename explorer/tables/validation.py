"""The table of a validation campaign: confusion matrix, right names by effect, wrong names, targets."""

import math
from collections import Counter
from collections.abc import Iterator, Sequence

from doe.validation.rates import targets
from doe.validation.sets import Answer, Row
from explorer.tables.text_table import text_table

ANSWERS: tuple[Answer, ...] = ("nothing", "right", "undecided", "unexplained", "wrong")


def campaign_text(rows: Sequence[Row]) -> str:
    """All tables."""
    judged = [row for row in rows if row.answer != "out of reach"]
    parts = [f"{len(judged)} data sets judged, {len(rows) - len(judged)} out of reach", matrix_text(judged)]
    parts += [effects_text(rows)]
    parts += ["\n".join(_wrong(judged)) or "no wrong name"]
    parts += ["\n".join(_out_of_reach(rows)) or "every strength is within reach"]
    parts += [
        "\n".join(
            f"{'met' if t.met else 'no set yet' if t.met is None else 'MISSED':10}  {t.name}: {t.aim}; found {t.found}"
            for t in targets(judged)
        )
    ]
    return "\n\n".join(parts)


def matrix_text(rows: Sequence[Row]) -> str:
    """Truth by answer: number of sets; and the root mean square of the shift that was seen [σ].

    A strength is set by the emulator, whose own error makes what is poured weaker than what was asked for.
    """
    groups = sorted(
        {group_of(row) for row in rows}, key=lambda name: (name[:2] != "no", name[:3] == "out", len(name), name)
    )
    counted = Counter((group_of(row), row.answer) for row in rows)
    body = []
    for group in groups:
        own = [row for row in rows if group_of(row) == group]
        seen = math.sqrt(sum(row.shift**2 for row in own) / len(own))
        body.append([group, str(len(own)), f"{seen:.1f}", *(str(counted[group, answer]) for answer in ANSWERS)])
    return text_table(["truth", "sets", "seen σ", *ANSWERS], body)


def effects_text(rows: Sequence[Row]) -> str:
    """Right names of the sets of each library effect, by strength; "-" where the strength is out of reach."""
    strengths = sorted({row.strength for row in rows if row.kind == "effect"})
    body = []
    for label in sorted({row.label for row in rows if row.kind == "effect"}):
        cells = []
        for strength in strengths:
            own = [r for r in rows if r.kind == "effect" and (r.label, r.strength) == (label, strength)]
            sets = [row for row in own if row.answer != "out of reach"]
            cells.append(f"{sum(row.answer == 'right' for row in sets)} of {len(sets)}" if sets else "-")
        body.append([label, *cells])
    if not body:
        return "no set with a library effect"
    return text_table(["right name", *(f"{strength:g} σ" for strength in strengths)], body)


def group_of(row: Row) -> str:
    """Line of the confusion matrix that a data set belongs to."""
    if row.kind == "null":
        return "no effect"
    if row.kind == "effect":
        return f"effect, {row.strength:g} σ"
    return "pair" if row.kind == "pair" else f"outside: {row.label}"


def _wrong(rows: Sequence[Row]) -> Iterator[str]:
    for row in rows:
        if row.answer == "wrong":
            strength = "" if math.isnan(row.strength) else f" at {row.strength:g} σ"
            yield f"wrong, set {row.number}: {row.label}{strength} → {row.verdict} (cosine {row.cosine:.2f})"


def _out_of_reach(rows: Sequence[Row]) -> Iterator[str]:
    counted = Counter((row.verdict, row.label, row.strength) for row in rows if row.answer == "out of reach")
    for (verdict, label, strength), sets in sorted(counted.items()):
        yield f"{verdict}, not counted: {label} at {strength:g} σ, {sets} sets"
