"""T6: a spinning sphere falls on the rigid plane, v_n 0.2 m/s, r 0.1 m, e 0.5, μ 0.4.

x = 7/2 μ (1 + e) V_cn/V_st of the contact point, β = −V_st'/V_st; an impact that slides throughout has β = x − 1.
"""

from __future__ import annotations

from collections.abc import Iterator

from solver.scenes.material import Material
from solver.verification.chung_ooi import ALUMINIUM, DIGITISED, NYLON, T6_BETA, Curve, span
from solver.verification.impacts import OURS, Engine, Impact, Rebound, rebounds
from solver.verification.one_contact import integrated
from solver.verification.row import Row, of_scale

RADIUS, SPEED, FRICTION, RESTITUTION = 0.1, 0.2, 0.4, 0.5
LIMIT, LAW_LIMIT = 3.0, 0.5


def t6(engine: Engine = OURS) -> Iterator[Row]:
    """Both materials: the printed curves."""
    for material in (ALUMINIUM, NYLON):
        curve = T6_BETA[material.name]
        impacts = spinning(material, curve, RESTITUTION)
        for (x, value), before, after in zip(curve, impacts, engine.rebounds(impacts), strict=True):
            at, scale = f"x = {x:g}", (span(curve), "span")
            branch = "sliding" if x < 1.0 else "sticking"
            name = f"β, {material.name}, {branch}"
            yield of_scale("T6", name, value, beta(before, after), scale, LIMIT, DIGITISED, at)


def t6_law() -> Iterator[Row]:
    """Both materials: the same law integrated without the solver."""
    for material in (ALUMINIUM, NYLON):
        curve = T6_BETA[material.name]
        impacts = spinning(material, curve, RESTITUTION)
        for (x, _), before, after, alike in zip(curve, impacts, rebounds(impacts), integrated(impacts), strict=True):
            yield of_scale(
                "T6 law",
                f"β, {material.name}",
                beta(before, alike),
                beta(before, after),
                (span(curve), "span"),
                LAW_LIMIT,
                "the same law integrated without the solver",
                f"x = {x:g}",
            )


def t6_elastic() -> Iterator[Row]:
    """The sticking part with e = 1: how much of the curve is a matter of damping."""
    for material in (ALUMINIUM, NYLON):
        curve = T6_BETA[material.name]
        impacts = spinning(material, curve, 1.0)
        for (x, value), before, after in zip(curve, impacts, rebounds(impacts), strict=True):
            if x > 1.0:
                yield of_scale(
                    "T6 e = 1",
                    f"β, {material.name}, sticking",
                    value,
                    beta(before, after),
                    (span(curve), "span"),
                    None,
                    DIGITISED,
                    f"x = {x:g}",
                )


def spinning(material: Material, curve: Curve, restitution: float) -> list[Impact]:
    """Impacts at the abscissae of ``curve``."""
    slips = [3.5 * FRICTION * (1.0 + restitution) * SPEED / x for x, _ in curve]
    return [Impact(material, RADIUS, SPEED, 0.0, slip, restitution, FRICTION) for slip in slips]


def beta(before: Impact, after: Rebound) -> float:
    """−V_st'/V_st."""
    return -after.contact_speed / before.surface_speed
