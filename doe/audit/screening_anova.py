"""The printed analysis of variance of a two-level screening, checked without and with its design, and what it names.

Without the design: F_j = SS_j/MSE for one and the same MSE, p_j = P(F(1, df_error) > F_j), and the total sum of squares
of the runs is Σ SS_j + df_error · MSE for an orthogonal design whose dummy columns are the error. With the design:
SS_j = (Σ x_j y)²/N. Source: Plackett and Burman 1946, Biometrika 33:305.

Factors that are named significant have p below the study's level, all others above it. Both are held against the p that
is printed and against the p of F, P(F(1, df_error) > F), with F as printed or, where it is not, SS over the mean square
that the factors leave of the runs. A factor counts against the study only if the whole interval that its rounded
figures allow lies on the wrong side.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.analysis.screening import holm
from doe.audit.finding import Figure, Finding, Remark, Status, compared, short, unchecked, within
from doe.audit.printed import Printed, common_half, halves_of, most_agreed, rounding_slack, values_of
from doe.audit.study import Screening
from doe.designs import plackett_burman
from doe.errors import StatisticsError

FloatArray = npt.NDArray[np.float64]
Interval = tuple[float, float]

ADDS_UP = "sums of squares add up"
F_FROM_SUMS = "F from sums of squares"
SIGNIFICANCE = "significance"
ALPHA = 0.05


def check_screening(screening: Screening) -> Iterator[Finding]:
    """F and p of every factor, the total sum of squares, and the sums of squares themselves."""
    yield from _total(screening)
    if screening.f:
        low, high = implied_mse(screening.sums, screening.f)
        yield from _f_values(screening, low, high)
        yield from _adding_up(screening, low, high)
    if screening.f and screening.p:
        yield from _p_values(screening)
    yield from _sums(screening)


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


def implied_mse(sums: Sequence[Printed], f: Sequence[Printed]) -> tuple[float, float]:
    """Interval of the error mean square SS_j/F_j that most factors agree on.

    Raises StatisticsError where no line's F has a digit to say so.
    """
    intervals = []
    for total, ratio in zip(sums, f, strict=True):
        if ratio.value <= ratio.half:
            intervals.append(((0.0, np.inf),))
        else:
            least = max(0.0, total.value - total.half) / (ratio.value + ratio.half)
            intervals.append(((least, (total.value + total.half) / (ratio.value - ratio.half)),))
    middle = float(np.median(values_of(sums) / np.maximum(values_of(f), 1e-300)))
    low, high, _ = most_agreed(intervals, middle)
    if not np.isfinite(high) or high <= 0:
        raise StatisticsError("F is too small in every line to derive the error mean square")
    return low, high


def total_of_runs(screening: Screening) -> tuple[float, float]:
    """Σ (y − mean)² and what rounding of the runs does to it."""

    def total(y: FloatArray) -> FloatArray:
        return np.array([((y - y.mean()) ** 2).sum()])

    runs = values_of(screening.responses)
    return float(total(runs)[0]), float(rounding_slack(total, runs, common_half(screening.responses))[0])


def _f_values(screening: Screening, low: float, high: float) -> Iterator[Finding]:
    mse = 0.5 * (low + high)
    for factor, total, ratio in zip(screening.factors, screening.sums, screening.f, strict=True):
        interval = max(0.0, total.interval[0]) / high, total.interval[1] / low if low > 0 else np.inf
        how = f"SS/MSE, with the MSE of {short(mse)} that the other lines imply"
        quantity = f"F of {factor.name}"
        yield within(F_FROM_SUMS, screening.where_anova, quantity, ratio, total.value / mse, interval, how)


def _p_values(screening: Screening) -> Iterator[Finding]:
    df = screening.error_df
    for factor, ratio, p in zip(screening.factors, screening.f, screening.p, strict=True):
        how = f"from the printed F on 1 and {df} degrees of freedom"
        value, interval = float(stats.f.sf(max(0.0, ratio.value), 1, df)), _p_of(ratio.interval, df)
        yield within("p from F", screening.where_anova, f"p of {factor.name}", p, value, interval, how)


def _total(screening: Screening) -> Iterator[Finding]:
    """The printed total sum of squares against that of the runs."""
    if screening.total is not None:
        value, slack = total_of_runs(screening)
        how = f"Σ (y − mean)² of the {len(screening.responses)} runs of {screening.where_runs}"
        yield compared(ADDS_UP, screening.where_anova, "total sum of squares", screening.total, value, how, slack)


def _adding_up(screening: Screening, low: float, high: float) -> Iterator[Finding]:
    """Total sum of squares of the runs against the factors' and the error's."""
    check, factors, n = ADDS_UP, values_of(screening.sums), len(screening.responses)
    total, of_runs = total_of_runs(screening)
    error = screening.error_df * 0.5 * (low + high)
    explained, parts = float(factors.sum()), n - 1 - factors.size
    of_tables = float(np.sqrt(3 * (halves_of(screening.sums) ** 2).sum())) + screening.error_df * (high - low) / 2
    slack, off = of_tables + of_runs, abs(explained + error - total)
    words = f"{explained:.2f} of the {factors.size} factors + {error:.2f} of the error that the F values imply"
    yield Figure(
        check,
        f"{screening.where_runs} and {screening.where_anova}",
        "total sum of squares",
        "differs" if off > slack else "reproduced exactly" if off <= of_tables else "only if rounded",
        f"{explained + error:.2f}",
        total,
        slack,
        f"{words}; the runs have {total:.2f}",
    )
    if parts != screening.error_df:
        yield Remark(
            check,
            screening.where_anova,
            f"{n} runs leave {parts} degrees of freedom beside the {factors.size} factors; the error has "
            f"{screening.error_df}.",
        )


def _sums(screening: Screening) -> Iterator[Finding]:
    """Every sum of squares from the design, where there is one."""
    check = "sums of squares from the design"
    if screening.design is not None:
        values, slack = _contrasts(screening, screening.design)
        how = "(Σ x y)²/N over the printed design"
        for k, (factor, print_) in enumerate(zip(screening.factors, screening.sums, strict=True)):
            quantity = f"sum of squares of {factor.name}"
            yield compared(check, screening.where_anova, quantity, print_, float(values[k]), how, float(slack[k]))
        return
    where, quantity = screening.where_anova, f"sums of squares of {len(screening.factors)} factors"
    why = f"{screening.where_runs} prints responses without the rows of the design"
    standard = _standard_design(len(screening.responses), len(screening.factors))
    if standard is not None:
        values, slack = _contrasts(screening, standard)
        fits = sum(one.agrees(float(v), float(s)) for one, v, s in zip(screening.sums, values, slack, strict=True))
        if fits == len(screening.sums):
            how = "(Σ x y)²/N with the Plackett–Burman table in standard order"
            exact = all(one.agrees(float(v)) for one, v in zip(screening.sums, values, strict=True))
            status: Status = "reproduced exactly" if exact else "only if rounded"
            yield Figure(check, where, quantity, status, "", None, float(slack.max()), how)
            return
        why += (
            f"; with the Plackett–Burman table in standard order {fits} of {len(screening.sums)} fit, so the runs are "
            "in another order or of another table"
        )
    yield unchecked(check, where, quantity, why)


def _contrasts(screening: Screening, design: FloatArray) -> tuple[FloatArray, FloatArray]:
    runs = values_of(screening.responses)

    def sums(y: FloatArray) -> FloatArray:
        return np.asarray((design.T @ y) ** 2 / len(y))

    return sums(runs), rounding_slack(sums, runs, common_half(screening.responses))


def _standard_design(runs: int, factors: int) -> FloatArray | None:
    try:
        return plackett_burman(runs)[:, :factors].astype(np.float64)
    except StatisticsError:
        return None


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


def _claim(
    screening: Screening, tested: Sequence[_Tested], quantity: str, claim: str, wrong: Callable[[Interval], bool]
) -> Figure:
    """A statement about factors, the most doubtful one last, which none of their intervals may contradict."""
    if not all(one.intervals for one in tested):
        why = f"{screening.where_anova} prints no p, and its sums of squares leave no error to test against"
        return unchecked(SIGNIFICANCE, screening.where_anova, quantity, why, claim)
    against = [one for one in tested if any(map(wrong, one.intervals))]
    return Figure(
        SIGNIFICANCE,
        screening.where_anova,
        quantity,
        "differs" if against else "reproduced exactly",
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
            SIGNIFICANCE,
            screening.where_anova,
            f"{len(names)} factors were tested at once. After Holm's correction {', '.join(lost)} "
            f"({', '.join(f'p = {adjusted[name]:.3f}' for name in lost)}) "
            f"{'is' if len(lost) == 1 else 'are'} not significant at {ALPHA:g}.",
        )
