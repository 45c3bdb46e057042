"""The table of a validation campaign: confusion matrix, right names by effect, wrong names, targets."""

import math
from collections import Counter
from collections.abc import Iterator, Sequence

from doe.diagnose.result import BODIES_ALONE
from doe.validation.sets import RISKS, Answer, Rate, Scores, SetRow, Tempered, by_temperature, scores, targets
from explorer.terminal.text_table import text_table
from solver import PHYSICS

ANSWERS: tuple[Answer, ...] = ("nothing", "right", "undecided", "unexplained", "wrong")
TRUE: dict[str, Answer] = {"null": "nothing", "outside": "unexplained"}
"""The answer that is true of sets without a library effect."""


def campaign_text(rows: Sequence[SetRow]) -> str:
    """All tables, for each kind of data."""
    judged = [row for row in rows if row.answer != "out of reach"]
    offers = sorted({row.offer for row in judged})
    sets = {(row.root, row.number) for row in rows}
    parts = [
        f"{len({(row.root, row.number) for row in judged})} of {len(sets)} data sets within reach",
        *_by_physics(rows),
    ]
    for offer in offers:
        own = [row for row in judged if row.offer == offer]
        parts += [f"with {offer}" if offer == "scalars" else f"with a {offer}", matrix_text(own), effects_text(own)]
        parts += [followed_text(own), scores_text(scores(own)), temperatures_text(by_temperature(own))]
        parts += ["\n".join(_wrong(own)) or "no wrong name"]
        parts += [
            "\n".join(
                f"{'met' if t.met else 'no set yet' if t.met is None else 'MISSED':10}  {t.name}: {t.aim}; "
                f"found {t.found}"
                for t in targets(own, offer)
            )
        ]
    return "\n\n".join(parts)


def matrix_text(rows: Sequence[SetRow]) -> str:
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


def effects_text(rows: Sequence[SetRow]) -> str:
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


def followed_text(rows: Sequence[SetRow]) -> str:
    """Right names before and after the follow-up, which changes were asked for, and what they were said to decide."""
    asked = Counter(row.follow_up for row in rows if row.follow_up)
    library = [row for row in rows if row.kind in ("effect", "pair")]
    before, after = (
        Rate(sum(getattr(row, which) == "right" for row in library), len(library))
        for which in ("first_answer", "answer")
    )
    lines = [f"right names of library effects: {before} before the follow-up, {after} after it"]
    lines += [f"followed up: {sum(asked.values())} of {len(rows)} sets"] if asked else []
    lines += [f"  {number:4}  {change}" for change, number in asked.most_common()]
    # Rows from before the number was kept have none either.
    checks = {"checked by single bodies alone": [row for row in rows if row.follow_up == BODIES_ALONE]}
    numbers = sorted({row.asked for row in rows if row.asked})
    by_pours = {f"answered by {n} more pours": [row for row in rows if row.asked == n] for n in numbers}
    for words, own in (checks | by_pours).items():
        if own:
            right = Rate(sum(row.answer == TRUE.get(row.kind, "right") for row in own), len(own))
            chance = sum(row.chance for row in own) / len(own)
            lines.append(f"{words}, stated chance {chance:.0%}: {right}")
    return "\n".join(lines)


def scores_text(found: Scores) -> str:
    """Log loss, risk–coverage curve, reliability diagram, F1 and bias of the parameters."""
    curve = [[f"{100.0 * risk:g} %", str(rate)] for risk, rate in zip(RISKS, found.coverage, strict=True)]
    body = [
        [
            f"{one.low:g} … {one.high:g}",
            str(one.right.sets),
            f"{one.mean:.3f}" if one.right.sets else "-",
            str(one.right),
        ]
        for one in found.reliability
    ]
    return "\n\n".join(
        (
            f"log loss {found.log_loss:.3f}; F1 of named effects {found.f1:.2f}; parameters off by "
            f"{found.bias_before:.2f} σ without the named effect, {found.bias_after:.2f} σ with it",
            text_table(["wrong names at most", "right names by the most probable effect"], curve),
            text_table(["probability of the answer", "sets", "mean", "is right"], body),
        )
    )


def temperatures_text(found: Sequence[Tempered]) -> str:
    """What the temperature is chosen by."""
    body = [
        [
            f"{one.temperature:g}",
            f"{one.log_loss:.3f}",
            *(f"{rate.hits}/{rate.sets}" for rate in (one.right, one.wrong, one.false)),
        ]
        for one in found
    ]
    return text_table(["temperature", "log loss", "right names", "wrong names", "names where nothing is missing"], body)


def group_of(row: SetRow) -> str:
    """Line of the confusion matrix that a data set belongs to."""
    if row.kind == "null":
        return "no effect"
    if row.kind == "effect":
        return f"effect, {row.strength:g} σ"
    return "pair" if row.kind == "pair" else f"outside: {row.label}"


def _by_physics(rows: Sequence[SetRow]) -> Iterator[str]:
    """Where not all sets were poured by the physics of this program, how many were by which."""
    sets = Counter({(row.root, row.number): row.physics for row in rows}.values())
    if set(sets) - {PHYSICS}:
        each = ", ".join(f"{number} by {f'physics {p}' if p else 'one not kept'}" for p, number in sorted(sets.items()))
        yield f"poured: {each}; this program has physics {PHYSICS}"


def _wrong(rows: Sequence[SetRow]) -> Iterator[str]:
    for row in rows:
        if row.answer == "wrong" or (row.kind in ("null", "outside") and row.named):
            strength = "" if math.isnan(row.strength) else f" at {row.strength:.3g} σ"
            yield f"wrong, set {row.root}.{row.number}: {row.label}{strength} → {row.verdict}"
