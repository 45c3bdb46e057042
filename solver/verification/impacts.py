"""Single impacts on a rigid plane or on a free sphere, many at once in one laboratory; and their elastic closed forms.

The tests ask an :class:`Engine` for them: ``OURS``, or another program, whose rows then stand beside ours.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import numpy.typing as npt

from solver.scenes.contact_model import ContactModel
from solver.scenes.material import Material, Pair, effective_youngs_modulus
from solver.single_body.free_world import FreeWorld, scene_of, sphere
from solver.verification.chung_ooi import RIGID

Array = npt.NDArray[np.float64]

DECLARED_BY_NOBODY = ContactModel()
"""Conventions of a scene that names none."""
STEPS_PER_CONTACT = 2000
"""Steps in the time of the elastic contact, about 0.002 of the Rayleigh time: no error of the step is left to see."""


@dataclass(frozen=True)
class Impact:
    """A sphere that meets the rigid plane; speeds [m/s], ``v_n`` towards the plane."""

    material: Material
    radius: float
    v_n: float
    v_t: float = 0.0
    surface_speed: float = 0.0
    """r ω before the impact; the contact point moves with v_t + r ω."""
    restitution: float = 1.0
    friction: float = 0.0
    gap: float = 0.0
    """Between sphere and plane at the start [m]; shifts the beginning of the contact between two steps."""

    @property
    def mass(self) -> float:
        """Of the solid sphere [kg]."""
        return 4.0 / 3.0 * math.pi * self.radius**3 * self.material.density


@dataclass(frozen=True)
class StruckSphere:
    """A free sphere at rest that is hit instead of the plane."""

    material: Material
    radius: float
    """[m]"""

    @property
    def mass(self) -> float:
        """Of the solid sphere [kg]."""
        return 4.0 / 3.0 * math.pi * self.radius**3 * self.material.density


@dataclass(frozen=True)
class Rebound:
    """After the impact; speeds [m/s], ``v_n`` away from the plane, signs of the others as before.

    After the impact on a target, ``v_n`` and ``v_t`` are relative to the point of it that was touched.
    """

    v_n: float
    v_t: float
    surface_speed: float
    """r ω."""

    @property
    def contact_speed(self) -> float:
        """Tangential speed of the contact point, v_t + r ω."""
        return self.v_t + self.surface_speed


def hertz_depth(mass: float, speed: float, e_star: float, radius: float) -> float:
    """Largest overlap [m] of an elastic impact, (15 m* v²/(16 E* √R*))^(2/5); reduced mass and radius."""
    return (15.0 * mass * speed**2 / (16.0 * e_star * math.sqrt(radius))) ** 0.4


def contact_time(impact: Impact) -> float:
    """Duration [s] of the impact if it were elastic, 2.943 δ/v (Hertz 1882)."""
    e_star = effective_youngs_modulus(impact.material, RIGID)
    return 2.943 * hertz_depth(impact.mass, impact.v_n, e_star, impact.radius) / impact.v_n


def rebounds(
    impacts: Sequence[Impact], dt: float | None = None, contact: ContactModel = DECLARED_BY_NOBODY
) -> list[Rebound]:
    """Run ``impacts`` side by side in one world; ``dt`` [s] is by default ``STEPS_PER_CONTACT`` in the shortest one."""
    kinds = list(dict.fromkeys((i.material, i.radius, i.restitution, i.friction) for i in impacts))
    bodies = [sphere(radius, material, name=f"ball {k}") for k, (material, radius, _, _) in enumerate(kinds)]
    walls = [Pair(f"ball {k}", RIGID.name, mu, e) for k, (_, _, e, mu) in enumerate(kinds)]
    materials = list(dict.fromkeys(i.material for i in impacts))
    # Balls do not meet, but a scene names every pair.
    balls = [Pair(a.name, b.name, 0.0, 1.0) for k, a in enumerate(materials) for b in materials[k:]]
    scene = replace(scene_of(bodies, (*materials, RIGID), (*walls, *balls)), contact=contact)
    times = [contact_time(i) for i in impacts]
    dt = dt or min(times) / STEPS_PER_CONTACT
    lab = FreeWorld(scene, [kinds.index((i.material, i.radius, i.restitution, i.friction)) for i in impacts], dt)
    spacing = 4.0 * max(i.radius for i in impacts)
    for b, one in enumerate(impacts):
        spin = (0.0, -one.surface_speed / one.radius, 0.0)
        lab.put(b, (0.0, b * spacing, one.radius + one.gap), velocity=(one.v_t, 0.0, -one.v_n), spin=spin)
    # A heavily damped ball leaves slowly: e = 0.05 needs 13 elastic contact times.
    lab.run_apart(steps=int(20 * max(times) / dt), chunk=max(1, int(0.25 * min(times) / dt)))
    return [
        Rebound(v_n=row[9], v_t=row[7], surface_speed=-row[11] * one.radius)
        for row, one in zip(lab.state(), impacts, strict=True)
    ]


def struck(
    impacts: Sequence[Impact], target: StruckSphere, contact: ContactModel = DECLARED_BY_NOBODY
) -> list[Rebound]:
    """Run ``impacts`` on a target each, side by side; they share material, radius, speed, restitution and friction."""
    one, n = impacts[0], len(impacts)
    ball, heavy = sphere(one.radius, one.material, name="ball"), sphere(target.radius, target.material, name="target")
    names = ("ball", "target", "wall")
    pairs = [Pair(a, b, one.friction, one.restitution) for k, a in enumerate(names) for b in names[k:]]
    scene = replace(scene_of((ball, heavy), (one.material, target.material, RIGID), pairs), contact=contact)
    dt = struck_time(one, target) / STEPS_PER_CONTACT
    lab = FreeWorld(scene, [0] * n + [1] * n, dt, plate=False)
    for k, impact in enumerate(impacts):
        y = 3.0 * k * target.radius
        place, spin = (0.0, y, impact.radius + target.radius), (0.0, -impact.surface_speed / impact.radius, 0.0)
        lab.put(k, place, velocity=(impact.v_t, 0.0, -impact.v_n), spin=spin)
        lab.put(n + k, (0.0, y, 0.0))
    lab.run_apart(8 * STEPS_PER_CONTACT, STEPS_PER_CONTACT // 4)
    rows = lab.state()
    touched = rows[n:, 7] + target.radius * rows[n:, 11]
    return [
        Rebound(v_n=row[9] - other[9], v_t=row[7] - speed, surface_speed=-row[11] * one.radius)
        for row, other, speed in zip(rows[:n], rows[n:], touched, strict=True)
    ]


def struck_time(impact: Impact, target: StruckSphere) -> float:
    """Duration [s] of the impact on ``target`` if it were elastic and the target far heavier."""
    e_star = effective_youngs_modulus(impact.material, target.material)
    radius = impact.radius * target.radius / (impact.radius + target.radius)
    return 2.943 * hertz_depth(impact.mass, impact.v_n, e_star, radius) / impact.v_n


@dataclass(frozen=True)
class Engine:
    """A program that runs impacts: the solver, the solver under another law, or a peer."""

    name: str
    rebounds: Callable[[Sequence[Impact]], list[Rebound]]
    """Impacts on the rigid plane, in any mixture."""
    struck: Callable[[Sequence[Impact], StruckSphere], list[Rebound]]
    """Impacts that differ in their spins only, each on a target of its own."""


OURS = Engine("ours", rebounds, struck)
DISPLACEMENT_LAW = ContactModel(tangential_law="mindlin", tangential_dashpot="uncapped")
OURS_BY_DISPLACEMENT = Engine(
    "ours, mindlin", partial(rebounds, contact=DISPLACEMENT_LAW), partial(struck, contact=DISPLACEMENT_LAW)
)
"""The solver with the tangential conventions of LIGGGHTS."""
