"""What may not matter: the time step, and how many member spheres make up one sphere."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

from solver.single_body.free_world import GRAIN, RADIUS, FreeWorld, grain_on_plate, sphere
from solver.verification.impacts import STEPS_PER_CONTACT, Impact, contact_time, rebounds
from solver.verification.row import Row, of_value

LIMIT = 0.5
ROUNDING = 1e-9
"""Limit [%] where only rounding may differ."""
COPIES = 4
OBLIQUE = Impact(GRAIN, RADIUS, v_n=1.0, v_t=1.0, surface_speed=-0.3, restitution=0.5, friction=0.3)
QUANTITIES = (("v_n", "v_n"), ("v_t", "v_t"), ("r ω", "surface_speed"))


def halving() -> Iterator[Row]:
    """An oblique, damped, frictional impact with a step and with half of it, 500 and 1000 in a contact."""
    dt = contact_time(OBLIQUE) / 500
    whole, half = rebounds([OBLIQUE], dt)[0], rebounds([OBLIQUE], dt / 2.0)[0]
    for label, name in QUANTITIES:
        quantity = f"{label} after an oblique impact [m/s]"
        yield of_value("halving", quantity, getattr(half, name), getattr(whole, name), LIMIT, "half the step")


def coincident() -> Iterator[Row]:
    """Four spheres in one place, each a quarter as stiff, are one sphere: elastic, oblique impact with friction.

    e = 1, because n contacts damped at once are damped more than one (solver/README.md, restitution of a body).
    """
    outcomes = []
    for copies in (1, COPIES):
        soft = dataclasses.replace(GRAIN, shear_modulus=GRAIN.shear_modulus / copies)
        # The wall is as much softer, so that every contact is exactly a quarter.
        scene = grain_on_plate(sphere(copies=copies), 0.3, 1.0, grain=soft, wall=dataclasses.replace(soft, name="wall"))
        dt = contact_time(OBLIQUE) / STEPS_PER_CONTACT
        lab = FreeWorld(scene, 1, dt)
        lab.put(0, (0.0, 0.0, RADIUS), velocity=(1.0, 0.2, -1.0), spin=(40.0, 60.0, -20.0))
        lab.run_apart(8 * STEPS_PER_CONTACT, STEPS_PER_CONTACT // 4)
        outcomes.append(lab.state()[0])
    one, many = outcomes
    for label, k in (("v_x", 7), ("v_y", 8), ("v_z", 9)):
        quantity = f"{label} of {COPIES} coincident spheres [m/s]"
        yield of_value("coincident", quantity, one[k], many[k], ROUNDING, "one sphere")
    for label, k in (("spin x", 10), ("spin y", 11), ("spin z", 12)):
        quantity = f"{label} of {COPIES} coincident spheres [rad/s]"
        yield of_value("coincident", quantity, one[k], many[k], ROUNDING, "one sphere")
