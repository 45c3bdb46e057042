"""What the paper's formulas give where the answer is known: closed forms over the range of the parameters.

    drop          L/(2H) of a rigid sphere against its e, over friction (``contact.py``)
    rebound       √(h2/h1) of a body with drag in proportion to v² against its e (``contact.py``):
                  h2/Λ = ln(1 + e² (1 − exp(−h1/Λ))), Λ = v_t²/(2g)
    sieve         size_spread of log-normal sizes against what a stack of sieves reads (``sieve.py``)
    compression   Equation (1) on a sphere between rigid plates, A = π R δ the area of the contact, ΔL = 2 δ, T = 2 R:
                  E_app/E = 4/(3 π (1 − ν²) √(δ/R));  with the sphere's cross-section A = π R², δ/R times that
    shear         Equation (2) there, on the contact that is sheared with no slip, ΔL twice its slip:
                  G_app/G = 8/(π (2 − ν) √(δ/R))

δ/R, overlap over radius, is also the approach of the plates over the thickness, the strain of Equation (1).
Sources: Hertz 1882; Mindlin 1949; ``contact.py``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from scipy import stats

from doe.laboratory.contact import flight, tangential_share
from doe.laboratory.sieve import size_spread
from doe.laboratory.tables import LaboratoryError, Reading
from doe.record import Record

RESTITUTIONS = (0.2, 0.35, 0.5, 0.65, 0.8)
FRICTIONS = (0.0, 0.1, 0.3, 0.6)
SPACINGS = (2.0 ** (1 / 6), 2.0**0.25, 2.0**0.5, 2.0)
"""Of sieves: opening over that of the next finer one."""
SPREADS = (0.1, 0.2, 0.4)
FALLS = (0.01, 0.03, 0.1, 0.3)
"""h1/Λ."""
STRAINS = (0.001, 0.003, 0.01, 0.03)
POISSON_RATIOS = (0.2, 0.3, 0.4)
READ_OFF = "what is read off needs no model of bodies"
EXACT = {
    "inclined_plane": "tan σ gives back the friction",
    "rolling": "tan α and h/L of a sphere give back the rolling friction",
    "dimensions": "a caliper has no model",
    "drum": READ_OFF,
    "draw_down": READ_OFF,
}
"""Why a test has no bias; the others weigh."""
BIASED = ("drop", "rebound", "sieve", "compression", "shear")
"""Tests whose formula does not give back what was put in."""


@dataclass(frozen=True)
class BiasTable(Record):
    """One row per setting: what was put in, what the formula gives, and their ratio."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[float, ...], ...]
    statement: str


def bias_table(test: str) -> BiasTable:
    """The table of a test whose formula does not give back what was put in; LaboratoryError for another one."""
    tables = dict(zip(BIASED, (drop_bias, rebound_bias, sieve_bias, compression_bias, shear_bias), strict=True))
    if test not in tables:
        exact = EXACT.get(test, "a difference of masses has no model")
        raise LaboratoryError(f"--bias: {test}: {exact}; allowed: {', '.join(tables)}")
    return tables[test]()


def drop_bias() -> BiasTable:
    """L/(2H) over restitution and friction."""
    rows = []
    for friction in FRICTIONS:
        for e in RESTITUTIONS:
            shown = flight(e, tangential_share(e, friction))
            rows.append((friction, e, shown, shown / e))
    least = flight(0.0, tangential_share(0.0, 1.0))
    return BiasTable(
        title="a rigid sphere that falls on the plate at 45°: e = L/(2H) against the e of the contact",
        columns=("static_friction", "restitution", "L_over_2H", "ratio"),
        rows=tuple(rows),
        statement=f"exact only for a horizontal rebound; even e = 0 gives {least:.3f} where the sphere grips",
    )


def rebound_bias() -> BiasTable:
    """√(h2/h1) over h1/Λ and restitution."""
    rows = []
    for fall in FALLS:
        for e in RESTITUTIONS:
            shown = math.sqrt(math.log1p(e * e * -math.expm1(-fall)) / fall)
            rows.append((fall, e, shown, shown / e))
    return BiasTable(
        title="a sphere that falls and rises in air, drag as v²: e = √(h2/h1) against the e of the contact",
        columns=("h1_over_length", "restitution", "root_h2_over_h1", "ratio"),
        rows=tuple(rows),
        statement="Λ = v_t²/(2g) = 2 ρ d/(3 C_d ρ_air) of a sphere: 8.3 m for 3 mm of 2500 kg/m³ with C_d = 0.5 in air "
        "of 1.2 kg/m³, so that 200 mm are 0.024 of it; in vacuum, and on the solver, √(h2/h1) is e",
    )


def sieve_bias() -> BiasTable:
    """The spread of sizes that a stack of sieves reads, over how far its sieves stand apart."""
    rows = []
    for spacing in SPACINGS:
        for spread in SPREADS:
            shown = size_spread(log_normal_stack(spacing, spread))
            rows.append((spacing, spread, shown, shown / spread))
    return BiasTable(
        title="log-normal sizes, one sieve at the median by mass: spread by percentiles that are linear between sieves",
        columns=("spacing", "size_spread", "shown", "ratio"),
        rows=tuple(rows),
        statement="what lies between two sieves is taken as spread evenly over them: three sieves or more within d16 … "
        "d84 give the spread to some per cent",
    )


def log_normal_stack(spacing: float, spread: float) -> list[Reading]:
    """Fractions of a kilogram of log-normal sizes on sieves 1 m · ``spacing``^k, the median by mass 1 m."""
    sigma = math.sqrt(math.log1p(spread**2))
    reach = max(2, math.ceil(4.0 * sigma / math.log(spacing)))
    openings = [spacing**k for k in range(-reach, reach + 1)]
    finer = [0.0, *(float(stats.norm.cdf(math.log(x) / sigma)) for x in openings), 1.0]
    return [
        Reading(0, (), "", {"aperture": x, "mass_retained": above - below})
        for x, below, above in zip([0.0, *openings], finer, finer[1:], strict=False)
    ]


def compression_bias() -> BiasTable:
    """Equation (1) over strain and ν."""
    least, most = (strain * compression_ratio(strain, POISSON_RATIOS[1]) for strain in (STRAINS[0], STRAINS[-1]))
    return BiasTable(
        title="a sphere between rigid plates: E = (F/A)/(ΔL/T) against the E of its material, by Hertz",
        columns=("strain", "poisson_ratio", "ratio"),
        rows=tuple((strain, ratio, compression_ratio(strain, ratio)) for strain in STRAINS for ratio in POISSON_RATIOS),
        statement="no constant of the material: the ratio falls with the root of the strain. A is the area of one "
        "contact under load, π R δ; with the sphere's cross-section before the test, π R², the ratio is δ/R times that "
        f"and grows with the root: {least:.2g} at strain {STRAINS[0]:g}, {most:.2g} at {STRAINS[-1]:g} for ν = "
        f"{POISSON_RATIOS[1]:g}. A block with flat faces that the plates cover has ratio 1",
    )


def shear_bias() -> BiasTable:
    """Equation (2) over strain and ν."""
    return BiasTable(
        title="a sphere between rigid plates, sheared: G = (F/A)/(ΔL/T) against the G of its material, by Mindlin",
        columns=("strain", "poisson_ratio", "ratio"),
        rows=tuple((strain, ratio, shear_ratio(strain, ratio)) for strain in STRAINS for ratio in POISSON_RATIOS),
        statement="A is the area of one contact under load, π R δ, not the sphere's cross-section; strain is that of "
        "the squeezing before; the ratio falls with its root",
    )


def compression_ratio(strain: float, poisson_ratio: float) -> float:
    """E_app/E at strain δ/R."""
    return 4.0 / (3.0 * math.pi * (1.0 - poisson_ratio**2) * math.sqrt(strain))


def shear_ratio(strain: float, poisson_ratio: float) -> float:
    """G_app/G at strain δ/R of the preload."""
    return 8.0 / (math.pi * (2.0 - poisson_ratio) * math.sqrt(strain))
