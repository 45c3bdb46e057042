"""Piles of the seed pour by our solver and by another engine, read with the same functions."""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from explorer.export import EXPORTS
from explorer.export.deck import deck_of
from explorer.export.frames import motion
from explorer.export.run import run_liggghts, run_yade
from explorer.scene.file import load_scene
from solver.observables import observe_pile
from solver.observables.surface import centre_of_mass
from solver.pours.record import Pile, Spheres

RUNNERS = {"liggghts": run_liggghts, "yade": run_yade}
TIME = 4.0
"""Simulated time of the other engine's pours [s]; the feed ends after 1.5 s."""
QUANTITIES = ("r50_m", "centre_height_m", "angle_deg")


@dataclass(frozen=True)
class Reading:
    """What is compared of one pour."""

    seed: int
    jammed: bool
    """More than one body stays in the funnel: no pile to compare."""
    values: tuple[float, ...]
    """In the order of ``QUANTITIES``."""


def of_ours(record):
    """Reading of a record."""
    bodies, spheres = record.bodies, record.spheres
    return _reading(record.scene, record.seed, bodies.position, bodies.velocity, spheres)


def of_theirs(record, engine, folder):
    """Reading of the same pour by ``engine``, run in ``folder``."""
    deck = deck_of(record, TIME)
    EXPORTS[engine].write_deck(folder, deck)
    frame = RUNNERS[engine](folder).final
    found = motion(deck, frame)
    owner = np.repeat(np.arange(deck.bodies, dtype=np.int32), [len(deck.members(b)) for b in range(deck.bodies)])
    assert len(owner) == len(frame.id), "the other engine lost bodies"
    spheres = Spheres(frame.position, frame.radius, owner)
    return _reading(record.scene, record.seed, found.position, found.velocity, spheres)


def seed_pour():
    """The scene."""
    return load_scene("seed_pour")


def _reading(scene, seed, position, velocity, spheres):
    """Bodies on the plate, inside the domain, and not rolling: the same rule for everyone.

    One that moves faster than ``numerics.rest_speed`` beyond the feed opening's radius is a stray: nothing brakes it.
    """
    rig = scene.rig
    away = np.hypot(*position[:, :2].T) > rig.inlet_diameter / 2.0
    rolling = away & (np.linalg.norm(velocity, axis=1) > scene.numerics.rest_speed)
    inside = np.abs(position[:, :2]).max(axis=1) < rig.domain_half_width
    low = position[:, 2] < rig.outlet_height
    chosen = np.flatnonzero(low & inside & ~rolling)
    number = np.full(len(position), -1, dtype=np.int32)
    number[chosen] = np.arange(len(chosen), dtype=np.int32)
    kept = number[spheres.body] >= 0
    pile = Pile(
        spheres=Spheres(spheres.centre[kept], spheres.radius[kept], number[spheres.body[kept]]),
        position=position[chosen],
        mass=np.full(len(chosen), scene.bodies[0].mass),
        component=np.zeros(len(chosen), dtype=np.int32),
        component_names=(scene.bodies[0].name,),
    )
    observed = observe_pile(pile)
    values = (
        observed["footprint_r50_m"].value,
        float(centre_of_mass(pile)[2]),
        observed["angle_of_repose_deg"].value,
    )
    return Reading(seed, bool((~low & ~away).sum() > 1), values)


@dataclass(frozen=True)
class Comparison:
    """Difference of two means (theirs − ours) with its 90 % interval, by Welch's t."""

    ours: tuple[float, float]
    """Mean and SD."""
    theirs: tuple[float, float]
    difference: float
    low: float
    high: float

    def within(self, margin):
        """Two one-sided tests at 5 %: the 90 % interval lies inside ± ``margin``."""
        return -margin < self.low and self.high < margin


def compared(ours, theirs):
    """Comparison of two samples of one quantity."""
    ours, theirs = np.asarray(ours), np.asarray(theirs)
    interval = stats.ttest_ind(theirs, ours, equal_var=False).confidence_interval(0.90)
    moments = [(float(x.mean()), float(x.std(ddof=1))) for x in (ours, theirs)]
    return Comparison(*moments, float(theirs.mean() - ours.mean()), float(interval.low), float(interval.high))
