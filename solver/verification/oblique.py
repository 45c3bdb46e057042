"""T4: oblique impact on the rigid plane at 3.9 m/s and angles of 5 … 85° from the normal, r 2.5 mm, e 0.98, μ 0.092.

While it slides throughout, tan θ > 7/2 μ (1 + e), impulses give a closed form:

    e_t = 1 − μ (1 + e)/tan θ,   ω' = −5/2 μ (1 + e) v_n/r,   rebound angle atan((e_t v_t + r ω')/(e v_n))

Below, the contact sticks for a while and the curve depends on the tangential law; there the tables are the reference.
Signs as in the paper: ω' < 0 turns the contact point against the motion of the centre.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from solver.scenes.material import Material
from solver.verification.chung_ooi import (
    ALUMINIUM,
    DIGITISED,
    OXIDE,
    T4_ANGLE,
    T4_EXPERIMENT,
    T4_RESTITUTION,
    T4_SPIN,
    Curve,
    span,
)
from solver.verification.impacts import OURS, Engine, Impact, Rebound
from solver.verification.one_contact import Convention, integrated
from solver.verification.row import Row, of_scale, of_value

SPEED, RADIUS, FRICTION, RESTITUTION = 3.9, 2.5e-3, 0.092, 0.98
Angles = tuple[float, ...]
ANGLES: Angles = tuple(theta for theta, _ in T4_RESTITUTION["Al oxide"])
SLIDING_LIMIT, TABLE_LIMIT, LAW_LIMIT = 2.0, 3.0, 0.5
DISPLACEMENT = Convention(scaled="always", damped=False)


@dataclass(frozen=True)
class ObliqueImpact:
    """The three quantities of the paper at one angle."""

    restitution: float
    spin: float
    """[rad/s]"""
    angle: float
    """[°]"""


QUANTITIES = (("e_t", "restitution"), ("spin [rad/s]", "spin"), ("rebound angle [°]", "angle"))


def t4(engine: Engine = OURS) -> Iterator[Row]:
    """Both materials, every angle: closed form while sliding, else the printed curves."""
    for material in (OXIDE, ALUMINIUM):
        found = _outcomes(material, RESTITUTION, ANGLES, engine)
        tables = (T4_RESTITUTION, T4_SPIN, T4_ANGLE)
        for (label, name), table in zip(QUANTITIES, tables, strict=True):
            if material.name in table:
                yield from _curve(f"{label}, {material.name}", table[material.name], name, found)


def t4_law() -> Iterator[Row]:
    """Both materials, every angle: the same law integrated without the solver."""
    for material in (OXIDE, ALUMINIUM):
        ours = _outcomes(material, RESTITUTION, ANGLES)
        expected = _read(ANGLES, integrated(_impacts(material, RESTITUTION, ANGLES)))
        for label, name in QUANTITIES:
            scale = (span(tuple((t, getattr(expected[t], name)) for t in ANGLES)), "span")
            for theta in ANGLES:
                yield of_scale(
                    "T4 law",
                    f"{label}, {material.name}",
                    getattr(expected[theta], name),
                    getattr(ours[theta], name),
                    scale,
                    LAW_LIMIT,
                    "the same law integrated without the solver",
                    f"θ = {theta:g}°",
                )


def t4_conventions() -> Iterator[Row]:
    """The sticking part of e_t again; nothing here is judged.

    With e = 1: what is left of the difference has nothing to do with damping. And another law, integrated without the
    solver: it keeps a displacement instead of a force and damps no tangential motion. The printed curve is near to it.
    """
    for material in (OXIDE, ALUMINIUM):
        sticking = tuple(theta for theta in ANGLES if not slides(theta, RESTITUTION))
        elastic = _outcomes(material, 1.0, sticking)
        other = _read(sticking, integrated(_impacts(material, RESTITUTION, sticking), DISPLACEMENT))
        curve, name = T4_RESTITUTION[material.name], f"e_t, {material.name}, sticking"
        for theta, value in curve:
            if theta in sticking:
                at, scale = f"θ = {theta:g}°", (span(curve), "span")
                yield of_scale("T4 e = 1", name, value, elastic[theta].restitution, scale, None, DIGITISED, at)
                law = f"{name}, displacement law"
                yield of_scale("T4 convention", law, value, other[theta].restitution, scale, None, DIGITISED, at)


def t4_experiment(engine: Engine = OURS) -> Iterator[Row]:
    """The measurement of Kharaz, Gorham & Salman (2001); not judged."""
    found = _outcomes(OXIDE, RESTITUTION, tuple(theta for theta, _ in T4_EXPERIMENT), engine)
    for theta, value in T4_EXPERIMENT:
        scale = (span(T4_EXPERIMENT), "span")
        at, here = f"θ = {theta:g}°", found[theta].restitution
        yield of_scale("T4 experiment", f"e_t, {OXIDE.name}", value, here, scale, None, "Kharaz et al. 2001", at)


def slides(theta: float, restitution: float) -> bool:
    """True if an impact at ``theta`` [°] slides throughout."""
    return math.tan(math.radians(theta)) > 3.5 * FRICTION * (1.0 + restitution)


def closed_form(theta: float, restitution: float) -> ObliqueImpact:
    """Outcome of an impact at ``theta`` [°] that slides throughout."""
    v_n, v_t = SPEED * math.cos(math.radians(theta)), SPEED * math.sin(math.radians(theta))
    slip = FRICTION * (1.0 + restitution) * v_n
    angle = math.degrees(math.atan((v_t - 3.5 * slip) / (restitution * v_n)))
    return ObliqueImpact(1.0 - slip / v_t, -2.5 * slip / RADIUS, angle)


def _curve(quantity: str, curve: Curve, name: str, found: dict[float, ObliqueImpact]) -> Iterator[Row]:
    scale = (span(curve), "span")
    for theta, value in curve:
        at, here = f"θ = {theta:g}°", getattr(found[theta], name)
        if slides(theta, RESTITUTION):
            exact = getattr(closed_form(theta, RESTITUTION), name)
            yield of_value("T4", f"{quantity}, sliding", exact, here, SLIDING_LIMIT, "impulses, closed form", at)
        else:
            yield of_scale("T4", f"{quantity}, sticking", value, here, scale, TABLE_LIMIT, DIGITISED, at)


def _impacts(material: Material, restitution: float, angles: Angles) -> list[Impact]:
    turned = [math.radians(theta) for theta in angles]
    return [
        Impact(material, RADIUS, SPEED * math.cos(a), SPEED * math.sin(a), 0.0, restitution, FRICTION) for a in turned
    ]


def _outcomes(
    material: Material, restitution: float, angles: Angles, engine: Engine = OURS
) -> dict[float, ObliqueImpact]:
    return _read(angles, engine.rebounds(_impacts(material, restitution, angles)))


def _read(angles: Angles, out: list[Rebound]) -> dict[float, ObliqueImpact]:
    return {
        theta: ObliqueImpact(
            one.v_t / (SPEED * math.sin(math.radians(theta))),
            one.surface_speed / RADIUS,
            math.degrees(math.atan(one.contact_speed / one.v_n)),
        )
        for theta, one in zip(angles, out, strict=True)
    }
