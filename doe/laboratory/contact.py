"""Friction from the inclined plane and restitution from the drop on a plate at 45°.

    inclined plane   μ = tan σ, of every replicate
    drop             e = L/(2H), Equation (7) of Processes 2022, 10, 185; it holds for a horizontal rebound only
    tracked drop     e = (v_x + v_z)/√(2gH), where a camera gives the velocity after the impact, v_z upward: exact for a
                     central impact, whatever the friction

For a sphere L/(2H) can be inverted (:func:`restitution_of_flight`); that value stands beside it, and is the better one
where bodies are round. Everything is a mean over replicates of what each gives, not what the mean reading gives.

A sphere that falls H onto a plate at 45° leaves, in units of the impact speed V = √(2gH), with e V/√2 along the normal
and k V/√2 along the plate:

    v_x = (e + k)/2 V,  v_z = (e − k)/2 V,  L/(2H) = x (z + √(z² + 1)),  x = v_x/V, z = v_z/V
    k = 1 − μ (1 + e)  while it slides, never less than 5/7, when it leaves without slip

(rigid sphere, Coulomb impulse; solid sphere: 2/5 m r²). Only e = k gives L/(2H) = e. The tangential springs of a
Hertz–Mindlin contact give back a little of the spin, so that simulated values differ by a few hundredths.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from scipy.optimize import brentq

from doe.laboratory.result import Derived, derived, no_parameter, per_row
from doe.laboratory.tables import Reading, Table

GRAVITY = 9.81
GRIPPING = 5.0 / 7.0
"""Share of the tangential velocity that a solid sphere keeps when it leaves without slip."""
PAPER = (
    "L/2H holds for a horizontal rebound only and gives back another number than the contact's restitution (--bias); "
    "restitution_gripping_sphere stands for round bodies, v_x and v_z of a camera settle it"
)


def friction(table: Table) -> tuple[Derived, ...]:
    """The angle σ at which sliding begins, and μ = tan σ, of every pair."""
    angles = per_row(table, "sliding_angle", "rad", "σ", lambda row: row.values["angle"], no_parameter)
    coefficients = per_row(
        table, "static_friction", "1", "μ = tan σ", lambda row: math.tan(row.values["angle"]), _path("static_friction")
    )
    return tuple(one for both in zip(coefficients, angles, strict=True) for one in both)


def restitution(table: Table) -> tuple[tuple[Derived, ...], tuple[str, ...]]:
    """Every restitution that the readings allow, of every pair, and notes."""
    found: list[Derived] = []
    for of, rows in table.groups().items():
        for row in rows:
            _check(table, row)
        tracked = all("v_x" in row.values for row in rows)
        if tracked:
            found.append(
                _each(table, "restitution", of, "(v_x + v_z)/√(2gH)", rows, [tracked_rebound(row) for row in rows])
            )
        if "distance" in rows[0].values:
            name = "restitution_paper_L_over_2H" if tracked else "restitution"
            flights = [paper_estimate(row) for row in rows]
            found.append(_each(table, name, of, "L/(2H)", rows, flights, () if tracked else (PAPER,)))
            round_ones = [restitution_of_flight(flight, GRIPPING) for flight in flights]
            if all(map(math.isfinite, round_ones)):
                found.append(
                    _each(table, "restitution_gripping_sphere", of, "from L/(2H), sphere that grips", rows, round_ones)
                )
        heights = [row.values["drop_height"] for row in rows]
        found.append(derived(table, "drop_height", "m", of, "H", [row.replicate for row in rows], heights))
    notes = ("g = 9.81 m/s²",) if any(one.formula.startswith("(v_x") for one in found) else ()
    return tuple(found), notes


def paper_estimate(row: Reading) -> float:
    """L/(2H)."""
    return row.values["distance"] / (2.0 * row.values["drop_height"])


def tracked_rebound(row: Reading) -> float:
    """(v_x + v_z)/√(2gH)."""
    return (row.values["v_x"] + row.values["v_z"]) / math.sqrt(2.0 * GRAVITY * row.values["drop_height"])


def flight(restitution: float, share: float) -> float:
    """L/(2H) of a sphere with restitution e and tangential share k."""
    x, z = 0.5 * (restitution + share), 0.5 * (restitution - share)
    return x * (z + math.sqrt(z * z + 1.0))


def restitution_of_flight(measured: float, share: float) -> float:
    """The e whose :func:`flight` is ``measured``; NaN if no e in 0 … 1 has it. ``flight`` grows with e."""
    if not flight(0.0, share) <= measured <= flight(1.0, share):
        return math.nan
    return float(brentq(lambda e: flight(e, share) - measured, 0.0, 1.0, xtol=1e-12))


def tangential_share(restitution: float, friction: float) -> float:
    """k: tangential velocity after the impact at 45° over that before it."""
    return max(GRIPPING, 1.0 - friction * (1.0 + restitution))


def _each(
    table: Table,
    name: str,
    of: tuple[str, ...],
    formula: str,
    rows: tuple[Reading, ...],
    values: list[float],
    notes: tuple[str, ...] = (),
) -> Derived:
    path = f"pair.{of[0]}.{of[1]}.restitution" if name == "restitution" else ""
    return derived(table, name, "1", of, formula, [row.replicate for row in rows], values, path, notes)


def _path(quantity: str) -> Callable[..., str]:
    return lambda a, b: f"pair.{a}.{b}.{quantity}"


def _check(table: Table, row: Reading) -> None:
    """One of the two measurements must be there, and a rebound must be slower than the fall."""
    speeds = [name for name in ("v_x", "v_z") if name in row.values]
    if len(speeds) == 1:
        raise table.wrong(row, speeds[0], "stands alone; allowed: both of v_x_m_s and v_z_m_s, or none")
    if not speeds and "distance" not in row.values:
        raise table.wrong(row, "distance_mm", "is missing; allowed: distance_mm, or v_x_m_s and v_z_m_s, or all three")
    fall = math.sqrt(2.0 * GRAVITY * row.values["drop_height"])
    if speeds and math.hypot(row.values["v_x"], row.values["v_z"]) > fall:
        raise table.wrong(row, "v_x_m_s", f"the rebound is faster than the fall, {fall:.4g} m/s")
