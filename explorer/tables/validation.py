"""The table of a validation campaign: confusion matrix, right names by effect, wrong names, targets."""

import math
from collections import Counter
from collections.abc import Iterator, Sequence

from doe.validation.rates import targets
from doe.validation.sets import Answer, Row
from explorer.tables.text_table import text_table

ANSWERS: tuple[Answer, ...] = ("nothing", "right", "undecided", "unexplained", "wrong")


def campaign_text(rows: Sequence[Row]) -> str:
    """All tables, for each kind of data."""
    judged = [row for row in rows if row.answer != "out of reach"]
    offers = sorted({row.offer for row in judged})
    sets = {(row.root, row.number) for row in rows}
    parts = [f"{len({(row.root, row.number) for row in judged})} of {len(sets)} data sets within reach"]
    for offer in offers:
        own = [row for row in judged if row.offer == offer]
        parts += [f"with {offer}" if offer == "scalars" else f"with a {offer}", matrix_text(own), effects_text(own)]
        parts += ["\n".join(_wrong(own)) or "no wrong name"]
        parts += [
            "\n".join(
                f"{'met' if t.met else 'no set yet' if t.met is None else 'MISSED':10}  {t.name}: {t.aim}; "
                f"found {t.found}"
                for t in targets(own, offer)
            )
        ]
    return "\n\n".join(parts)


def matrix_text(rows: Sequence[Row]) -> str:
    """Truth by answer: number of sets."""
    groups = sorted(
        {group_of(row) for row in rows}, key=lambda name: (name[:2] != "no", name[:3] == "out", len(name), name)
    )
    counted = Counter((group_of(row), row.answer) for row in rows)
    body = []
    for group in groups:
        own = [row for row in rows if group_of(row) == group]
        body.append([group, str(len(own)), *(str(counted[group, answer]) for answer in ANSWERS)])
    return text_table(["truth", "sets", *ANSWERS], body)


def effects_text(rows: Sequence[Row]) -> str:
    """Right names of the sets of each library effect, by strength; "-" where there is none."""
    strengths = sorted({row.strength for row in rows if row.kind == "effect"})
    body = []
    for label in sorted({row.label for row in rows if row.kind == "effect"}):
        cells = []
        for strength in strengths:
            own = [r for r in rows if r.kind == "effect" and (r.label, r.strength) == (label, strength)]
            cells.append(f"{sum(row.answer == 'right' for row in own)} of {len(own)}" if own else "-")
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
        if row.answer == "wrong" or (row.kind in ("null", "outside") and row.named):
            strength = "" if math.isnan(row.strength) else f" at {row.strength:.3g} σ"
            yield f"wrong, set {row.root}.{row.number}: {row.label}{strength} → {row.verdict}"
