"""Effects that no library holds, so that a diagnosis has to say "unexplained".

vibrating_plate    the plate goes up and down by a square wave, 50 Hz
plate_attraction   bodies near the plate are drawn to it, q g exp(−z/λ)
misread_scale      every length that is read off the pile is too large by one factor
breaking_bodies    a share of the mass is single lobes instead of trefoils
sticky_funnel      a share of the mass stays in the funnel for good, whatever the rest does
"""

import dataclasses

import numpy as np

from doe.measurement.measurement import Condition
from doe.measurement.summaries import summaries_of_record
from solver.body import Members
from solver.crew import Crew  # noqa: F401  (pours of these laboratories are driven by hand, not by a crew)
from solver.pour import Pour
from solver.run import capacity_for
from solver.scene import poured_mass, with_values
from solver.world import Batch

PLATE = 0
"""Index of the plate among the funnel rig's surfaces."""
HALF_PERIOD = 0.01
AMPLITUDE = {
    "vibrating_plate": 0.02,
    "plate_attraction": 0.6,
    "misread_scale": 0.08,
    "breaking_bodies": 0.25,
    "sticky_funnel": 0.10,
}
"""Speed [m/s], q, factor − 1, shares: chosen once so that each moves the summaries by more than 10 standard errors."""
RANGE = 0.02
"""λ of the attraction [m]."""
KICK = 1e-3
"""Interval [s] at which the attraction acts."""


def outside_pour(name: str, condition: Condition, scene, seed: int):
    """Summaries of one pour of ``condition`` in which the outside effect ``name`` acts; ``scene`` has the truth's θ."""
    amount = AMPLITUDE[name]
    if name == "misread_scale":
        record = driven(scene, seed)
        pile = record.pile
        spheres = dataclasses.replace(
            pile.spheres, centre=pile.spheres.centre * (1 + amount), radius=pile.spheres.radius * (1 + amount)
        )
        misread = dataclasses.replace(pile, spheres=spheres, position=pile.position * (1 + amount))
        return summaries_of_record(condition, dataclasses.replace(record, pile=misread))
    if name == "breaking_bodies":
        return summaries_of_record(condition, driven(broken(scene, amount), seed))
    if name == "sticky_funnel":
        stuck = amount * poured_mass(scene)
        found = summaries_of_record(
            condition, driven(with_values(scene, {"rig.mass": poured_mass(scene) - stuck}), seed)
        )
        return found, stuck
    if name == "vibrating_plate":
        return summaries_of_record(condition, driven(scene, seed, vibrate))
    return summaries_of_record(condition, driven(scene, seed, attract))


def broken(scene, share):
    """``scene`` with ``share`` of its mass in single lobes of the first body."""
    whole = scene.bodies[0]
    radius, mass = whole.shape.radii[0], whole.shape.mass / len(whole.shape.radii)
    inertia = 0.4 * mass * radius**2
    lobe = Members(((0.0, 0.0, 0.0),), (radius,), mass, (inertia,) * 3)
    bodies = (
        dataclasses.replace(whole, mass_fraction=1.0 - share),
        dataclasses.replace(whole, name="lobe", shape=lobe, mass_fraction=share),
    )
    return dataclasses.replace(scene, bodies=bodies)


def driven(scene, seed, act=None):
    """One pour, with ``act(batch, pour, time)`` between short launches."""
    batch = Batch(capacity_for([scene], 1))
    pour = Pour(batch, 0, scene, seed)
    every = KICK if act is attract else HALF_PERIOD
    while due := pour.steps_due(None if act is None else max(1, round(every / pour.dt))):
        pour.after(due, batch.advance(np.array([due], dtype=np.int32))[0])
        if act is not None:
            act(batch, pour)
    return pour.record()


def vibrate(batch, pour):
    """Let the plate go the other way every ``HALF_PERIOD``."""
    sign = 1.0 if int(pour.time / HALF_PERIOD) % 2 == 0 else -1.0
    batch.set_motion(0, PLATE, (0.0, 0.0, sign * AMPLITUDE["vibrating_plate"]), (0.0, 0.0, 0.0))


def attract(batch, pour):
    """The attraction's impulse over ``KICK`` on every body near the plate."""
    state = batch.bodies(0, pour.entered)
    for b in np.flatnonzero((state[:, 2] < 3.0 * RANGE) & (state[:, 13] > 0.5)):
        velocity = state[b, 7:10].copy()
        velocity[2] -= AMPLITUDE["plate_attraction"] * 9.81 * np.exp(-state[b, 2] / RANGE) * KICK
        batch.enter(0, int(b), state[b, 0:3], state[b, 3:7], velocity, state[b, 10:13])
