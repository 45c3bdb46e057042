"""Effects that are not in the library, so a diagnosis has to say "unexplained": ``OUTSIDE_EFFECTS``, one value each.

Some are for development; a test (``truth.py``) uses all. Each pour is stepped by this module, in a process of its own
(``work_place``), and gives an ordinary record.
"""

import dataclasses
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from solver import Batch, Members, Pour, Record, Scene, capacity_for, parameters, poured_mass, value, with_values

OUTSIDE = 2
"""Version of this file: increase it with every change to what any of its pours does."""
PLATE = 0
"""Index of the plate among the funnel rig's surfaces."""
HALF_PERIOD = 0.01
"""Half period of the vibration [s]."""
REACH = 0.02
"""Decay length λ of the attraction [m], which acts up to three times that height."""
KICK = 1e-3
"""Interval [s] at which the attraction acts."""


@dataclass(frozen=True, kw_only=True)
class OutsideEffect:
    """One effect that is not in the library.

    Attributes
    ----------
    name
        Its name in the files of a campaign.
    amount
        Its strength, in the unit that ``pour`` takes; chosen once, before any diagnosis was run, so that it moves the
        summaries by more than 10 standard errors.
    pour
        Scene, seed, amount → the record of a pour in which it acts.
    seen
        Record, amount → the record that the laboratory reads instead; None: the record itself.
    development
        Whether a development campaign asks for it.
    has_direction
        Whether it changes sign in the frame of a rig that is turned by 180° on its bench.
    needs_outlet, needs_clump
        Whether it needs a funnel, or bodies of member spheres.
    drawn
        Height of a body's centre [m], amount → force [weights] by which it draws a single body to a plate.
    """

    name: str
    amount: float
    pour: Callable[[Scene, int, float], Record]
    seen: Callable[[Record, float], Record] | None = None
    development: bool = False
    has_direction: bool = False
    needs_outlet: bool = False
    needs_clump: bool = False
    drawn: Callable[[float, float], float] = lambda height, amount: 0.0

    def possible(self, scene: Scene) -> bool:
        """Whether it can act in ``scene``."""
        outlet, clump = "rig.outlet_height" in parameters(scene), isinstance(scene.bodies[0].shape, Members)
        return (outlet or not self.needs_outlet) and (clump or not self.needs_clump)


def possible_outside(scenes: Sequence[Scene], development: bool = False) -> tuple[str, ...]:
    """Names of the outside effects that can act in all of ``scenes``; ``development``: only those for development."""
    return tuple(
        one.name
        for one in OUTSIDE_EFFECTS.values()
        if all(map(one.possible, scenes)) and (one.development or not development)
    )


def outside_pour(name: str, scene: Scene, seed: int, amount: float) -> Record:
    """The record of one pour of ``scene`` in which the outside effect ``name`` acts with strength ``amount``."""
    return OUTSIDE_EFFECTS[name].pour(scene, seed, amount)


Act = Callable[[Batch, Pour, float], None]
"""What is done to a pour, given the time [s] since it was last done."""


def driven(scene: Scene, seed: int, act: Act | None = None, every: float = np.inf) -> Record:
    """The record of one pour, with ``act`` called at least every ``every`` seconds.

    More often, too: a launch also ends where the pour has a sample to take or a body to drop.
    """
    batch = Batch(capacity_for([scene], 1))
    pour = Pour(batch, 0, scene, seed)
    at_most = None if act is None else max(1, round(every / pour.dt))
    while due := pour.steps_due(at_most):
        pour.after(due, batch.advance(np.array([due], dtype=np.int32))[0])
        if act is not None:
            act(batch, pour, due * pour.dt)
    return pour.record()


def vibrate(batch: Batch, pour: Pour, passed: float, speed: float) -> None:
    """Move the plate up and down at ``speed`` [m/s], in the opposite direction after every ``HALF_PERIOD``."""
    sign = 1.0 if round(pour.time / HALF_PERIOD) % 2 == 0 else -1.0
    batch.set_motion(0, PLATE, (0.0, 0.0, sign * speed), (0.0, 0.0, 0.0))


def attract(batch: Batch, pour: Pour, passed: float, strength: float) -> None:
    """Apply the attraction's impulse over ``passed`` seconds to every body near the plate."""
    state = batch.bodies(0, pour.entered)
    for b in np.flatnonzero((state[:, 2] < 3.0 * REACH) & (state[:, 13] > 0.5)):
        velocity = state[b, 7:10].copy()
        velocity[2] -= strength * 9.81 * np.exp(-state[b, 2] / REACH) * passed
        batch.enter(0, int(b), state[b, 0:3], state[b, 3:7], velocity, state[b, 10:13])


def turn(batch: Batch, pour: Pour, passed: float, rate: float) -> None:
    """Turn the plate about the vertical at ``rate`` [rad/s]."""
    batch.set_motion(0, PLATE, (0.0, 0.0, 0.0), (0.0, 0.0, rate))


def blow(batch: Batch, pour: Pour, passed: float, acceleration: float) -> None:
    """Apply the draught's impulse over ``passed`` seconds to every falling body between pile and outlet."""
    state = batch.bodies(0, pour.entered)
    outlet = float(value(pour.scene, "rig.outlet_height"))
    for b in np.flatnonzero((state[:, 2] > REACH) & (state[:, 2] < outlet) & (state[:, 13] > 0.5)):
        velocity = state[b, 7:10].copy()
        velocity[0] += acceleration * passed
        batch.enter(0, int(b), state[b, 0:3], state[b, 3:7], velocity, state[b, 10:13])


def with_spheres(scene: Scene, share: float) -> Scene:
    """``scene`` with ``share`` of its mass in spheres of the first body's mass and its member spheres' total volume."""
    whole = scene.bodies[0]
    assert isinstance(whole.shape, Members)
    radii, mass = np.array(whole.shape.radii), whole.shape.mass
    # Valid for bodies whose member spheres hardly overlap.
    radius = float((radii**3).sum() ** (1.0 / 3.0))
    sphere = Members(((0.0, 0.0, 0.0),), (radius,), mass, (0.4 * mass * radius**2,) * 3)
    bodies = (
        dataclasses.replace(whole, mass_fraction=1.0 - share),
        dataclasses.replace(whole, name="sphere", shape=sphere, mass_fraction=share),
    )
    return dataclasses.replace(scene, bodies=bodies)


def broken(scene: Scene, share: float) -> Scene:
    """``scene`` with ``share`` of its mass in single lobes of the first body, each with the body's mass per lobe."""
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
    """``record`` with every length of its pile multiplied by ``factor``; times and masses stay correct."""
    pile = record.pile
    spheres = dataclasses.replace(
        pile.spheres, centre=pile.spheres.centre * factor, radius=pile.spheres.radius * factor
    )
    return dataclasses.replace(record, pile=dataclasses.replace(pile, spheres=spheres, position=pile.position * factor))


def with_stuck(record: Record, stuck: float) -> Record:
    """``record`` with a mass ``stuck`` [kg] added that entered, never left, and counts as poured."""
    trace = dataclasses.replace(record.trace, entered_mass=record.trace.entered_mass + stuck)
    return dataclasses.replace(record, trace=trace, poured_mass=record.poured_mass + stuck)


def _acted_on(act: Callable[[Batch, Pour, float, float], None], every: float) -> Callable[[Scene, int, float], Record]:
    """A function that runs pours on which ``act`` acts every ``every`` seconds."""
    return lambda scene, seed, amount: driven(
        scene, seed, lambda batch, pour, passed: act(batch, pour, passed, amount), every
    )


def _without(scene: Scene, seed: int, share: float) -> Record:
    return driven(with_values(scene, {"rig.mass": (1.0 - share) * poured_mass(scene)}), seed)


def _sticking(scene: Scene, seed: int, share: float) -> Record:
    stuck = share * poured_mass(scene)
    return with_stuck(driven(with_values(scene, {"rig.mass": poured_mass(scene) - stuck}), seed), stuck)


def _raised(scene: Scene, seed: int, share: float) -> Record:
    height = float(value(scene, "rig.outlet_height"))
    return driven(with_values(scene, {"rig.outlet_height": (1.0 + share) * height}), seed)


OUTSIDE_EFFECTS = {
    one.name: one
    for one in (
        # The velocity of the plate is a vertical square wave [m/s], 50 Hz.
        OutsideEffect(name="vibrating_plate", amount=0.05, pour=_acted_on(vibrate, HALF_PERIOD), development=True),
        # Bodies near the plate are drawn to it with the force q m g exp(−z/λ).
        OutsideEffect(
            name="plate_attraction",
            amount=4.0,
            pour=_acted_on(attract, KICK),
            drawn=lambda height, strength: strength * math.exp(-height / REACH),
            development=True,
        ),
        # Every length read off the pile is too large by the same factor. The pour is as declared.
        OutsideEffect(
            name="misread_scale",
            amount=0.10,
            pour=lambda scene, seed, amount: driven(scene, seed),
            seen=lambda record, amount: magnified(record, 1.0 + amount),
            development=True,
        ),
        # A share of the mass consists of single lobes instead of trefoils.
        OutsideEffect(
            name="breaking_bodies",
            amount=0.18,
            pour=lambda scene, seed, share: driven(broken(scene, share), seed),
            development=True,
            needs_clump=True,
        ),
        # A share of the mass stays in the funnel for good, whatever the rest does.
        OutsideEffect(name="sticky_funnel", amount=0.07, pour=_sticking, development=True, needs_outlet=True),
        # The plate turns about the funnel's axis [rad/s].
        OutsideEffect(name="turning_plate", amount=2.5, pour=_acted_on(turn, HALF_PERIOD)),
        # Air moves sideways above the plate and drags what falls through it [m/s²].
        OutsideEffect(name="draught", amount=3.0, pour=_acted_on(blow, KICK), has_direction=True, needs_outlet=True),
        # Less mass was weighed in than was recorded, by a share of it.
        OutsideEffect(name="short_charge", amount=0.2, pour=_without),
        # The funnel stands higher than was recorded, by a share of its height.
        OutsideEffect(name="raised_funnel", amount=0.5, pour=_raised, needs_outlet=True),
        # A share of the mass consists of spheres with the bodies' own mass and solid volume.
        OutsideEffect(
            name="stray_spheres",
            amount=0.3,
            pour=lambda scene, seed, share: driven(with_spheres(scene, share), seed),
            needs_clump=True,
        ),
    )
}
"""Outside effects by name, in the order in which a campaign asks for them."""
