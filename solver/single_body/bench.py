"""A bench with one body on it: the driver of the tests that measure a single body, and what such a test returns.

There is no pour, and nothing sleeps. A result holds quantities beside the values that were put in, and the curves that
they come from.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from solver.engine.tables import body_tables
from solver.engine.world import SUMMARY_COLUMNS, Batch, compiled_in
from solver.rigs.rig import Rig
from solver.scenes.body import Body, Members
from solver.scenes.scene import Scene
from solver.scenes.time_step import time_step
from solver.single_body.free_world import ROOM

Array = npt.NDArray[np.float64]

HELD = 1e12
"""Factor on the moments of inertia of a body that is held so that it cannot turn."""
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


@dataclass(frozen=True)
class Quantity:
    """One measured number. ``reference`` is what was put in, or None where there is nothing to compare with."""

    name: str
    unit: str
    value: float
    reference: float | None = None
    spread: float | None = None
    """Sample standard deviation over repeats, same unit."""

    @property
    def error(self) -> float | None:
        """value / reference − 1; None without a reference."""
        if self.reference is None or self.reference == 0.0 or not math.isfinite(self.value):
            return None
        return self.value / self.reference - 1.0


@dataclass(frozen=True)
class BenchResult:
    """Outcome of one bench test on one component against the wall. SI units unless a name says otherwise."""

    test: str
    body: str
    wall: str
    quantities: tuple[Quantity, ...]
    series: tuple[tuple[str, tuple[float, ...]], ...]
    """Curves (name with unit, values), all of one length."""
    table: tuple[tuple[str, tuple[float, ...]], ...] = ()
    """A study beside the test (name with unit, values), all of one length; empty where there is none."""
    note: str = ""

    def quantity(self, name: str) -> Quantity:
        """The quantity of that name."""
        return next(quantity for quantity in self.quantities if quantity.name == name)


class Bench:
    """One ``specimen`` of a scene's materials in ``rig``; making another bench invalidates this one."""

    def __init__(self, scene: Scene, rig: Rig, specimen: Body) -> None:
        numerics = dataclasses.replace(scene.numerics, sleep_speed=0.0)
        self.scene = dataclasses.replace(scene, rig=rig, bodies=(specimen,), numerics=numerics)
        self.dt = time_step(self.scene)
        self.batch = Batch(dataclasses.replace(ROOM, **compiled_in([self.scene])))
        order = np.zeros(1, dtype=np.int32)
        self.batch.load(0, self.scene, body_tables(self.scene, order), self.dt, (True,) * len(rig.surfaces()))
        # A bench is level, however the rig of the pile is tilted.
        self.batch.set_gravity(0, (0.0, 0.0, -math.hypot(*scene.gravity)))

    def put(self, position: Array, quaternion: Array = UPRIGHT) -> None:
        """Place the specimen at rest: centre of mass [m] and orientation wxyz."""
        self.batch.enter(0, 0, position, quaternion, np.zeros(3), np.zeros(3))

    def lay(self) -> None:
        """Place the specimen at rest on a plate at z = 0, as it is declared."""
        clump = next(iter(self.scene.bodies)).clump
        self.put(np.array([0.0, 0.0, float((clump.radii - clump.centres[:, 2]).max())]))

    def run(self, duration: float) -> dict[str, float]:
        """Advance by ``duration`` [s], at least one step; returns the summary, columns ``world.SUMMARY_COLUMNS``."""
        steps = max(1, round(duration / self.dt))
        row = self.batch.advance(np.array([steps], dtype=np.int32))[0]
        return dict(zip(SUMMARY_COLUMNS, row.tolist(), strict=True))

    def steps_of(self, duration: float) -> float:
        """The time [s] that :meth:`run` really takes for ``duration`` [s]."""
        return max(1, round(duration / self.dt)) * self.dt

    def state(self) -> Array:
        """Position 0:3, quaternion 3:7, velocity 7:10, spin 10:13 of the specimen."""
        return self.batch.bodies(0, 1)[0]


def onset_of(path: Sequence[tuple[float, float]], told: float) -> float:
    """x where √v = 0, on the line through two points (x, v) of ``path``: the first with v above a quarter of ``told``,
    and the last."""
    first, slow = next(one for one in path if one[1] > 0.25 * told)
    last, fast = path[-1]
    if last == first:
        return first
    return first - (last - first) * math.sqrt(slow) / (math.sqrt(fast) - math.sqrt(slow))


def ball(body: Body) -> Body:
    """A solid sphere of the volume, mass and material of ``body``."""
    radius = (3.0 * body.mass / (4.0 * math.pi * body.density)) ** (1.0 / 3.0)
    inertia = 0.4 * body.mass * radius**2
    members = Members(((0.0, 0.0, 0.0),), (radius,), body.mass, (inertia,) * 3)
    return dataclasses.replace(body, shape=members)


def held(body: Body) -> Body:
    """``body`` with moments of inertia so large that it does not turn."""
    clump = body.clump
    centres = tuple((float(x), float(y), float(z)) for x, y, z in clump.centres)
    x, y, z = (HELD * float(moment) for moment in clump.inertia)
    members = Members(centres, tuple(float(radius) for radius in clump.radii), clump.mass, (x, y, z))
    return dataclasses.replace(body, shape=members)
