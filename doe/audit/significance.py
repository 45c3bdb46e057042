"""Which factors a screening calls significant: those it names have p below its level, all others above theirs.

Both are held against the p that is printed and against the p of F, P(F(1, df_error) > F), with F as printed or, where
it is not, SS over the mean square that the factors leave of the runs. A factor counts against the study only if the
whole interval that its rounded figures allow lies on the wrong side.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import stats

from doe.audit.finding import Figure, Finding, Remark, short, unchecked
from doe.audit.printed import Printed
from doe.audit.rounding import halves_of, values_of
from doe.audit.screening_anova import total_of_runs
from doe.audit.study import Screening
from doe.multiple_tests import holm

CHECK = "significance"
ALPHA = 0.05
Interval = tuple[float, float]


@dataclass(frozen=True)
class _Tested:
    """A factor with its p as printed and the interval of the p that its F gives, None where there is none."""

    name: str
    printed: Printed | None
    of_f: Interval | None

    @property
    def intervals(self) -> tuple[Interval, ...]:
        """Everything that is known of its p."""
        known = (None if self.printed is None else self.printed.interval, self.of_f)
        return tuple(interval for interval in known if interval is not None)

    @property
    def least(self) -> float:
        """The smallest p that it may have; 1 where nothing is known."""
        return min((low for low, _ in self.intervals), default=1.0)

    @property
    def text(self) -> str:
        """Its p in words."""
        words = [] if self.printed is None else [f"{self.printed.text} as printed"]
        words += [] if self.of_f is None else [f"{short(0.5 * sum(self.of_f), 3)} from F"]
        return f"{self.name} {', '.join(words)}"


def check_significance(screening: Screening) -> Iterator[Finding]:
    """The factors named against p < level, all others against p > their level, and what Holm's correction leaves."""
    if screening.significant is None:
        return
    tested = _tested(screening)
    named = [one for one in tested if one.name in screening.significant]
    others = [one for one in tested if one.name not in screening.significant]
    if named:
        quantity = f"factors named: p < {screening.level:g}"
        yield _claim(screening, named, quantity, ", ".join(screening.significant), _above(screening.level))
    if others:
        level = screening.level_of_others
        quantity = f"factors not named: p > {level:g}"
        yield _claim(screening, others[::-1], quantity, f"the other {len(others)}", _below(level))
    if screening.p:
        yield from _lost_to_holm(screening)


def _claim(
    screening: Screening, tested: Sequence[_Tested], quantity: str, claim: str, wrong: Callable[[Interval], bool]
) -> Figure:
    """A statement about factors, the most doubtful one last, which none of their intervals may contradict."""
    if not all(one.intervals for one in tested):
        why = f"{screening.where_anova} prints no p, and its sums of squares leave no error to test against"
        return unchecked(CHECK, screening.where_anova, quantity, why, claim)
    against = [one for one in tested if any(map(wrong, one.intervals))]
    return Figure(
        CHECK,
        screening.where_anova,
        quantity,
        "differs" if against else "reproduced",
        claim,
        f"all but {', '.join(one.name for one in against)}" if against else "all of them",
        0.0,
        "; ".join(one.text for one in against) or f"nearest to the level is {tested[-1].text}",
    )


def _above(level: float) -> Callable[[Interval], bool]:
    return lambda interval: interval[0] >= level


def _below(level: float) -> Callable[[Interval], bool]:
    return lambda interval: interval[1] <= level


def _tested(screening: Screening) -> list[_Tested]:
    """All factors by rising p."""
    f = _f_intervals(screening)
    tested = [
        _Tested(
            factor.name,
            screening.p[k] if screening.p else None,
            None if f is None else _p_of(f[k], screening.error_df),
        )
        for k, factor in enumerate(screening.factors)
    ]
    return sorted(tested, key=lambda one: one.least)


def _p_of(f: Interval, df: int) -> Interval:
    low, high = np.maximum(f, 0.0)
    return float(stats.f.sf(high, 1, df)), float(stats.f.sf(low, 1, df))


def _f_intervals(screening: Screening) -> list[Interval] | None:
    """F of every factor, as printed or from what the factors leave of the runs; None where they leave no such error."""
    if screening.f:
        return [ratio.interval for ratio in screening.f]
    if len(screening.responses) - 1 - len(screening.factors) != screening.error_df:
        return None
    total, slack = total_of_runs(screening)
    left = total - float(values_of(screening.sums).sum())
    slack += float(np.sqrt(3 * (halves_of(screening.sums) ** 2).sum()))
    if left + slack <= 0:
        return None
    least, most = max(0.0, left - slack) / screening.error_df, (left + slack) / screening.error_df
    return [(one.interval[0] / most, one.interval[1] / least if least > 0 else np.inf) for one in screening.sums]


def _lost_to_holm(screening: Screening) -> Iterator[Remark]:
    names, p = [factor.name for factor in screening.factors], values_of(screening.p)
    adjusted = dict(zip(names, holm(p), strict=True))
    found = [name for name, value in zip(names, p, strict=True) if value < screening.level]
    lost = [name for name in found if adjusted[name] >= ALPHA]
    if lost:
        yield Remark(
            CHECK,
            screening.where_anova,
            f"{len(names)} factors were tested at once. After Holm's correction {', '.join(lost)} "
            f"({', '.join(f'p = {adjusted[name]:.3f}' for name in lost)}) "
            f"{'is' if len(lost) == 1 else 'are'} not significant at {ALPHA:g}.",
        )
