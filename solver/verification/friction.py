"""Coulomb friction: sliding becomes rolling, a slider is slowed down, a body on a slope holds or slides."""

from __future__ import annotations

import math
from collections.abc import Iterator

from solver.scenes.body import Body, Members
from solver.scenes.material import effective_youngs_modulus
from solver.single_body.free_world import EARTH, GRAIN, RADIUS, WALL, FreeWorld, grain_on_plate
from solver.verification.row import Row, of_scale, of_value

GRAVITY = 9.81
LIMIT = 0.5
SLAB_SIDE, SLAB_MASS = 0.03, 5e-3


def rolling() -> Iterator[Row]:
    """A sphere that starts sliding at 0.5 m/s ends up rolling at 5/7 of it, whatever the friction."""
    lab = FreeWorld(grain_on_plate(friction=0.3, gravity=EARTH), 1)
    depth = resting_depth(lab.scene.bodies[0].mass, 1)
    lab.put(0, (0.0, 0.0, RADIUS - depth), velocity=(0.5, 0.0, 0.0))
    lab.run(int(0.15 / lab.dt))
    row = lab.state()[0]
    source = "angular momentum about the plate"
    yield of_value("rolling", "speed that is left [m/s]", 0.5 * 5.0 / 7.0, row[7], LIMIT, source)
    yield of_value("rolling", "slip: r ω over v", 1.0, row[11] * RADIUS / row[7], LIMIT, "rolling")


def slider() -> Iterator[Row]:
    """A slab on four spheres, which cannot roll, slides at 1 m/s and slows down by μ g."""
    friction, start = 0.3, 1.0
    lab = FreeWorld(grain_on_plate(slab(), friction=friction, gravity=EARTH), 1)
    lab.put(0, (0.0, 0.0, RADIUS - resting_depth(SLAB_MASS, 4)), velocity=(start, 0.0, 0.0))
    steps = int(0.2 / lab.dt)
    lab.run(steps)
    lost = start - lab.state()[0, 7]
    yield of_value("slider", "speed lost in 0.2 s [m/s]", friction * GRAVITY * steps * lab.dt, lost, LIMIT, "μ g t")


def slope() -> Iterator[Row]:
    """The slab on a plate tilted (by turning gravity) to 0.9 and 1.1 of atan μ."""
    friction = 0.5
    for fraction, holds in ((0.9, True), (1.1, False)):
        angle = fraction * math.atan(friction)
        along, across = GRAVITY * math.sin(angle), GRAVITY * math.cos(angle)
        lab = FreeWorld(grain_on_plate(slab(), friction=friction, restitution=0.3, gravity=(along, 0.0, -across)), 1)
        lab.put(0, (0.0, 0.0, RADIUS - resting_depth(SLAB_MASS, 4)))
        # Springs and the tilt of the slab settle first.
        lab.run(int(0.3 / lab.dt))
        before, steps = lab.state()[0], int(0.4 / lab.dt)
        lab.run(steps)
        after, time = lab.state()[0], steps * lab.dt
        at = f"{fraction:g} atan μ"
        if holds:
            free = 0.5 * along * time**2
            moved = float(after[0] - before[0])
            yield of_scale("slope", "creep in 0.4 s [m]", 0.0, moved, (free, "free slide"), 1e-4, "holds", at)
        else:
            expected = along - friction * across
            gained = float(after[7] - before[7]) / time
            yield of_value("slope", "acceleration [m/s²]", expected, gained, LIMIT, "g (sin − μ cos)", at)


def slab() -> Body:
    """Four spheres at the corners of a square, with the mass and inertia of a plate of that size."""
    half, inertia = SLAB_SIDE / 2.0, SLAB_MASS * SLAB_SIDE**2 / 12.0
    corners = tuple((x, y, 0.0) for x in (-half, half) for y in (-half, half))
    members = Members(corners, (RADIUS,) * 4, SLAB_MASS, (inertia, inertia, 2.0 * inertia))
    return Body("grain", "grain", 1.0, members, GRAIN.density)


def resting_depth(mass: float, contacts: int) -> float:
    """Overlap [m] at which ``contacts`` spheres of the grain carry ``mass`` on the plate."""
    e_star = effective_youngs_modulus(GRAIN, WALL)
    return float((3.0 * mass * GRAVITY / (4.0 * contacts * e_star * math.sqrt(RADIUS))) ** (2.0 / 3.0))
