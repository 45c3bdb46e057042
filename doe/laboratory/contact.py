"""What single bodies do on a plate: friction, rolling friction, and restitution by two ways of dropping.

    inclined plane   μ = tan σ, of every replicate
    drop             e = L/(2H), Equation (7) of Processes 2022, 10, 185; it holds for a horizontal rebound only
    tracked drop     e = (v_x + v_z)/√(2gH), where a camera gives the velocity after the impact, v_z upward: exact for a
                     central impact, whatever the friction
    rebound          e = √(h2/h1), fallen by h1 onto a level plate and risen by h2
    rolling          μ_r = tan α, the slope from which on a sphere rolls, or μ_r = h/L: released at rest on a ramp, it
                     comes to rest L away on the level, measured along it, and h below

For a sphere L/(2H) can be inverted (:func:`restitution_of_flight`); that value stands beside it, and is the better one
where bodies are round. Everything is a mean over replicates of what each gives, not what the mean reading gives.

A sphere that falls H onto a plate at 45° leaves, in units of the impact speed V = √(2gH), with e V/√2 along the normal
and k V/√2 along the plate:

    v_x = (e + k)/2 V,  v_z = (e − k)/2 V,  L/(2H) = x (z + √(z² + 1)),  x = v_x/V, z = v_z/V
    k = 1 − μ (1 + e)  while it slides, never less than 5/7, when it leaves without slip

(rigid sphere, Coulomb impulse; solid sphere: 2/5 m r²). Only e = k gives L/(2H) = e. The tangential springs of a
Hertz–Mindlin contact give back a little of the spin, so that simulated values differ by a few hundredths.

Rebound: h1 and h2 are those of the same point of the body, v = √(2gh) before and after. Air is not in it: with drag in
proportion to v² and the length Λ = v_t²/(2g) in which a body all but reaches its terminal speed v_t, v² = v_t² (1 −
exp(−h1/Λ)) is reached, and v² = v_t² (exp(h2/Λ) − 1) is needed, so that the true e is larger (``bias.py``).
For a sphere Λ = 2 ρ d/(3 C_d ρ_air).

Rolling: the torque μ_r R N (`solver.effects.rolling_resistance`, R* = R on a plane) holds a sphere up to tan α = μ_r.
Rolling down a ramp and out, it takes μ_r m g cos β off the energy per length of the way, which is μ_r m g per length of
its projection on the level, whatever the slope and the moment of inertia: m g h = μ_r m g L. What the kink between ramp
and level takes, and slip, is not in it.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from scipy.optimize import brentq

from doe.laboratory.result import Derived, derived, no_parameter, of_rows, per_row
from doe.laboratory.tables import LENGTH, NUMBER, PAIR, Column, Layout, Reading, Table, angle, positive

GRAVITY = 9.81
GRIPPING = 5.0 / 7.0
"""Share of the tangential velocity that a solid sphere keeps when it leaves without slip."""
PAPER = (
    "L/2H holds for a horizontal rebound only and gives back another number than the contact's restitution (--bias); "
    "restitution_gripping_sphere stands for round bodies, v_x and v_z of a camera settle it"
)
AIR = "air drag is not in √(h2/h1), which is below the e of the contact by it (--bias); e belongs to the impact speed"
ROLLING_FRICTION = "effect.rolling_resistance.rolling_friction"
SPHERES = "holds for spheres: another body is held by its shape, too, which a body of member spheres already has"
ONE_NUMBER = (
    "the solver has one rolling friction for all contacts, and here are several pairs: --out writes it as measured "
    "only, not as a parameter; choose one by hand"
)
REBOUND = Layout(
    PAIR,
    (
        positive("drop_height", LENGTH, "h1, fallen before the impact", "mm", "300", needed=False, blank=True),
        Column(
            "rebound_height",
            LENGTH,
            low=0.0,
            zero=True,
            needed=False,
            blank=True,
            says="h2, risen after it, of the same point of the body",
            unit="mm",
            example="192",
        ),
        Column(
            "restitution",
            NUMBER,
            low=0.0,
            high=1.0,
            zero=True,
            needed=False,
            blank=True,
            says="in place of both heights: e that a camera or an instrument gives, rebound speed over impact speed",
        ),
    ),
    gives="restitution of a pair, e = √(h2/h1), on a level plate",
    replicates="ten of every pair; drop it without spin; leave out what bounces to the side",
    standard="no standard for grains; ASTM F2117 measures balls on floors by the time between bounces",
)
ROLLING = Layout(
    PAIR,
    (
        angle("angle", "slope of the plane from which on the sphere rolls by itself", "1.2", needed=False, blank=True),
        positive(
            "release_height",
            LENGTH,
            "in place of the angle: h, release on a ramp above the level run-out, of the same point of the sphere",
            "mm",
            needed=False,
            blank=True,
        ),
        positive(
            "stopping_distance",
            LENGTH,
            "with it: L, horizontal distance from the release to where it stays at rest, the ramp included",
            "mm",
            needed=False,
            blank=True,
        ),
    ),
    gives="rolling friction of a sphere on a plane, μ_r = tan α, or h/L by the stopping distance",
    replicates="ten of every pair, turned each time; the plane levelled and tilted both ways",
    standard="no standard; closed forms in doe/laboratory/contact.py, Ai et al. 2011, Powder Technology 206:269",
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
            found.append(_each(table, "restitution", of, "(v_x + v_z)/√(2gH)", rows, tracked_rebound))
        if "distance" in rows[0].values:
            name = "restitution_paper_L_over_2H" if tracked else "restitution"
            found.append(_each(table, name, of, "L/(2H)", rows, paper_estimate, () if tracked else (PAPER,)))
            if all(math.isfinite(_gripping(row)) for row in rows):
                formula = "from L/(2H), sphere that grips"
                found.append(_each(table, "restitution_gripping_sphere", of, formula, rows, _gripping))
        heights = [row.values["drop_height"] for row in rows]
        found.append(derived(table, "drop_height", "m", of, "H", [row.replicate for row in rows], heights))
    notes = ("g = 9.81 m/s²",) if any(one.formula.startswith("(v_x") for one in found) else ()
    return tuple(found), notes


def rebound(table: Table) -> tuple[tuple[Derived, ...], tuple[str, ...]]:
    """Restitution of every pair, the height that it fell from, and notes."""
    found: list[Derived] = []
    for of, rows in table.groups().items():
        for row in rows:
            _check_one_way(table, row, "restitution", ("drop_height", "rebound_height"))
            if row.values.get("rebound_height", 0.0) > row.values.get("drop_height", math.inf):
                raise table.wrong(row, "rebound_height", "is above the drop_height; allowed: up to it")
        fallen = [row for row in rows if "drop_height" in row.values]
        formula = "√(h2/h1)" if fallen else "as read, rebound over impact speed"
        found.append(_each(table, "restitution", of, formula, rows, rebound_restitution))
        if fallen:
            found.append(of_rows(table, "drop_height", "m", of, "h1", fallen, lambda row: row.values["drop_height"]))
    return tuple(found), ((AIR,) if any(one.name == "drop_height" for one in found) else ())


def rolling(table: Table) -> tuple[tuple[Derived, ...], tuple[str, ...]]:
    """Rolling friction of every pair, a parameter where there is one pair only, and notes."""
    groups = table.groups()
    parameter = ROLLING_FRICTION if len(groups) == 1 else ""
    found = []
    for of, rows in groups.items():
        for row in rows:
            _check_one_way(table, row, "angle", ("release_height", "stopping_distance"))
        ways = {"angle": "tan α", "release_height": "h/L"}
        formula = " or ".join(text for column, text in ways.items() if any(column in row.values for row in rows))
        found.append(of_rows(table, "rolling_friction", "1", of, formula, rows, rolling_friction, parameter))
    return tuple(found), (SPHERES,) if parameter else (SPHERES, ONE_NUMBER)


def rebound_restitution(row: Reading) -> float:
    """√(h2/h1), or the restitution as it was read."""
    if "restitution" in row.values:
        return row.values["restitution"]
    ratio = row.values["rebound_height"] / row.values["drop_height"]
    return math.sqrt(ratio) if ratio >= 0.0 else math.nan


def rolling_friction(row: Reading) -> float:
    """tan α, or h/L."""
    if "angle" in row.values:
        return math.tan(row.values["angle"])
    return row.values["release_height"] / row.values["stopping_distance"]


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
    value: Callable[[Reading], float],
    notes: tuple[str, ...] = (),
) -> Derived:
    path = f"pair.{of[0]}.{of[1]}.restitution" if name == "restitution" else ""
    return of_rows(table, name, "1", of, formula, rows, value, path, notes)


def _gripping(row: Reading) -> float:
    return restitution_of_flight(paper_estimate(row), GRIPPING)


def _path(quantity: str) -> Callable[..., str]:
    return lambda a, b: f"pair.{a}.{b}.{quantity}"


def _check_one_way(table: Table, row: Reading, direct: str, both: tuple[str, str]) -> None:
    """A row has either ``direct`` or ``both``."""
    allowed = f"allowed: {direct}, or {both[0]} and {both[1]}"
    given = [name for name in both if name in row.values]
    if direct in row.values and given:
        raise table.wrong(row, direct, f"given together with {given[0]}; {allowed}")
    if direct not in row.values and len(given) < 2:
        missing = next(name for name in both if name not in given)
        raise table.wrong(row, missing, f"is empty; {allowed}")


def _check(table: Table, row: Reading) -> None:
    """One of the two measurements must be there, a rebound be slower than the fall, and e lie in 0 … 1."""
    speeds = [name for name in ("v_x", "v_z") if name in row.values]
    if len(speeds) == 1:
        raise table.wrong(row, speeds[0], "given alone; allowed: both v_x_m_s and v_z_m_s, or neither")
    if not speeds and "distance" not in row.values:
        raise table.wrong(row, "distance_mm", "is missing; allowed: distance_mm, or v_x_m_s and v_z_m_s, or all three")
    fall = math.sqrt(2.0 * GRAVITY * row.values["drop_height"])
    if speeds and math.hypot(row.values["v_x"], row.values["v_z"]) > fall:
        raise table.wrong(row, "v_x_m_s", f"the rebound is faster than the fall, {fall:.4g} m/s")
    if speeds and not 0.0 <= tracked_rebound(row) <= 1.0:
        raise table.wrong(row, "v_z_m_s", f"(v_x + v_z)/√(2gH) is {tracked_rebound(row):.4g}; allowed: 0 … 1")
    if "distance" in row.values and paper_estimate(row) > 1.0:
        raise table.wrong(row, "distance_mm", f"L/(2H) is {paper_estimate(row):.4g}; allowed: up to 1")
