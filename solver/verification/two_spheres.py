"""T7: two equal spheres that turn like gears. T8: the spinning sphere of T6 falls on a large, heavy sphere.

T7: r 0.1 m, ±0.2 m/s, opposite spins, e 0.5, μ 0.4. The contact points move alike, so that nothing tangential happens.
T8: target of r 0.5 m and 1000 times the density; case A with 1000 times the stiffness (the rigid plane of T6 again),
case B with the same stiffness. In the law of this solver both have the same dimensionless contact, so B is A.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from solver.scenes.material import Material, Pair, effective_youngs_modulus
from solver.single_body.free_world import FreeWorld, scene_of, sphere
from solver.verification.chung_ooi import (
    ALUMINIUM,
    COPPER,
    DIGITISED,
    RIGID,
    T6_BETA,
    T8_B_SPAN,
    T8_B_TAIL,
    Curve,
    span,
)
from solver.verification.impacts import OURS, STEPS_PER_CONTACT, Engine, StruckSphere, hertz_depth
from solver.verification.row import Row, of_scale, of_value
from solver.verification.spinning import FRICTION, RADIUS, RESTITUTION, SPEED, beta, spinning

TARGET_RADIUS, TARGET_FACTOR = 0.5, 1000.0
GEAR_ANGLES = range(5, 90, 5)
"""T7's spins are v tan(angle)/r, 0.175 … 22.86 rad/s."""
ROUNDING = 1e-9
"""Limit [%] where only rounding may differ; 1e-11 of the speed."""
LIMIT, RESTITUTION_LIMIT = 3.0, 0.5


def t7() -> Iterator[Row]:
    """Both materials, 17 spins each."""
    for material in (ALUMINIUM, COPPER):
        body = sphere(RADIUS, material)
        pairs = (Pair("grain", "grain", FRICTION, RESTITUTION), Pair("grain", "wall", FRICTION, RESTITUTION))
        spins = [SPEED * math.tan(math.radians(angle)) / RADIUS for angle in GEAR_ANGLES]
        e_star = effective_youngs_modulus(material, material)
        dt = _time_step(body.mass / 2.0, 2.0 * SPEED, e_star, RADIUS / 2.0)
        lab = FreeWorld(scene_of((body,), (material, RIGID), pairs), 2 * len(spins), dt, plate=False)
        for k, spin in enumerate(spins):
            y = 4.0 * k * RADIUS
            lab.put(2 * k, (0.0, y, RADIUS), velocity=(0.0, 0.0, -SPEED), spin=(0.0, -spin, 0.0))
            lab.put(2 * k + 1, (0.0, y, -RADIUS), velocity=(0.0, 0.0, SPEED), spin=(0.0, spin, 0.0))
        lab.run_apart(8 * STEPS_PER_CONTACT, STEPS_PER_CONTACT // 4)
        rows = lab.state()
        for k, spin in enumerate(spins):
            at, name, out = f"ω = {spin:.4g} rad/s", material.name, rows[2 * k]
            scale = (SPEED, "speed")
            yield of_scale("T7", f"tangential velocity, {name} [m/s]", 0.0, out[7], scale, ROUNDING, "symmetry", at)
            yield of_value("T7", f"spin, {name} [rad/s]", spin, -out[11], ROUNDING, "symmetry", at)
            put_in = "the restitution put in"
            yield of_value("T7", f"e out, {name}", RESTITUTION, out[9] / SPEED, RESTITUTION_LIMIT, put_in, at)


def t8(engine: Engine = OURS) -> Iterator[Row]:
    """Case A against T6 by the same engine, case B against the tail of the printed curve."""
    curve = T6_BETA[ALUMINIUM.name]
    planes = spinning(ALUMINIUM, curve, RESTITUTION)
    on_plane = [beta(before, after) for before, after in zip(planes, engine.rebounds(planes), strict=True)]
    for (x, _), value, value_a in zip(curve, on_plane, _on_target(engine, TARGET_FACTOR, curve), strict=True):
        yield of_scale("T8", "β, case A", value, value_a, (span(curve), "span"), LIMIT, "our T6", f"x = {x:g}")
    for (x, value), value_b in zip(T8_B_TAIL, _on_target(engine, 1.0, T8_B_TAIL), strict=True):
        yield of_scale("T8", "β, case B, tail", value, value_b, (T8_B_SPAN, "span"), LIMIT, DIGITISED, f"x = {x:g}")


def _on_target(engine: Engine, stiffness: float, curve: Curve) -> list[float]:
    """β at the abscissae of ``curve`` of spheres that fall on targets ``stiffness`` times as stiff."""
    heavy = Material(
        "target",
        ALUMINIUM.density * TARGET_FACTOR,
        ALUMINIUM.shear_modulus * stiffness,
        ALUMINIUM.poisson_ratio,
    )
    impacts = spinning(ALUMINIUM, curve, RESTITUTION)
    after = engine.struck(impacts, StruckSphere(heavy, TARGET_RADIUS))
    return [beta(before, one) for before, one in zip(impacts, after, strict=True)]


def _time_step(mass: float, speed: float, e_star: float, radius: float) -> float:
    """``STEPS_PER_CONTACT`` steps in the elastic contact; all reduced."""
    return 2.943 * hertz_depth(mass, speed, e_star, radius) / speed / STEPS_PER_CONTACT
