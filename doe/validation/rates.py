"""Rows → rates with their Wilson intervals and denominators, and which targets are met.

Wilson 1927, J. Am. Stat. Assoc. 22:209: (p + z²/2n ± z √(p (1 − p)/n + z²/4n²))/(1 + z²/n), z = 1.96.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from doe.measurement.features import SCAN
from doe.validation.sets import Row

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


def targets(rows: Sequence[Row], offer: str) -> list[Target]:
    """The targets for data of the kind ``offer``, from judged sets; shares are those of the counts asked of a test."""
    own = [row for row in rows if row.offer == offer]
    effects = [row for row in own if row.kind == "effect"]
    strong, middle = ([row for row in effects if row.strength == s] for s in (10.0, 6.0))
    null = [row for row in own if row.kind == "null"]
    outside = [row for row in own if row.kind == "outside"]
    library = [row for row in own if row.kind == "pair" or (row.kind == "effect" and row.strength in (6.0, 10.0))]
    after = [row.after for row in own if row.answer == "right" and math.isfinite(row.after)]
    good = Rate(sum(x <= HOLDOUT_GOOD for x in after), len(after))
    median = float(np.median(after)) if after else math.nan
    scans = offer == SCAN
    return [
        _target("effect named where none is", _rate(null, lambda row: row.named), 1 / 150, at_most=True),
        _target("wrong name, effects of 6 and 10 σ and pairs", _rate(library, _wrong), 4 / 160, at_most=True),
        _target("right name at 6 σ", _rate(middle, _right), (53 if scans else 45) / 60, at_most=False),
        _target("right name at 10 σ", _rate(strong, _right), (57 if scans else 54) / 60, at_most=False),
        _target("outside effects called unexplained", _rate(outside, _unexplained), 48 / 60, at_most=False),
        _target("outside effects blamed on the library", _rate(outside, lambda row: row.named), 6 / 60, at_most=True),
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
    return Target(name, f"{'≤' if at_most else '≥'} {100 * aim:.3g} %", str(rate), met)


def _rate(rows: Sequence[Row], hit: Callable[[Row], bool]) -> Rate:
    return Rate(sum(map(hit, rows)), len(rows))


def _right(row: Row) -> bool:
    return row.answer == "right"


def _wrong(row: Row) -> bool:
    return row.answer == "wrong"


def _unexplained(row: Row) -> bool:
    return row.answer == "unexplained"
