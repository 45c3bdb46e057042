"""T1 and T2: elastic normal impact of two equal spheres, and of a sphere on a rigid plane, against Hertz.

Closed forms with reduced mass, radius and modulus, approach speed v and k = 4/3 E* √R*:

    depth d = (15 m* v²/(16 E* √R*))^(2/5),  force k d^(3/2),  duration 4/5 B(2/5, 1/2) d/v = 2.943 d/v
    δ(t)/d = I⁻¹(2 t/duration; 2/5, 1/2)^(2/5) up to half of it, then mirrored      (I: incomplete beta function)
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.special import beta, betaincinv

from solver.scenes.material import Material, Pair, effective_youngs_modulus
from solver.single_body.free_world import FreeWorld, scene_of, sphere
from solver.verification.chung_ooi import ALUMINIUM_T2, GLASS, LIMESTONE, MAGNESIUM, RIGID
from solver.verification.impacts import hertz_depth
from solver.verification.row import Row, of_scale, of_value

Array = npt.NDArray[np.float64]

LIMIT = 0.5
STEPS = 1000
"""Per contact."""
SOURCE = "Hertz 1882, closed form"


@dataclass(frozen=True)
class Elastic:
    """One elastic impact; reduced mass [kg], radius [m] and modulus [Pa], approach speed [m/s]."""

    mass: float
    radius: float
    e_star: float
    speed: float

    @property
    def depth(self) -> float:
        """Largest overlap [m]."""
        return hertz_depth(self.mass, self.speed, self.e_star, self.radius)

    @property
    def duration(self) -> float:
        """Contact time [s]."""
        return 0.8 * float(beta(0.4, 0.5)) * self.depth / self.speed

    def force(self, overlap: Array | float) -> Array:
        """Hertz's force [N] at an overlap [m]."""
        return np.asarray(4.0 / 3.0 * self.e_star * math.sqrt(self.radius) * np.maximum(overlap, 0.0) ** 1.5)

    def overlap(self, time: Array) -> Array:
        """Overlap [m] a time [s] after the first touch, 0 once it is over."""
        half = 0.5 * self.duration
        phase = np.clip(1.0 - np.abs(1.0 - time / half), 0.0, 1.0)
        return self.depth * betaincinv(0.4, 0.5, phase) ** 0.4


@dataclass(frozen=True)
class ContactTrace:
    """Overlap [m] and force [N] at every time [s] of a contact."""

    time: Array
    overlap: Array
    force: Array

    @property
    def duration(self) -> float:
        """Time from the first touch until the overlap is zero again, between steps by a straight line [s]."""
        last = int(np.flatnonzero(self.overlap > 0.0)[-1])
        inside, outside = self.overlap[last], self.overlap[last + 1]
        return float(self.time[last] + (self.time[last + 1] - self.time[last]) * inside / (inside - outside))


def t1() -> Iterator[Row]:
    """Two equal spheres, r 10 mm, ±10 m/s."""
    for material in (GLASS, LIMESTONE):
        body = sphere(0.01, material)
        pairs = (Pair("grain", "grain", 0.35, 1.0), Pair("grain", "wall", 0.35, 1.0))
        e_star = effective_youngs_modulus(material, material)
        impact = Elastic(body.mass / 2.0, 0.005, e_star, 20.0)
        lab = FreeWorld(scene_of((body,), (material, RIGID), pairs), 2, impact.duration / STEPS, plate=False)
        lab.put(0, (0.0, 0.0, 0.01), velocity=(0.0, 0.0, -10.0))
        lab.put(1, (0.0, 0.0, -0.01), velocity=(0.0, 0.0, 10.0))
        yield from _rows("T1", material, impact, _trace(lab, impact, 0.02))


def t2() -> Iterator[Row]:
    """A sphere of r 0.1 m on the rigid plane, 0.2 m/s."""
    for material in (ALUMINIUM_T2, MAGNESIUM):
        body = sphere(0.1, material)
        pairs = (Pair("grain", "grain", 0.0, 1.0), Pair("grain", "wall", 0.0, 1.0))
        impact = Elastic(body.mass, 0.1, effective_youngs_modulus(material, RIGID), 0.2)
        lab = FreeWorld(scene_of((body,), (material, RIGID), pairs), 1, impact.duration / STEPS)
        lab.put(0, (0.0, 0.0, 0.1), velocity=(0.0, 0.0, -0.2))
        yield from _rows("T2", material, impact, _trace(lab, impact, 0.1))


def _trace(lab: FreeWorld, impact: Elastic, touch: float) -> ContactTrace:
    """Run step by step; bodies touch where they are ``touch`` [m] apart, or the only one is that high.

    The force is the reduced mass times the change of the relative velocity over the step that began at this overlap.
    """
    height, velocity = [touch], [-impact.speed]
    for _ in range(int(1.1 * STEPS)):
        lab.run(1)
        rows = lab.state()
        relative = rows[0] - rows[1] if lab.n == 2 else rows[0]
        height.append(relative[2])
        velocity.append(relative[9])
    overlap = np.asarray(touch - np.array(height), dtype=np.float64)
    time = np.arange(len(overlap) - 1, dtype=np.float64) * lab.dt
    return ContactTrace(time, overlap[:-1], np.asarray(impact.mass / lab.dt * np.diff(velocity), dtype=np.float64))


def _rows(test: str, material: Material, impact: Elastic, trace: ContactTrace) -> Iterator[Row]:
    name, most = material.name, float(impact.force(impact.depth))
    yield of_value(test, f"depth, {name} [m]", impact.depth, trace.overlap.max(), LIMIT, SOURCE)
    yield of_value(test, f"largest force, {name} [N]", most, trace.force.max(), LIMIT, SOURCE)
    yield of_value(test, f"duration, {name} [s]", impact.duration, trace.duration, LIMIT, SOURCE)
    yield _worst(test, f"force over overlap, {name} [N]", impact.force(trace.overlap), trace, most)
    yield _worst(test, f"force over time, {name} [N]", impact.force(impact.overlap(trace.time)), trace, most)


def _worst(test: str, quantity: str, expected: Array, trace: ContactTrace, most: float) -> Row:
    k = int(np.argmax(np.abs(trace.force - expected)))
    at = f"worst, t = {trace.time[k]:.3g} s"
    return of_scale(test, quantity, expected[k], trace.force[k], (most, "largest force"), LIMIT, SOURCE, at)
