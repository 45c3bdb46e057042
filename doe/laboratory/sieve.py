"""Sizes by sieving: the cumulative curve of the mass, its percentiles, and how sizes scatter.

    undersize        Q(x_i) = mass that passed the sieve x_i over the sum of all fractions
    percentile       d_p: Q = p, linear in Q over ln x between two neighbouring sieves; none below the finest sieve or
                     above the coarsest, where nothing was measured
    span             (d90 − d10)/d50
    Rosin–Rammler    1 − Q = exp(−(x/x')^n), a line of ln(−ln(1 − Q)) over ln x, by least squares over all sieves with
                     0.1 % < Q < 99.9 %; x' is where 36.8 % stay above
    loss             (m_total − Σ m_i)/m_total, where the sample was weighed before

Bodies are counted on the solver, and weighed here. If sizes are log-normal, ln x has the same deviation σ by number and
by mass, and the median by number is exp(−3σ²) times that by mass, since mass goes with x³ (the moments of a log-normal
distribution; Hatch and Choate):

    σ = ln(d84/d16)/2, 16 and 84 being Φ(−1) and Φ(1)
    size_spread = √(exp(σ²) − 1), the coefficient of variation of such a distribution
    mean size by number = d50 exp(−3σ²) exp(σ²/2)

A sieve sorts by the second largest dimension of a body, roughly, and by how long it is shaken. Sources: ISO 2591-1
(test sieving), ASTM C136 (aggregates); Rosin & Rammler 1933; DIN 66145 for its line.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt
from scipy import stats

from doe.laboratory.reading_error import propagated
from doe.laboratory.result import Derived, derived
from doe.laboratory.tables import COMPONENT, LENGTH, MASS, Column, Layout, Reading, Table, by_replicate, positive

Array = npt.NDArray[np.float64]
Value = Callable[[Sequence[Reading]], float]

LARGE_LOSS = 0.01
"""Of the mass, from which on a loss is named; our own limit. ASTM and ISO have their own, by kind of material."""
EDGE = 1e-3
"""Of the mass, next to none and all, where the double logarithm is made of errors of weighing."""
LEAST_EXPONENT = 0.01
"""Rosin–Rammler exponent below which a curve is level: real powders have 0.5 and more."""
FEWEST_SIEVES = 3
"""Through which a line of Rosin and Rammler is laid; two fix it and show no misfit."""
SIGMA = float(stats.norm.cdf(1.0))
"""Φ(1), 84.13 %."""
BY_NUMBER = (
    "size_spread and size_number_mean hold for log-normal sizes; the size of the material's shape is the mean by "
    "number, a sieve's is by mass"
)
INTERPOLATED = "percentiles are linear in the undersize over ln x between neighbouring sieves"
SIEVE = Layout(
    COMPONENT,
    (
        Column(
            "aperture",
            LENGTH,
            low=0.0,
            zero=True,
            says="opening of the sieve, 0 for the pan; a row for every sieve of the stack, in any order",
            unit="mm",
            example="0",
        ),
        Column(
            "mass_retained", MASS, low=0.0, zero=True, says="mass that stays on it, 0 if none", unit="g", example="12.4"
        ),
        positive(
            "mass_total",
            MASS,
            "sample before sieving, in one or all rows of the replicate: for the loss",
            "g",
            "250.3",
            needed=False,
            blank=True,
        ),
    ),
    curves=True,
    gives="d10, d50, d90 by mass, span, spread of sizes, Rosin–Rammler line, loss",
    replicates="three samples, split and not scooped; shake until the masses no longer change",
    standard="ISO 2591-1 (test sieving), ASTM C136 (aggregates)",
)


def sieve(table: Table) -> tuple[tuple[Derived, ...], tuple[str, ...]]:
    """Percentiles, span, spread, Rosin–Rammler line and loss of every component, and notes."""
    found: list[Derived] = []
    notes = [INTERPOLATED, BY_NUMBER]
    for of, rows in table.groups().items():
        samples = by_replicate(rows)
        for name, sample in samples.items():
            _check(table, sample)
            lost = loss(sample)
            if math.isfinite(lost) and abs(lost) > LARGE_LOSS:
                notes.append(f"{of[0]}, replicate {name}: {100.0 * lost:.2g} % of the sample were lost in sieving")
        for quantity, unit, formula, value in QUANTITIES:
            values = {name: value(sample) for name, sample in samples.items()}
            missing = [name for name, one in values.items() if not math.isfinite(one)]
            if quantity == "sieving_loss" and len(missing) < len(values):
                # A sample that was not weighed before has none; those of the others stand.
                values = {name: one for name, one in values.items() if name not in missing}
            elif missing and quantity != "sieving_loss":
                why = "the sieves do not reach so far"
                if quantity.startswith("rosin_rammler"):
                    why = f"fewer than {FEWEST_SIEVES} sieves lie in the curve, or it does not rise,"
                where = f"in replicate {', '.join(missing)}; add coarser or finer ones"
                notes.append(f"{of[0]}: no {quantity}: {why} {where}")
            if all(map(math.isfinite, values.values())):
                errors = [propagated(samples[name], value) for name in values]
                path = f"body.{of[0]}.size_spread" if quantity == "size_spread" else ""
                names, of_all = list(values), list(values.values())
                found.append(derived(table, quantity, unit, of, formula, names, of_all, path, (), errors))
    return tuple(found), tuple(notes)


def undersize(rows: Sequence[Reading]) -> tuple[Array, Array]:
    """Openings [m], ascending and without the pan's, and the share of the mass that is finer than each; shape (s,)."""
    ordered = sorted(rows, key=lambda row: row.values["aperture"])
    mass = np.array([row.values["mass_retained"] for row in ordered])
    finer = np.cumsum(mass)[:-1] / mass.sum()
    return np.array([row.values["aperture"] for row in ordered[1:]]), finer


def percentile(rows: Sequence[Reading], share: float) -> float:
    """Size [m] that ``share`` of the mass is finer than; NaN beyond the sieves."""
    x, finer = undersize(rows)
    above = np.flatnonzero(finer >= share)
    if above.size == 0 or (above[0] == 0 and finer[0] > share):
        return math.nan
    k = int(above[0])
    if k == 0:
        return float(x[0])
    part = (share - finer[k - 1]) / (finer[k] - finer[k - 1])
    return float(x[k - 1] * (x[k] / x[k - 1]) ** part)


def span(rows: Sequence[Reading]) -> float:
    """(d90 − d10)/d50."""
    return (percentile(rows, 0.9) - percentile(rows, 0.1)) / percentile(rows, 0.5)


def log_deviation(rows: Sequence[Reading]) -> float:
    """σ of ln x, if sizes are log-normal."""
    return 0.5 * math.log(percentile(rows, SIGMA) / percentile(rows, 1.0 - SIGMA))


def size_spread(rows: Sequence[Reading]) -> float:
    """√(exp(σ²) − 1)."""
    return math.sqrt(math.expm1(log_deviation(rows) ** 2))


def number_mean(rows: Sequence[Reading]) -> float:
    """Mean size by number [m], if sizes are log-normal."""
    return percentile(rows, 0.5) * math.exp(-2.5 * log_deviation(rows) ** 2)


def rosin_rammler(rows: Sequence[Reading]) -> tuple[float, float]:
    """x' [m] and n; NaN with fewer than ``FEWEST_SIEVES`` sieves in the curve, or if it does not rise there."""
    x, finer = undersize(rows)
    inside = (finer > EDGE) & (finer < 1.0 - EDGE)
    if inside.sum() < FEWEST_SIEVES:
        return math.nan, math.nan
    n, constant = np.polyfit(np.log(x[inside]), np.log(-np.log1p(-finer[inside])), 1)
    if n < LEAST_EXPONENT:
        return math.nan, math.nan
    return float(np.exp(-constant / n)), float(n)


def loss(rows: Sequence[Reading]) -> float:
    """(m_total − Σ m_i)/m_total; NaN where the sample was not weighed before."""
    total = next((row.values["mass_total"] for row in rows if "mass_total" in row.values), math.nan)
    return 1.0 - sum(row.values["mass_retained"] for row in rows) / total


def _at(share: float) -> Value:
    return lambda rows: percentile(rows, share)


QUANTITIES: tuple[tuple[str, str, str, Value], ...] = (
    ("d10", "m", "Q = 10 %", _at(0.1)),
    ("d50", "m", "Q = 50 %", _at(0.5)),
    ("d90", "m", "Q = 90 %", _at(0.9)),
    ("span", "1", "(d90 − d10)/d50", span),
    ("size_spread", "1", "√(exp(σ²) − 1), σ = ln(d84/d16)/2", size_spread),
    ("size_number_mean", "m", "d50 exp(−2.5σ²)", number_mean),
    ("rosin_rammler_size", "m", "x' of 1 − Q = exp(−(x/x')^n)", lambda rows: rosin_rammler(rows)[0]),
    ("rosin_rammler_exponent", "1", "n of 1 − Q = exp(−(x/x')^n)", lambda rows: rosin_rammler(rows)[1]),
    ("sieving_loss", "1", "(m_total − Σ m)/m_total", loss),
)
"""Name, unit, formula and value of a sample."""


def _check(table: Table, sample: list[Reading]) -> None:
    """A stack has a pan, every sieve once, something on it, and one total."""
    first = sample[0]
    openings: dict[float, int] = {}
    for row in sample:
        opening = row.values["aperture"]
        if opening in openings:
            raise table.wrong(
                row, "aperture", f"is also in row {openings[opening]} of the replicate; allowed: each sieve once"
            )
        openings[opening] = row.line
    where = f"replicate {first.replicate} of {first.of[0]}"
    if 0.0 not in openings:
        raise table.wrong(
            first, "aperture", f"{where} has no pan; needed: a row with aperture 0, even if nothing fell into the pan"
        )
    if len(openings) < 3:
        raise table.wrong(first, "aperture", f"{where} has {len(openings) - 1} sieve; allowed: at least two, and a pan")
    if not any(row.values["mass_retained"] > 0.0 for row in sample):
        raise table.wrong(first, "mass_retained", f"{where} weighs nothing; allowed: a sample with a mass")
    totals = {row.values["mass_total"]: row for row in sample if "mass_total" in row.values}
    if len(totals) > 1:
        raise table.wrong(list(totals.values())[1], "mass_total", f"differs within {where}; allowed: one number")
