"""A batch of worlds: the only owner of mutable state. NumPy in, NumPy out; this file contains no physics."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from solver import backend
from solver.effects.columns import effect_table, kernel_effects, reach_of_pulls
from solver.engine import moving_state, snapshot
from solver.engine.kernels import contacts, modify, transfer
from solver.engine.kernels.batch import advance, measure, take_out
from solver.engine.kernels.neighbours import MOST
from solver.engine.moving_state import Moving
from solver.engine.snapshot import Arrays
from solver.engine.state import Capacity, State, state
from solver.engine.tables import BodyTables, WallTables, extent, wall_tables
from solver.laws import CONTACT_LAWS
from solver.rigs.rig import Container
from solver.scenes.body import Body
from solver.scenes.scene import Scene

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
    "asleep",
    "dissipated",
    "wall_work",
    "taken_out",
)
"""Columns of a summary, in SI units; ``state.SUMMARY`` and ``state.WORLD`` describe them."""


def wall_materials(scene: Scene) -> tuple[str, ...]:
    """Materials of the rig's surfaces, each once, in order of appearance."""
    return tuple(dict.fromkeys(surface.material for surface in scene.rig.surfaces()))


def law_table(scene: Scene) -> Array:
    """Constants of the contact law, shape (kinds, kinds, columns of the law); kinds: bodies, then wall materials."""
    walls, law = wall_materials(scene), CONTACT_LAWS[scene.contact.law]
    n = len(scene.bodies)
    materials = [scene.material(body.material) for body in scene.bodies] + [scene.material(name) for name in walls]
    table = np.zeros((n + len(walls), n + len(walls), len(law.columns)))
    for a, one in enumerate(scene.bodies):
        others: tuple[Body | str, ...] = (*scene.bodies, *walls)
        for b, other in enumerate(others):
            row = law.constants(materials[a], materials[b], scene.contact_pair(one, other), scene.contact)
            table[a, b] = table[b, a] = row
    return table


def compiled_in(scenes: Sequence[Scene]) -> dict[str, Any]:
    """Fields of :class:`Capacity` with which kernels for ``scenes`` are compiled: effects, sharing, contact law.

    Raises ValueError for scenes with different laws, which cannot share kernels.
    """
    law, *others = sorted({scene.contact.law for scene in scenes})
    if others:
        raise ValueError(f"contact.law: {law} and {others[0]} cannot share a batch")
    return {
        "law": law,
        "effects": any(kernel_effects(scene) for scene in scenes),
        "sharing": any(scene.contact.shares for scene in scenes),
    }


def settings_of(scene: Scene, bodies: BodyTables, dt: float) -> dict[str, Any]:
    """Values of ``transfer.SETTINGS`` with which a world is set up."""
    numerics, inside = scene.numerics, scene.rig.container(0.0)
    return {
        "dt": dt,
        "gravity": scene.gravity,
        "skin": numerics.skin,
        "cell": 2.0 * float(bodies.numbers[:, 4].max()) + 2.0 * MOST * numerics.skin,
        "sleep_speed": numerics.sleep_speed if any(scene.gravity) else 0.0,
        "sleep_time": numerics.sleep_time,
        "domain": scene.rig.domain_half_width,
        "outlet": inside.height,
        "inlet_radius": inside.radius,
        **scene.contact.places,
    }


class Batch:
    """Independent worlds. ``w`` is always the index of a world, ``wall`` that of a surface of its rig."""

    def __init__(self, capacity: Capacity) -> None:
        self.capacity = capacity
        self._arrays = state(capacity)
        self._arrays.owner = self
        self._steps = np.zeros(capacity.worlds, dtype=np.int32)
        self._scenes: dict[int, Scene] = {}

    def load(self, w: int, scene: Scene, bodies: BodyTables, dt: float, active: Sequence[bool]) -> None:
        """Empty world ``w`` and set it up for ``scene``; no body has entered yet. ``active``: one per surface."""
        s, walls = self._s, wall_tables(scene.rig.surfaces())
        needed = {
            "bodies": len(bodies.numbers),
            "members": len(bodies.spheres),
            "kinds": len(scene.bodies) + len(wall_materials(scene)),
            "walls": len(walls.poses),
            "surfaces": len(walls.surfaces),
            "triangles": len(walls.corners),
            "cells": len(walls.first),
            "cell_items": len(walls.items),
        }
        for name, number in needed.items():
            if number > getattr(self.capacity, name):
                raise ValueError(f"{number} {name} do not fit into a batch of {getattr(self.capacity, name)}")
        if scene.contact.shares and not self.capacity.sharing:
            raise ValueError("contact.clump_rule: the batch was made for rules by which contacts do not share")
        if scene.contact.law != self.capacity.law:
            raise ValueError(f"contact.law: the batch was made for {self.capacity.law}, not for {scene.contact.law}")
        transfer.load_world(s, w, transfer.Settings(**settings_of(scene, bodies, dt)))
        transfer.load_bodies(s, w, bodies.numbers, bodies.places, bodies.spheres, bodies.owner)
        self._load_walls(w, scene, walls, active)
        self._scenes[w] = scene
        self.set_law(w, law_table(scene))
        self.set_effects(w, scene)

    @property
    def _s(self) -> State:
        """The arrays. Raises RuntimeError if a later batch of the same capacity has taken them over."""
        if self._arrays.owner is not self:
            raise RuntimeError("a later batch of the same capacity uses these arrays")
        return self._arrays

    def set_law(self, w: int, table: Array) -> None:
        """Replace the contact constants (see :func:`law_table`); wakes all bodies."""
        kinds = len(table)
        modify.load_law(self._s, w, np.ascontiguousarray(table.reshape(kinds * kinds, -1)), kinds)

    def set_effects(self, w: int, scene: Scene) -> None:
        """Replace the parameters of contact and body effects by those of ``scene``; wakes all bodies.

        Raises RuntimeError for effects in a batch whose capacity has none compiled in.
        """
        if kernel_effects(scene) and not self.capacity.effects:
            raise RuntimeError("this batch has no effects compiled in: its capacity needs effects=True")
        walls = wall_materials(scene)
        table = effect_table(scene, walls)
        rows = np.ascontiguousarray(table.reshape(-1, table.shape[-1]))
        modify.load_effects(self._s, w, rows, reach_of_pulls(scene, walls))

    def set_time_step(self, w: int, dt: float) -> None:
        """Replace the time step [s]."""
        modify.set_time_step(self._s, w, dt)

    def set_sleep(self, w: int, speed: float, time: float) -> None:
        """Replace ``numerics.sleep_speed`` [m/s] (0: no body sleeps) and ``sleep_time`` [s]; wakes all bodies."""
        modify.set_sleep(self._s, w, speed, time)

    def set_gravity(self, w: int, gravity: Sequence[float]) -> None:
        """Replace gravity [m/s²]; wakes all bodies."""
        modify.set_gravity(self._s, w, *(float(g) for g in gravity))

    def scale_springs(self, w: int, ratio: Array) -> None:
        """Multiply tangential springs by ``ratio[kind, kind]``."""
        modify.scale_springs(self._s, w, np.ascontiguousarray(ratio.ravel()))

    def enter(self, w: int, b: int, position: Array, quaternion: Array, velocity: Array, spin: Array) -> None:
        """Let body ``b`` enter, or move it elsewhere; SI units, quaternion wxyz, spin in the principal frame."""
        pose = np.concatenate([position, quaternion, velocity, spin]).astype(float)
        modify.load_state(self._s, w, b, pose)

    def set_active(self, w: int, wall: int, active: bool) -> None:
        """Switch a surface on or off; wakes all bodies."""
        modify.set_active(self._s, w, wall, int(active))

    def set_motion(self, w: int, wall: int, velocity: Sequence[float], angular_velocity: Sequence[float]) -> None:
        """Let a surface move: ``velocity`` [m/s] of its pose's origin, ``angular_velocity`` [rad/s, world] about it."""
        rig = self._scenes[w].rig
        reach = extent(rig.surfaces()[wall], angular_velocity, rig.domain_half_width)
        modify.set_motion(self._s, w, wall, np.array([*velocity, *angular_velocity, reach], dtype=float))

    def set_pull(self, w: int, b: int | None, force: Sequence[float]) -> None:
        """Pull body ``b`` (None: no body) at its centre of mass with ``force`` [N] from now on; wakes all bodies."""
        modify.set_pull(self._s, w, 0 if b is None else b + 1, *(float(component) for component in force))

    def set_container(self, w: int, inside: Container) -> None:
        """Set what counts as inside the rig from now on (the inside of a lifted cylinder moves with it)."""
        modify.set_container(self._s, w, inside.height, inside.radius)

    def run(self, steps: Ints) -> None:
        """Run world w for ``steps[w]`` steps."""
        self._steps[:] = steps
        advance(self._s, self._steps)
        backend.keep_compiled()

    def advance(self, steps: Ints) -> Array:
        """:meth:`run`; returns :meth:`summary`."""
        self.run(steps)
        return self.summary()

    def measure(self, w: int) -> Array:
        """Update the summary of world ``w`` without a step; returns :meth:`summary`."""
        measure(self._s, w)
        return self.summary()

    def summary(self) -> Array:
        """One row per world, columns ``SUMMARY_COLUMNS``, as of the last launch."""
        out = np.zeros((self.capacity.worlds, len(SUMMARY_COLUMNS)))
        transfer.read_summary(self._s, out)
        return out

    def take_out(self, w: int) -> int:
        """Take out bodies that left the domain, and reset the largest overlap; returns the number of lost bodies."""
        modify.clear_overlap(self._s, w)
        return int(take_out(self._s, w))

    def bodies(self, w: int, n: int) -> Array:
        """First ``n`` bodies: position 0:3, quaternion 3:7, velocity 7:10, spin 10:13, alive, touching, asleep."""
        out = np.zeros((n, 16))
        if n:
            transfer.read_bodies(self._s, w, out)
        return out

    def contacts(self, w: int) -> Array:
        """Contacts as of the last step, one row each: see ``kernels/contacts.py`` and ``solver/pours/contacts.py``."""
        room, count = int(self.summary()[w, SUMMARY_COLUMNS.index("contacts")]), np.zeros(1, dtype=np.int32)
        out = np.zeros((room, 11))
        if room:
            contacts.read_contacts(self._s, w, out, count)
        return out[: count[0]]

    def surface_state(self, w: int) -> Array:
        """Per surface: origin 0:3, quaternion 3:7, velocity 7:10, angular velocity 10:13, force 13:16, torque 16:19.

        The pose is that after the last step; force [N] and torque about the origin [N m] are those at its beginning.
        """
        out = np.zeros((len(self._scenes[w].rig.surfaces()), 19))
        transfer.read_walls(self._s, w, out)
        return out

    def take(self, w: int) -> Arrays:
        """World ``w`` as plain arrays (``solver/engine/snapshot.py``)."""
        return snapshot.take(self._s, w)

    def put(self, w: int, arrays: Arrays) -> None:
        """Restore a world that :meth:`take` returned, after :meth:`load` with the same scene."""
        snapshot.put(self._s, w, arrays)

    def take_moving(self, w: int, bodies: int, members: int) -> Moving:
        """Changing state of world ``w`` with ``bodies`` bodies and ``members`` spheres loaded; for this slot only."""
        return moving_state.take(self._s, w, bodies, members)

    def put_moving(self, w: int, kept: Moving) -> None:
        """Restore what :meth:`take_moving` returned; contact law and effects must be the same as then."""
        moving_state.put(self._s, w, kept)

    def _load_walls(self, w: int, scene: Scene, tables: WallTables, active: Sequence[bool]) -> None:
        s, walls = self._s, wall_materials(scene)
        kinds = [len(scene.bodies) + walls.index(surface.material) for surface in scene.rig.surfaces()]
        marks = np.array(list(zip(kinds, map(int, active), strict=True)), dtype=np.int32)
        transfer.load_walls(s, w, tables.poses, marks, tables.grids, tables.cells)
        transfer.load_surfaces(s, w, tables.geometry, tables.surfaces, tables.primitives)
        if len(tables.corners):
            transfer.load_triangles(s, w, tables.corners, tables.guards, tables.triangles)
            transfer.load_cells(s, w, tables.first, tables.items)
