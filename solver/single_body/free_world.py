"""A free world: single bodies and contacts, placed by hand, with no pour and no rig in the way.

Tests and the verification build a scene here, put bodies where they want them, run steps and read the state. One world;
bodies that stand far apart do not meet, so many cases share it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from solver.engine.state import Capacity
from solver.engine.tables import body_tables, wall_tables
from solver.engine.world import SUMMARY_COLUMNS, Batch, compiled_in, wall_materials
from solver.rigs.rig import BareRig
from solver.rigs.surface import Surface, horizontal
from solver.scenes.body import Body, Members
from solver.scenes.material import Material, Pair
from solver.scenes.numerics import Numerics
from solver.scenes.scene import Scene, actual
from solver.scenes.time_step import time_step

Array = npt.NDArray[np.float64]
Triple = Sequence[float] | Array

GRAIN = Material("grain", density=2500.0, shear_modulus=1e7, poisson_ratio=0.25)
WALL = Material("wall", density=7800.0, shear_modulus=8e10, poisson_ratio=0.3)
FREE = (0.0, 0.0, 0.0)
EARTH = (0.0, 0.0, -9.81)
PLATE = horizontal(0.0, "wall")
"""z = 0, bodies above it."""
RADIUS = 5e-3
"""Default radius of the grain that :func:`sphere` makes [m]."""
AT_REST = np.zeros(3)
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])

ROOM = Capacity(worlds=1, bodies=128, members=1024, contacts=8192).rounded()
"""One size for free worlds and small pours, so that the kernels are compiled once. Only the newest one is valid."""
MANY_KINDS = 64
"""Contact classes of the next size."""


@dataclass(frozen=True)
class GivenSurfaces(BareRig):
    """The rig of a free world: the surfaces it is given and nothing else."""

    fixed: tuple[Surface, ...]
    wall: str = WALL.name
    domain_half_width: float = 10.0

    def surfaces(self) -> tuple[Surface, ...]:
        """Surfaces in the order in which they were given."""
        return self.fixed


def sphere(radius: float = RADIUS, material: Material = GRAIN, copies: int = 1, name: str = "grain") -> Body:
    """A solid sphere; ``copies`` coincident member spheres do not change its mass."""
    mass = 4.0 / 3.0 * np.pi * radius**3 * material.density
    inertia = 0.4 * mass * radius**2
    members = Members(((0.0, 0.0, 0.0),) * copies, (radius,) * copies, mass, (inertia,) * 3)
    return Body(name, material.name, 1.0, members, material.density)


def scene_of(
    bodies: Sequence[Body],
    materials: Sequence[Material],
    pairs: Sequence[Pair],
    surfaces: Sequence[Surface] = (PLATE,),
    gravity: tuple[float, float, float] = FREE,
) -> Scene:
    """A scene whose rig consists only of ``surfaces`` of the material "wall"; no body falls asleep in it."""
    rig, awake = GivenSurfaces(tuple(surfaces)), Numerics(sleep_speed=0.0)
    return Scene("laboratory", tuple(materials), tuple(bodies), tuple(pairs), rig, numerics=awake, gravity=gravity)


def grain_on_plate(
    body: Body | None = None,
    friction: float = 0.3,
    restitution: float = 0.5,
    wall_friction: float | None = None,
    gravity: tuple[float, float, float] = FREE,
    grain: Material = GRAIN,
    wall: Material = WALL,
) -> Scene:
    """One kind of body, of the material ``grain``, and the plate z = 0."""
    wall_friction = friction if wall_friction is None else wall_friction
    pairs = (
        Pair("grain", "grain", friction, restitution),
        Pair("grain", "wall", wall_friction, restitution),
    )
    return scene_of((body or sphere(),), (grain, wall), pairs, gravity=gravity)


class FreeWorld:
    """Bodies of a scene, put where they are wanted; the next free world takes over the arrays and invalidates this one.

    ``kinds`` says which of the scene's bodies each of them is: a number of bodies of the first kind, or one index per
    body. The time step [s] is ``dt``, or that of ``time_step.py`` with ``fraction`` of the Rayleigh time. ``active``
    says which surfaces are there from the start; None: all of them if ``plate``, else none.
    """

    def __init__(
        self,
        scene: Scene,
        kinds: int | Sequence[int],
        dt: float | None = None,
        fraction: float = 0.1,
        plate: bool = True,
        active: Sequence[bool] | None = None,
    ) -> None:
        order = np.zeros(kinds, dtype=np.int32) if isinstance(kinds, int) else np.array(kinds, dtype=np.int32)
        numerics = dataclasses.replace(scene.numerics, rayleigh_fraction=fraction)
        self.scene = actual(dataclasses.replace(scene, numerics=numerics))
        self.n = len(order)
        self.dt = dt or time_step(self.scene)
        surfaces = self.scene.rig.surfaces()
        self.batch = Batch(dataclasses.replace(room_for(self.scene), **compiled_in([self.scene])))
        self.batch.load(0, self.scene, body_tables(self.scene, order), self.dt, active or [plate] * len(surfaces))

    def put(
        self, b: int, position: Triple, velocity: Triple = AT_REST, spin: Triple = AT_REST, quaternion: Triple = UPRIGHT
    ) -> None:
        """Place body ``b``: position [m] and velocity [m/s] in the world, spin [rad/s] in the principal frame."""
        self.batch.enter(0, b, *(np.asarray(x, dtype=float) for x in (position, quaternion, velocity, spin)))

    def run(self, steps: int) -> dict[str, float]:
        """Advance by ``steps``; returns the summary, columns ``world.SUMMARY_COLUMNS``."""
        row = self.batch.advance(np.array([steps], dtype=np.int32))[0]
        return dict(zip(SUMMARY_COLUMNS, row.tolist(), strict=True))

    def run_apart(self, steps: int, chunk: int) -> None:
        """Advance until contacts have formed and all have ended, at most ``steps``, checking every ``chunk`` steps."""
        met = False
        for _ in range(0, steps, chunk):
            touching = self.run(chunk)["touching"] > 0
            if met and not touching:
                return
            met = met or touching
        raise RuntimeError(f"bodies are not apart after {steps} steps of {self.dt:g} s")

    def state(self) -> Array:
        """Rows of ``Batch.bodies``: position 0:3, quaternion 3:7, velocity 7:10, spin 10:13 of every body."""
        return self.batch.bodies(0, self.n)


def room_for(scene: Scene) -> Capacity:
    """:data:`ROOM`, with as much room for contact classes and triangles as ``scene`` needs."""
    tables, kinds = wall_tables(tuple(scene.rig.surfaces())), len(scene.bodies) + len(wall_materials(scene))
    return dataclasses.replace(
        ROOM,
        kinds=ROOM.kinds if kinds <= ROOM.kinds else max(kinds, MANY_KINDS),
        walls=max(ROOM.walls, len(tables.poses)),
        surfaces=max(ROOM.surfaces, len(tables.surfaces)),
        triangles=max(1, len(tables.corners)),
        cells=max(1, len(tables.first)),
        cell_items=max(1, len(tables.items)),
    ).rounded()
