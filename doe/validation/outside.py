"""Effects that no library holds, so that a diagnosis has to say "unexplained".

    vibrating_plate    the plate goes up and down by a square wave of speed, 50 Hz
    plate_attraction   bodies near the plate are drawn to it, q m g exp(−z/λ)
    misread_scale      every length that is read off the pile is too large by one factor
    breaking_bodies    a share of the mass is single lobes instead of trefoils
    sticky_funnel      a share of the mass stays in the funnel for good, whatever the rest does
    turning_plate      the plate turns about the funnel's axis
    draught            air moves sideways above the plate and drags what falls through it
    short_charge       less was weighed in than was written down
    raised_funnel      the funnel stands higher than was written down
    stray_spheres      a share of the mass is spheres of the bodies' own mass and solid volume

The first five are for development; a test (``truth.py``) has all ten. Each pour is driven by hand in a process of
its own (``work_place``), and gives an ordinary record.
"""

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from solver import Batch, Members, Pour, Record, Scene, capacity_for, parameters, poured_mass, value, with_values

AMPLITUDE = {
    "vibrating_plate": 0.05,
    "plate_attraction": 4.0,
    "misread_scale": 0.10,
    "breaking_bodies": 0.18,
    "sticky_funnel": 0.07,
    "turning_plate": 2.5,
    "draught": 3.0,
    "short_charge": 0.2,
    "raised_funnel": 0.5,
    "stray_spheres": 0.3,
}
"""Speed [m/s], q, factor − 1, shares, rate [rad/s], acceleration [m/s²], share left out, factor − 1, share: chosen
once, before any diagnosis was asked, so that each moves the summaries by more than 10 standard errors."""
DEVELOPMENT = ("vibrating_plate", "plate_attraction", "misread_scale", "breaking_bodies", "sticky_funnel")
"""The kinds that a development campaign asks for."""
OUTSIDE = 1
"""Version of this file: raise it with every change to what one of its pours does."""
PLATE = 0
"""Index of the plate among the funnel rig's surfaces."""
HALF_PERIOD = 0.01
"""[s] of the vibration."""
REACH = 0.02
"""λ of the attraction [m]; it acts up to three times as high."""
KICK = 1e-3
"""Interval [s] at which the attraction acts."""

ON_BENCH = ("draught",)
"""Those that act the other way in the frame of a rig that is turned by 180° on its bench."""
POURED = ("sticky_funnel", "draught", "raised_funnel")
"""Those that need an outlet."""
CLUMPS = ("breaking_bodies", "stray_spheres")
"""Those that need bodies of member spheres."""


def possible(scene: Scene, kinds: Sequence[str]) -> tuple[str, ...]:
    """Those of ``kinds`` that there can be in ``scene``."""
    outlet, clump = "rig.outlet_height" in parameters(scene), isinstance(scene.bodies[0].shape, Members)
    return tuple(kind for kind in kinds if (outlet or kind not in POURED) and (clump or kind not in CLUMPS))


def outside_pour(name: str, scene: Scene, seed: int, amount: float) -> Record:
    """The record of one pour of ``scene`` in which the outside effect ``name`` acts by ``amount``."""
    if name == "misread_scale":
        # The pour is as declared; the scale is misread when its pile is read (`magnified`).
        return driven(scene, seed)
    if name == "breaking_bodies":
        return driven(broken(scene, amount), seed)
    if name == "sticky_funnel":
        stuck = amount * poured_mass(scene)
        return with_stuck(driven(with_values(scene, {"rig.mass": poured_mass(scene) - stuck}), seed), stuck)
    if name == "short_charge":
        return driven(with_values(scene, {"rig.mass": (1.0 - amount) * poured_mass(scene)}), seed)
    if name == "raised_funnel":
        height = float(value(scene, "rig.outlet_height"))
        return driven(with_values(scene, {"rig.outlet_height": (1.0 + amount) * height}), seed)
    if name == "stray_spheres":
        return driven(with_spheres(scene, amount), seed)
    act, every = {
        "vibrating_plate": (vibrate, HALF_PERIOD),
        "plate_attraction": (attract, KICK),
        "turning_plate": (turn, HALF_PERIOD),
        "draught": (blow, KICK),
    }[name]
    return driven(scene, seed, lambda batch, pour: act(batch, pour, amount), every)


def driven(scene: Scene, seed: int, act: Callable[[Batch, Pour], None] | None = None, every: float = np.inf) -> Record:
    """One pour, with ``act`` called every ``every`` seconds at least."""
    batch = Batch(capacity_for([scene], 1))
    pour = Pour(batch, 0, scene, seed)
    at_most = None if act is None else max(1, round(every / pour.dt))
    while due := pour.steps_due(at_most):
        pour.after(due, batch.advance(np.array([due], dtype=np.int32))[0])
        if act is not None:
            act(batch, pour)
    return pour.record()


def vibrate(batch: Batch, pour: Pour, speed: float) -> None:
    """Let the plate go the other way every ``HALF_PERIOD``."""
    sign = 1.0 if round(pour.time / HALF_PERIOD) % 2 == 0 else -1.0
    batch.set_motion(0, PLATE, (0.0, 0.0, sign * speed), (0.0, 0.0, 0.0))


def attract(batch: Batch, pour: Pour, strength: float) -> None:
    """The attraction's impulse over ``KICK`` on every body near the plate."""
    state = batch.bodies(0, pour.entered)
    for b in np.flatnonzero((state[:, 2] < 3.0 * REACH) & (state[:, 13] > 0.5)):
        velocity = state[b, 7:10].copy()
        velocity[2] -= strength * 9.81 * np.exp(-state[b, 2] / REACH) * KICK
        batch.enter(0, int(b), state[b, 0:3], state[b, 3:7], velocity, state[b, 10:13])


def turn(batch: Batch, pour: Pour, rate: float) -> None:
    """Let the plate turn about the vertical."""
    batch.set_motion(0, PLATE, (0.0, 0.0, 0.0), (0.0, 0.0, rate))


def blow(batch: Batch, pour: Pour, acceleration: float) -> None:
    """The draught's impulse over ``KICK`` on every body that is falling, above the pile and below the outlet."""
    state = batch.bodies(0, pour.entered)
    outlet = float(value(pour.scene, "rig.outlet_height"))
    for b in np.flatnonzero((state[:, 2] > REACH) & (state[:, 2] < outlet) & (state[:, 13] > 0.5)):
        velocity = state[b, 7:10].copy()
        velocity[0] += acceleration * KICK
        batch.enter(0, int(b), state[b, 0:3], state[b, 3:7], velocity, state[b, 10:13])


def with_spheres(scene: Scene, share: float) -> Scene:
    """``scene`` with ``share`` of its mass in spheres of the first body's mass, of the volume of its member spheres."""
    whole = scene.bodies[0]
    assert isinstance(whole.shape, Members)
    radii, mass = np.array(whole.shape.radii), whole.shape.mass
    # Of bodies whose members hardly overlap.
    radius = float((radii**3).sum() ** (1.0 / 3.0))
    sphere = Members(((0.0, 0.0, 0.0),), (radius,), mass, (0.4 * mass * radius**2,) * 3)
    bodies = (
        dataclasses.replace(whole, mass_fraction=1.0 - share),
        dataclasses.replace(whole, name="sphere", shape=sphere, mass_fraction=share),
    )
    return dataclasses.replace(scene, bodies=bodies)


def broken(scene: Scene, share: float) -> Scene:
    """``scene`` with ``share`` of its mass in single lobes of the first body, of the body's mass per lobe."""
    whole = scene.bodies[0]
    assert isinstance(whole.shape, Members)
    radius, mass = whole.shape.radii[0], whole.shape.mass / len(whole.shape.radii)
    lobe = Members(((0.0, 0.0, 0.0),), (radius,), mass, (0.4 * mass * radius**2,) * 3)
    bodies = (
        dataclasses.replace(whole, mass_fraction=1.0 - share),
        dataclasses.replace(whole, name="lobe", shape=lobe, mass_fraction=share),
    )
    return dataclasses.replace(scene, bodies=bodies)


def magnified(record: Record, factor: float) -> Record:
    """``record`` with every length of its pile ``factor`` times as large; the clock and the balance read right."""
    pile = record.pile
    spheres = dataclasses.replace(
        pile.spheres, centre=pile.spheres.centre * factor, radius=pile.spheres.radius * factor
    )
    return dataclasses.replace(record, pile=dataclasses.replace(pile, spheres=spheres, position=pile.position * factor))


def with_stuck(record: Record, stuck: float) -> Record:
    """``record`` with ``stuck`` [kg] that entered and never left, and counts as poured."""
    trace = dataclasses.replace(record.trace, entered_mass=record.trace.entered_mass + stuck)
    return dataclasses.replace(record, trace=trace, poured_mass=record.poured_mass + stuck)
