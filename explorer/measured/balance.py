"""A balance's readings over time → the mass that has passed the outlet, its rate, and how slow the balance is.

The reading of a balance under the pile rises, that of one under the vessel falls. Its first readings are the zero, and
the last tenth of the time has to be level. With M the mass that passed, the rate is the slope of the least-squares line
through the readings between 20 and 80 % of M.

A balance lags. If it is of first order, τ ẏ + y = m (time constant τ), a mass that grows at the rate q and stops reads
as y = q (t − τ) before the stop, and afterwards M − y = q τ exp(−(t − t_stop)/τ). The line reaches M at t_stop + τ,
where M − y = q τ/e: so τ = e (M − y)/q, read there. A flow that fades at its end looks the same, so this is an upper
bound of the lag; a delay that shifts the whole curve cannot be seen in it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from doe.laboratory.tables import MASS, TIME
from doe.table_file import CellTable, check_cells, read_table
from explorer.errors import CommandError
from solver.observables.discharge import time_of_share

Array = npt.NDArray[np.float64]

MOST_BYTES = 50_000_000
FEWEST = 10
"""Readings of the shortest curve."""
ZERO_SHARE, LEVEL_TIME, LEVEL_SHARE = 0.01, 0.1, 0.02
"""The zero lasts until the first share of the change. The last readings, over the second share of the time, differ by
no more than the third share of the change."""
STEADY = (0.2, 0.8)
"""Shares of the mass between which the rate is taken."""
SHARES_READ = (0.1, 0.5, 0.9)
MOST_INTERVALS, AGAIN, FALLEN = 5.0, 0.05, 0.05
"""A share passes once, within this number of readings and this part of the whole time; a curve falls below its zero by
no more than the third share of the change."""
COMPLETE = 0.02
"""Relative difference up to which the mass that passed counts as all of the poured mass."""
FEW_STEADY = 8
"""Number of readings between t10 and t90 below which a note says that they are few."""


@dataclass(frozen=True, eq=False)
class BalanceCurve:
    """One pour on a balance; SI, times on the balance's clock."""

    name: str
    time: Array
    """Shape (k,), ascending."""
    passed: Array
    """Mass that has passed the outlet, shape (k,), from 0 on."""
    total: float
    """Mass that had passed at the end."""
    interval: float
    """Median time between two readings."""
    rate: float
    """Slope of the middle part [kg/s]."""
    lag: float
    """Upper bound of the balance's time constant [s]."""

    def share_time(self, share: float, poured: float) -> float:
        """Time [s] at which ``share`` of ``poured`` [kg] had passed, linear between readings; NaN if it never did."""
        return time_of_share(share, self.time, self.passed, self.whole(poured))

    def whole(self, poured: float) -> float:
        """The mass [kg] to which shares refer: what passed, if that counts as all of ``poured``; else ``poured``."""
        return self.total if abs(self.total - poured) <= COMPLETE * poured else poured

    def line(self, poured: float, lag: float | None, started: bool = True) -> str:
        """What was read off the curve, its sampling and its lag; ``lag``: the stated one, ``started``: with a start."""
        off = "taken off its times" if started else "without --starts there is no time to take it off"
        said = f"stated, {lag:g} s, and {off}" if lag is not None else "not stated, nothing is taken off"
        t10, t90 = (self.share_time(share, poured) for share in (0.1, 0.9))
        between = int(((self.time > t10) & (self.time < t90)).sum())
        told = between < FEW_STEADY and math.isfinite(t90)
        few = f"; only {between} readings lie between t10 and t90" if told else ""
        return (
            f"{self.name}: {1e3 * self.total:.4g} g passed, {self.total / poured:.1%} of what is poured; "
            f"{1e3 * self.rate:.4g} g/s; a reading every {self.interval:.3g} s{few}; lag of the balance: at most "
            f"{self.lag:.2g} s by the end of the curve, {said}"
        )


def read_balance(path: Path) -> BalanceCurve:
    """The curve in ``path``, with columns time_s|ms|min and mass_kg|g|mg; others are ignored.

    Raises CommandError in one line naming file, line and what is allowed.
    """
    table = read_table(path, MOST_BYTES, CommandError, ":{}", comments=True)
    if not table.rows:
        raise CommandError(f"{path}: no rows; allowed: columns time_s and mass_g, and readings below")
    check_cells(table, lambda line, what: CommandError(f"{path}:{line}: {what}"), short=True)
    time, mass = (_column(path, table, stem, units) for stem, units in (("time", TIME), ("mass", MASS)))
    if time.size < FEWEST:
        raise CommandError(f"{path}: {time.size} readings; allowed: {FEWEST} or more")
    if (behind := np.flatnonzero(np.diff(time) <= 0.0)).size:
        line = table.rows[int(behind[0]) + 2][0]
        raise CommandError(f"{path}:{line}: time: does not increase; allowed: a later time in every row")
    change = float(np.median(_last(time, mass))) - mass[0]
    moved = np.flatnonzero(np.abs(mass - mass[0]) > ZERO_SHARE * abs(change))
    zero = float(np.median(mass[: max(1, int(moved[0]) if moved.size else mass.size)]))
    total = float(np.median(_last(time, mass))) - zero
    passed = np.sign(total) * (mass - zero)
    total = abs(total)
    if not total > 0.0 or np.ptp(_last(time, passed)) > LEVEL_SHARE * total:
        raise CommandError(
            f"{path}: mass: not constant at the end; allowed: readings until the flow has stopped, with the last "
            f"{LEVEL_TIME:.0%} of the time within {LEVEL_SHARE:.0%} of the change"
        )
    _require_one_rise(path, table, time, passed / total)
    low, high = (int(np.argmax(passed >= share * total)) for share in STEADY)
    if high - low < 2:
        raise CommandError(
            f"{path}: {high - low + 1} readings between {STEADY[0]:.0%} and {STEADY[1]:.0%} of the mass; allowed: 3 or "
            "more, from a balance that reads faster"
        )
    rate, offset = np.polyfit(time[low : high + 1], passed[low : high + 1], 1)
    reached = (total - offset) / rate
    left = total - float(np.interp(reached, time, passed))
    return BalanceCurve(
        name=path.name,
        time=time,
        passed=passed,
        total=total,
        interval=float(np.median(np.diff(time))),
        rate=float(rate),
        lag=max(0.0, math.e * left / float(rate)),
    )


def _require_one_rise(path: Path, table: CellTable, time: Array, share: Array) -> None:
    """Refuse a curve that a touched pan has spoilt: its times would be those of the disturbance.

    ``share``: of the mass that has passed at the end, shape (k,).
    """
    if share.min() < -FALLEN:
        line = table.rows[int(share.argmin()) + 1][0]
        raise CommandError(
            f"{path}:{line}: mass: {-share.min():.0%} of the change on the other side of its first readings, which are "
            "the zero; allowed: a curve that begins before the flow does, with the pan untouched"
        )
    apart = max(MOST_INTERVALS * float(np.median(np.diff(time))), AGAIN * float(time[-1] - time[0]))
    for wanted in SHARES_READ:
        first = int(np.argmax(share >= wanted))
        last = int(np.flatnonzero(share < wanted)[-1]) + 1
        if time[last] - time[first] > apart:
            line = table.rows[first + 1][0]
            raise CommandError(
                f"{path}:{line}: mass: {wanted:.0%} of the change has passed at {time[first]:.4g} s, and again at "
                f"{time[last]:.4g} s; allowed: a curve that goes one way (leave out rows in which the pan was touched)"
            )


def _last(time: Array, values: Array) -> Array:
    """The ``values`` in the last ``LEVEL_TIME`` of the time."""
    return values[time >= time[-1] - LEVEL_TIME * (time[-1] - time[0])]


def _column(path: Path, table: CellTable, stem: str, units: dict[str, float]) -> Array:
    """The column ``stem``_<unit> [SI]."""
    (line, header), *rows = table.rows
    allowed = {f"{stem}_{unit}": factor for unit, factor in units.items()}
    found = [k for k, name in enumerate(header) if name in allowed]
    if len(found) != 1:
        raise CommandError(
            f"{path}:{line}: columns {','.join(header)[:60]}; allowed: one of {', '.join(allowed)} among them"
        )
    values = []
    for at, cells in rows:
        cell = cells[found[0]] if found[0] < len(cells) else ""
        values.append(table.number(cell))
        if math.isnan(values[-1]):
            raise CommandError(f"{path}:{at}: {header[found[0]]}: {cell[:40]!r}; allowed: a finite number")
    return np.array(values) * allowed[header[found[0]]]
