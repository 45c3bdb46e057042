"""Rows → the confusion matrix, rates with their Wilson intervals and denominators, and which targets are met.

Wilson 1927, J. Am. Stat. Assoc. 22:209: (p + z²/2n ± z √(p (1 − p)/n + z²/4n²))/(1 + z²/n), z = 1.96.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from explorer.tables.text_table import text_table
from tests.blind.sets import Answer, Row

ANSWERS: tuple[Answer, ...] = ("nothing", "right", "undecided", "unexplained", "wrong")
LEVEL = 0.95
HOLDOUT_GOOD = 1.25
"""Holdout error ÷ noise floor that a set with a right name should not exceed."""


@dataclass(frozen=True)
class Rate:
    """``hits`` of ``sets``."""

    hits: int
    sets: int

    @property
    def share(self) -> float:
        """NaN without sets."""
        return self.hits / self.sets if self.sets else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's 95 % interval; 0 … 1 without sets."""
        return wilson(self.hits, self.sets)

    def __str__(self) -> str:
        if not self.sets:
            return "no set"
        low, high = self.interval
        return f"{self.hits}/{self.sets} = {100 * self.share:.1f} % (95 % {100 * low:.1f} … {100 * high:.1f} %)"


@dataclass(frozen=True)
class Target:
    """What is aimed at, what came out, and whether that is met (None without a set to tell)."""

    name: str
    aim: str
    found: str
    met: bool | None


def wilson(hits: int, sets: int, level: float = LEVEL) -> tuple[float, float]:
    """Wilson's interval of a share; 0 … 1 without sets."""
    if sets == 0:
        return 0.0, 1.0
    z = float(stats.norm.ppf(0.5 + level / 2.0))
    share = hits / sets
    middle = share + z * z / (2 * sets)
    half = z * math.sqrt(share * (1 - share) / sets + z * z / (4 * sets * sets))
    return max(0.0, (middle - half) / (1 + z * z / sets)), min(1.0, (middle + half) / (1 + z * z / sets))


def group_of(row: Row) -> str:
    """Line of the confusion matrix that a data set belongs to."""
    if row.kind == "null":
        return "no effect"
    if row.kind == "effect":
        return f"effect, {row.strength:g} σ"
    return "pair" if row.kind == "pair" else f"outside: {row.label}"


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


def targets(rows: Sequence[Row]) -> list[Target]:
    """The targets, from judged sets."""
    effects = [row for row in rows if row.kind == "effect"]
    in_library = [row for row in rows if row.kind in ("effect", "pair")]
    strong, middle = ([row for row in effects if row.strength == s] for s in (10.0, 6.0))
    null = [row for row in rows if row.kind == "null"]
    outside = [row for row in rows if row.kind == "outside"]
    after = [row.after for row in rows if row.answer == "right" and math.isfinite(row.after)]
    good = Rate(sum(x <= HOLDOUT_GOOD for x in after), len(after))
    median = float(np.median(after)) if after else math.nan
    return [
        _target("an effect blamed where none is", _rate(null, _blamed), 0.02, at_most=True),
        _target(
            "wrong name, library effects and pairs",
            _rate(in_library, lambda row: row.answer == "wrong"),
            0.05,
            at_most=True,
        ),
        _target("right name at 10 σ", _rate(strong, lambda row: row.answer == "right"), 0.80, at_most=False),
        _target("right name at 6 σ", _rate(middle, lambda row: row.answer == "right"), 0.60, at_most=False),
        _target(
            "outside effects called unexplained",
            _rate(outside, lambda row: row.answer == "unexplained"),
            0.70,
            at_most=False,
        ),
        _target("outside effects blamed on a library effect", _rate(outside, _blamed), 0.15, at_most=True),
        Target(
            "holdout error ÷ noise floor, right names",
            "median ≤ 1.1",
            f"{median:.2f} over {len(after)} sets" if after else "no set",
            median <= 1.1 if after else None,
        ),
        _target(f"holdout error ÷ noise floor ≤ {HOLDOUT_GOOD:g}, right names", good, 0.80, at_most=False),
    ]


def _target(name: str, rate: Rate, aim: float, at_most: bool) -> Target:
    met = (rate.share <= aim if at_most else rate.share >= aim) if rate.sets else None
    return Target(name, f"{'≤' if at_most else '≥'} {100 * aim:g} %", str(rate), met)


def _rate(rows: Sequence[Row], hit: Callable[[Row], bool]) -> Rate:
    return Rate(sum(map(hit, rows)), len(rows))


def _blamed(row: Row) -> bool:
    """Whether the verdict names any library effect."""
    return row.verdict.startswith(("effect", "ambiguous"))


def _wrong(rows: Sequence[Row]) -> Iterator[str]:
    for row in rows:
        if row.answer == "wrong":
            strength = "" if math.isnan(row.strength) else f" at {row.strength:g} σ"
            yield f"wrong, set {row.number}: {row.label}{strength} → {row.verdict} (cosine {row.cosine:.2f})"


def _out_of_reach(rows: Sequence[Row]) -> Iterator[str]:
    counted = Counter((row.verdict, row.label, row.strength) for row in rows if row.answer == "out of reach")
    for (verdict, label, strength), sets in sorted(counted.items()):
        yield f"{verdict}, not counted: {label} at {strength:g} σ, {sets} sets"
