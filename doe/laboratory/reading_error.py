"""How far the errors of single readings carry into a quantity: the law of propagation of uncertainty (GUM).

A column ``<stem>_error_<unit>`` holds the ± a of the readings beside it: half a division, half a digit, or what the
instrument's certificate says. Anything within ± a is taken as equally likely, so that a reading has the standard
uncertainty u = a/√3. Of a quantity y = f(x₁, x₂, …) of independent readings

    u²(y) = Σ Z_i²,  Z_i = ½ [f(… x_i + u_i …) − f(… x_i − u_i …)]

which is the derivative times u_i to second order, and needs no formula for it. Over n replicates the errors of readings
are taken as common to all, as those of one scale or one balance are: u of the mean is the mean of u. With the scatter
of the replicates s

    u_c² = s²/n + u²,  ν = u_c⁴/((s²/n)²/(n − 1)),  95 % interval: mean ± t(ν) u_c

The part of the readings' errors that differs from replicate to replicate is in s already, and counts twice: the
interval is rather too wide than too narrow. Source: JCGM 100:2008 (GUM), clauses 4.3, 5.1, G.6.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from scipy import stats

from doe.laboratory.replicates import ReplicateSummary
from doe.laboratory.tables import ERROR, Reading
from doe.record import Record


@dataclass(frozen=True)
class ReadingError(Record):
    """What the declared errors of the readings add to a quantity; SI.

    values: standard uncertainty of each replicate. standard: of the mean. combined: with the scatter, ``df`` degrees of
    freedom (infinite without scatter), and the 95 % interval from it.
    """

    values: tuple[float, ...]
    standard: float
    combined: float
    df: float
    low: float
    high: float


def propagated(rows: Sequence[Reading], value: Callable[[Sequence[Reading]], float]) -> float:
    """Standard uncertainty of ``value(rows)`` by the errors that the rows declare; NaN where none does.

    A reading on the edge of what the formula takes, on one side of which it gives NaN, is varied to the other side.
    """
    declared = [
        (k, name.removesuffix(ERROR), half / math.sqrt(3.0))
        for k, row in enumerate(rows)
        for name, half in row.values.items()
        # An error beside an empty reading is that of no reading.
        if name.endswith(ERROR) and name.removesuffix(ERROR) in row.values
    ]
    if not declared:
        return math.nan
    here, parts = value(rows), []
    for k, name, u in declared:
        ends = [value(_shifted(rows, k, name, sign * u)) for sign in (1.0, -1.0)]
        up, down = (end if math.isfinite(end) else here for end in ends)
        parts.append((up - down) * (0.5 if all(map(math.isfinite, ends)) else 1.0))
    return math.hypot(*parts)


def reading_error(values: Sequence[float], summary: ReplicateSummary) -> ReadingError | None:
    """``values``: standard uncertainty of every replicate, NaN for one without; None where none changes it."""
    known = [u for u in values if math.isfinite(u)]
    if not any(known):
        return None
    standard = sum(known) / len(known)
    scatter = summary.standard_error if summary.n > 1 else 0.0
    combined = math.hypot(scatter, standard)
    df = combined**4 / (scatter**4 / (summary.n - 1)) if scatter > 0.0 else math.inf
    half = float(stats.t.ppf(0.975, df)) * combined
    return ReadingError(tuple(values), standard, combined, df, summary.mean - half, summary.mean + half)


def _shifted(rows: Sequence[Reading], k: int, name: str, by: float) -> list[Reading]:
    """``rows`` with the reading ``name`` of the ``k``-th moved."""
    moved = dataclasses.replace(rows[k], values=rows[k].values | {name: rows[k].values[name] + by})
    return [*rows[:k], moved, *rows[k + 1 :]]
