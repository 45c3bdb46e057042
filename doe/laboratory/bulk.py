"""What many bodies do in a vessel, a drum and a draw-down box: densities and angles of the bulk.

    bulk density   ρ_b = (m − m_vessel)/V, poured; after tapping m_tapped in the same V, or the same m in V_tapped
                   voidage ε = 1 − ρ_b/ρ_p of bodies of the density ρ_p, Hausner's ratio H = ρ_tapped/ρ_b,
                   Carr's index C = 1 − ρ_b/ρ_tapped = 1 − 1/H
    drum           mean of the upper and lower angle, their difference, and the Froude number Fr = ω²D/(2g)
    draw down      share that flows out, m_out/(m_out + m_left), and mean rate of the mass, m_out/t

None of them is a parameter of a model of single bodies: they are targets that such parameters are found by. A material
without them is poured, and what comes out is compared (``explorer calibrate``, ``explorer diagnose``).

The voidage near a wall is higher than inside, by an order that packs against it, so that a narrow vessel reads a bulk
density that is too low. Correlations over the vessel's diameter do not agree with one another (Guo et al. 2019, Powder
Technology 354:842), so that nothing is corrected. Sources: ASTM D6393 (loose and packed bulk density, compressibility);
ISO 60 (100 ml cylinder below a funnel); USP <616> (tapped volume in a graduated cylinder). Froude number and rolling
state 1e-4 < Fr < 1e-2: Oba & Otsuki, arXiv 2407.19466, after Mellmann. Draw-down test:
Roessler et al. 2019, Powder Technology 343:803.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

from doe.laboratory.contact import GRAVITY
from doe.laboratory.result import Derived, of_rows
from doe.laboratory.tables import (
    COMPONENT,
    DENSITY,
    LENGTH,
    MASS,
    TIME,
    TURNING,
    VOLUME,
    Column,
    Layout,
    Reading,
    Table,
    angle,
    positive,
)

ROLLING_STATE = (1e-4, 1e-2)
"""Froude numbers between which a bed rolls steadily, with a surface that is nearly plane."""
VESSEL = (
    "a target, no parameter of the material: bulk_density_kg_m3 and solid_fraction = 1 − voidage are those of the "
    "inside of a pile on the solver, without a wall"
)
WALL = "the voidage is higher at the wall and nothing is corrected: the vessel should be many bodies wide"
DRUM_TARGET = "a target, no parameter of the material: dynamic_angle_deg of the rig rotating_drum at the same speed"
BOX_TARGET = (
    "a target, no parameter of the material: draw_down_angle_deg (above), angle_of_repose_deg@0 (below) and the "
    "discharge of the rig draw_down_box with the same dimensions"
)
NOT_ROLLING = (
    "a Froude number outside 1e-4 … 1e-2, where the bed rolls: below it moves in avalanches (upper: before one, lower: "
    "after it), above its surface bends"
)
BULK_DENSITY = Layout(
    COMPONENT,
    (
        positive("mass", MASS, "the vessel filled loosely and struck off", "g", "412.6"),
        positive(
            "mass_vessel", MASS, "the empty vessel; empty column: the balance was set to zero", "g", "250.0", False
        ),
        positive("volume", VOLUME, "volume of the vessel, or of the bulk in a graduated cylinder", "ml", "100"),
        positive("mass_tapped", MASS, "the vessel filled and struck off after tapping", "g", "", False, blank=True),
        positive(
            "volume_tapped", VOLUME, "or: volume of the same sample after tapping", "ml", "92", needed=False, blank=True
        ),
        positive("particle_density", DENSITY, "density of the bodies, for the voidage", "kg_m3", "2500", False, True),
    ),
    gives="bulk density (m − m_vessel)/V, voidage 1 − ρ_b/ρ_p, Hausner ratio and Carr index where tapped",
    replicates="three to five fillings, each poured anew; the vessel many bodies wide",
    standard="ASTM D6393 (powders up to 2 mm), ISO 60 (plastics), USP <616> (tapped volume)",
)
DRUM = Layout(
    COMPONENT,
    (
        angle("upper_angle", "slope of the bed at its steepest: before an avalanche, or of the upper half", "38.2"),
        angle("lower_angle", "after the avalanche, or of the lower half", "33.5", needed=False, blank=True),
        positive("speed", TURNING, "speed of rotation", "rpm", "5", needed=False, blank=True),
        positive("diameter", LENGTH, "inner diameter of the drum", "mm", "84", needed=False, blank=True),
    ),
    gives="dynamic angle of repose in a rotating drum, upper and lower; Froude number ω²D/(2g)",
    replicates="ten avalanches, or ten pictures of a steady flow, at one speed; another speed is another component",
    standard="no standard; Lumay et al. 2012, Powder Technology 224:19",
)
DRAW_DOWN = Layout(
    COMPONENT,
    (
        angle("shear_angle", "slope of what stays in the upper box, mean of both sides", "36.5", False, blank=True),
        angle("repose_angle", "slope of the pile below, mean of both sides", "31.0", needed=False, blank=True),
        Column(
            "mass_left",
            MASS,
            low=0.0,
            zero=True,
            needed=False,
            blank=True,
            says="mass that stays in the upper box",
            unit="g",
            example="118",
        ),
        positive("mass_discharged", MASS, "mass that flowed out of it", "g", "182", needed=False, blank=True),
        positive("flow_time", TIME, "from opening the slot to the end of the flow", "s", "1.4", False, blank=True),
    ),
    gives="draw-down box: shear angle above, angle of repose below, share and mean rate of the mass that flows out",
    replicates="five fillings",
    standard="no standard; Roessler et al. 2019, Powder Technology 343:803",
)


def bulk_density(table: Table) -> tuple[tuple[Derived, ...], tuple[str, ...]]:
    """Bulk densities [kg/m³], voidages, Hausner's ratio and Carr's index of every component, and notes."""
    found: list[Derived] = []
    for of, rows in table.groups().items():
        for row in rows:
            _check_vessel(table, row)
        tapped = [row for row in rows if not math.isnan(tapped_density(row))]
        solid = _with(rows, "particle_density")
        both = [row for row in tapped if row in solid]
        found += _each(
            table,
            of,
            ("bulk_density_loose", "kg/m3", "(m − m_vessel)/V", rows, loose_density),
            ("voidage_loose", "1", "1 − ρ_b/ρ_p", solid, lambda row: _voidage(row, loose_density)),
            ("bulk_density_tapped", "kg/m3", "ρ after tapping", tapped, tapped_density),
            ("voidage_tapped", "1", "1 − ρ_tapped/ρ_p", both, lambda row: _voidage(row, tapped_density)),
            ("hausner_ratio", "1", "ρ_tapped/ρ_b", tapped, lambda row: tapped_density(row) / loose_density(row)),
            ("carr_index", "1", "1 − ρ_b/ρ_tapped", tapped, lambda row: 1.0 - loose_density(row) / tapped_density(row)),
        )
    return tuple(found), (VESSEL, WALL)


def drum(table: Table) -> tuple[tuple[Derived, ...], tuple[str, ...]]:
    """Angles [rad] and Froude number of every component, and notes."""
    found: list[Derived] = []
    for of, rows in table.groups().items():
        for row in rows:
            _check_drum(table, row)
        both, turned = _with(rows, "lower_angle"), _with(rows, "speed")
        found += _each(
            table,
            of,
            ("dynamic_angle_upper", "rad", "θ_u", rows, _reading("upper_angle")),
            ("dynamic_angle_lower", "rad", "θ_l", both, _reading("lower_angle")),
            ("dynamic_angle", "rad", "(θ_u + θ_l)/2", both, lambda row: 0.5 * (_upper(row) + _lower(row))),
            ("avalanche_amplitude", "rad", "θ_u − θ_l", both, lambda row: _upper(row) - _lower(row)),
            ("froude_number", "1", "ω²D/(2g)", turned, froude_number),
        )
    numbers = [value for one in found if one.name == "froude_number" for value in one.values]
    steady = all(ROLLING_STATE[0] < value < ROLLING_STATE[1] for value in numbers)
    return tuple(found), (DRUM_TARGET,) if steady else (DRUM_TARGET, NOT_ROLLING)


def draw_down(table: Table) -> tuple[tuple[Derived, ...], tuple[str, ...]]:
    """Angles [rad], share that flows out and its mean rate [kg/s] of every component, and notes."""
    found: list[Derived] = []
    for of, rows in table.groups().items():
        for row in rows:
            _check_box(table, row)
        weighed, timed = _with(rows, "mass_left"), _with(rows, "flow_time")
        found += _each(
            table,
            of,
            ("shear_angle", "rad", "φ above", _with(rows, "shear_angle"), _reading("shear_angle")),
            ("angle_of_repose", "rad", "θ below", _with(rows, "repose_angle"), _reading("repose_angle")),
            ("discharged_share", "1", "m_out/(m_out + m_left)", weighed, discharged_share),
            (
                "mass_flow",
                "kg/s",
                "m_out/t",
                timed,
                lambda row: row.values["mass_discharged"] / row.values["flow_time"],
            ),
        )
    return tuple(found), (BOX_TARGET,)


def loose_density(row: Reading) -> float:
    """(m − m_vessel)/V [kg/m³]."""
    return (row.values["mass"] - row.values.get("mass_vessel", 0.0)) / row.values["volume"]


def tapped_density(row: Reading) -> float:
    """Bulk density after tapping [kg/m³], NaN for a row without."""
    vessel = row.values.get("mass_vessel", 0.0)
    if "mass_tapped" in row.values:
        return (row.values["mass_tapped"] - vessel) / row.values["volume"]
    return (row.values["mass"] - vessel) / row.values.get("volume_tapped", math.nan)


def froude_number(row: Reading) -> float:
    """ω²D/(2g)."""
    return row.values["speed"] ** 2 * row.values["diameter"] / (2.0 * GRAVITY)


def discharged_share(row: Reading) -> float:
    """m_out/(m_out + m_left)."""
    return row.values["mass_discharged"] / (row.values["mass_discharged"] + row.values["mass_left"])


Quantity = tuple[str, str, str, Sequence[Reading], Callable[[Reading], float]]
"""Name, unit, formula, the rows that have what it needs, and its value."""


def _each(table: Table, of: tuple[str, ...], *quantities: Quantity) -> Iterator[Derived]:
    """Every quantity that some row has what it needs for."""
    for name, unit, formula, rows, value in quantities:
        if rows:
            yield of_rows(table, name, unit, of, formula, rows, value)


def _with(rows: Sequence[Reading], column: str) -> list[Reading]:
    return [row for row in rows if column in row.values]


def _reading(column: str) -> Callable[[Reading], float]:
    return lambda row: row.values[column]


_upper, _lower = _reading("upper_angle"), _reading("lower_angle")


def _voidage(row: Reading, density: Callable[[Reading], float]) -> float:
    return 1.0 - density(row) / row.values["particle_density"]


def _check_vessel(table: Table, row: Reading) -> None:
    """There is something in the vessel, tapping packs it, and bodies are denser than the bulk."""
    if loose_density(row) <= 0.0:
        raise table.wrong(row, "mass_vessel", "leaves no sample; allowed: below mass")
    if "mass_tapped" in row.values and "volume_tapped" in row.values:
        raise table.wrong(row, "mass_tapped", "given together with volume_tapped; allowed: one of them")
    tapped = tapped_density(row)
    if tapped < loose_density(row):
        column = "mass_tapped" if "mass_tapped" in row.values else "volume_tapped"
        raise table.wrong(
            row, column, "gives a lower density than before tapping; allowed: the same or a higher density"
        )
    packed = max(loose_density(row), 0.0 if math.isnan(tapped) else tapped)
    if row.values.get("particle_density", math.inf) <= packed:
        raise table.wrong(
            row, "particle_density", f"leaves no voids; allowed: above {packed:.4g} kg/m3, the bulk density"
        )


def _check_drum(table: Table, row: Reading) -> None:
    """The upper angle is the larger one, and a speed comes with a diameter."""
    if row.values.get("lower_angle", 0.0) > row.values["upper_angle"]:
        raise table.wrong(row, "lower_angle", "is above the upper_angle; allowed: up to it")
    if ("speed" in row.values) != ("diameter" in row.values):
        missing = "diameter" if "speed" in row.values else "speed"
        raise table.wrong(row, missing, "is empty; allowed: both speed and diameter, or neither")


def _check_box(table: Table, row: Reading) -> None:
    """Something was read, and a mass that stays or a time comes with the mass that flowed out."""
    if not row.values:
        raise table.wrong(row, "shear_angle", "is empty, like the whole row; allowed: at least one reading in a row")
    for column in ("mass_left", "flow_time"):
        if column in row.values and "mass_discharged" not in row.values:
            raise table.wrong(row, "mass_discharged", f"is empty; needed with {column}: the mass that flowed out")
