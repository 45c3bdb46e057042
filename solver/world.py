"""A batch of worlds: the only owner of mutable state. NumPy in, NumPy out; no formula of physics stands here."""

import numpy as np
import numpy.typing as npt

from solver.body import Body
from solver.kernels import exchange
from solver.kernels.batch import advance, measure, take_out
from solver.laws.hertz_mindlin import constants
from solver.layout import Layout
from solver.rigs import Plane, Surface
from solver.rigs.rig import Container
from solver.scene import Scene
from solver.state import Capacity, arrays

Array = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int32]

SUMMARY_COLUMNS = (
    "kinetic",
    "elastic",
    "potential",
    "speed",
    "funnel_speed",
    "discharged",
    "in_funnel",
    "hanging",
    "touching",
    "finite",
    "overflow",
    "overlap",
    "rebuilds",
    "contacts",
)
"""Columns of a summary, SI; what they mean stands in ``state.SUMMARY`` and ``state.WORLD``."""


def law_table(scene: Scene) -> Array:
    """Contact constants for all pairs of classes: the bodies in order, then the wall; shape (kinds, kinds, 5)."""
    n = len(scene.bodies)
    wall = scene.rig.wall
    materials = [scene.material(body.material) for body in scene.bodies] + [scene.material(wall)]
    table = np.zeros((n + 1, n + 1, 5))
    for a, one in enumerate(scene.bodies):
        others: tuple[Body | str, ...] = (*scene.bodies, wall)
        for b, other in enumerate(others):
            row = constants(materials[a], materials[b], scene.contact_pair(one, other))
            table[a, b] = table[b, a] = row
    return table


def surface_tables(surfaces: tuple[Surface, ...], kind: int, active: tuple[bool, ...]) -> tuple[Array, Ints]:
    """Geometry (s, 4) and marks (shape, kind, active) (s, 3) of surfaces that share contact class ``kind``."""
    geometry = np.zeros((len(surfaces), 4))
    marks = np.zeros((len(surfaces), 3), dtype=np.int32)
    for s, surface in enumerate(surfaces):
        if isinstance(surface, Plane):
            geometry[s] = (surface.height, 0, 0, 0)
        else:
            geometry[s] = (surface.r0, surface.z0, surface.r1, surface.z1)
        marks[s] = (0 if isinstance(surface, Plane) else 1, kind, active[s])
    return geometry, marks


class Batch:
    """Worlds side by side. ``w`` is the index of a world throughout."""

    def __init__(self, capacity: Capacity) -> None:
        self.capacity = capacity
        self._a = arrays(capacity)
        self._steps = np.zeros(capacity.worlds, dtype=np.int32)

    def load(self, w: int, scene: Scene, bodies: Layout, dt: float, active: tuple[bool, ...]) -> None:
        """Empty world ``w`` and set it up for ``scene``; no body has entered yet."""
        a, rig = self._a, scene.rig
        inside = rig.container(0.0)
        settings = [dt, scene.numerics.skin, rig.domain_half_width, inside.height, inside.radius]
        exchange.load_world(a.world, w, np.array([*settings, *scene.gravity]))
        exchange.load_bodies(a.body, a.member, w, bodies.numbers, bodies.places, bodies.spheres, bodies.owner)
        tables = surface_tables(rig.surfaces(), len(scene.bodies), active)
        exchange.load_surfaces(a.world, a.surface, w, *tables)
        self.set_law(w, law_table(scene))

    def set_law(self, w: int, table: Array) -> None:
        """Replace the contact constants (see :func:`law_table`)."""
        exchange.load_law(self._a.law, w, np.ascontiguousarray(table))

    def set_time_step(self, w: int, dt: float) -> None:
        """Replace the time step [s]."""
        exchange.set_time_step(self._a.world, w, dt)

    def scale_springs(self, w: int, ratio: Array) -> None:
        """Multiply tangential springs by ``ratio[kind, kind]``."""
        a = self._a
        table = np.ascontiguousarray(ratio)
        exchange.scale_springs(a.world, a.body, a.member, a.contact, w, table)

    def enter(self, w: int, b: int, position: Array, quaternion: Array, velocity: Array, spin: Array) -> None:
        """Let body ``b`` enter (or put it somewhere else): SI, quaternion wxyz, spin in the principal frame."""
        pose = np.concatenate([position, quaternion, velocity, spin]).astype(float)
        exchange.load_state(self._a.world, self._a.body, w, b, pose)

    def set_active(self, w: int, surface: int, active: bool) -> None:
        """Switch a surface on or off."""
        exchange.set_active(self._a.world, self._a.surface, w, surface, int(active))

    def set_container(self, w: int, inside: Container) -> None:
        """What counts as inside the rig from now on (a cylinder that is lifted takes its inside along)."""
        exchange.set_container(self._a.world, w, inside.height, inside.radius)

    def advance(self, steps: Ints) -> Array:
        """Run world w for ``steps[w]`` steps; returns :meth:`summary`."""
        a = self._a
        self._steps[:] = steps
        advance(
            a.world,
            a.body,
            a.member,
            a.contact,
            a.history,
            a.surface,
            a.law,
            a.summary,
            self._steps,
        )
        return self.summary()

    def measure(self, w: int) -> Array:
        """Bring the summary of world ``w`` up to date without a step; returns :meth:`summary`."""
        a = self._a
        measure(a.world, a.body, a.member, a.contact, a.surface, a.law, a.summary, w)
        return self.summary()

    def summary(self) -> Array:
        """One row per world, columns ``SUMMARY_COLUMNS``, as of the last launch."""
        out = np.zeros((self.capacity.worlds, len(SUMMARY_COLUMNS)))
        exchange.read_summary(self._a.world, self._a.summary, out)
        return out

    def take_out(self, w: int) -> int:
        """Take bodies out that left the domain, and start looking for the largest overlap anew; returns the lost."""
        exchange.clear_overlap(self._a.world, w)
        return int(take_out(self._a.world, self._a.body, w))

    def bodies(self, w: int, n: int) -> Array:
        """State of the first ``n`` bodies: position 0:3, quaternion 3:7, velocity 7:10, spin 10:13, alive, touching."""
        out = np.zeros((n, 15))
        if n:
            exchange.read_bodies(self._a.body, w, out)
        return out
