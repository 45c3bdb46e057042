"""A bench for single contacts: spheres (or any clump) on a plate or in free space, with no funnel in the way."""

import dataclasses

import numpy as np

from solver.body import Body, Members
from solver.layout import layout
from solver.material import Material, Pair
from solver.rigs import Funnel
from solver.run import capacity_for
from solver.scene import Scene
from solver.time_step import time_step
from solver.world import SUMMARY_COLUMNS, Batch

GRAIN = Material("grain", density=2500.0, shear_modulus=1e7, poisson_ratio=0.25)
WALL = Material("wall", density=7800.0, shear_modulus=8e10, poisson_ratio=0.3)
FREE = (0.0, 0.0, 0.0)
EARTH = (0.0, 0.0, -9.81)
RADIUS = 5e-3
AT_REST = np.zeros(3)
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


def sphere(radius=RADIUS, material=GRAIN, copies=1):
    """A solid sphere as a body; ``copies`` member spheres that coincide change nothing of its mass."""
    mass = 4.0 / 3.0 * np.pi * radius**3 * material.density
    inertia = 0.4 * mass * radius**2
    members = Members(((0.0, 0.0, 0.0),) * copies, (radius,) * copies, mass, (inertia,) * 3)
    return Body("grain", material.name, 1.0, members, material.density)


def bench(body=None, friction=0.3, restitution=0.5, wall_friction=None, gravity=FREE, grain=GRAIN, wall=WALL):
    """A scene with one kind of body and the plate; the funnel is there but switched off by :class:`Laboratory`."""
    wall_friction = friction if wall_friction is None else wall_friction
    return Scene(
        title="bench",
        materials=(grain, wall),
        bodies=(body or sphere(),),
        pairs=(
            Pair("grain", "grain", friction, restitution),
            Pair("grain", "wall", wall_friction, restitution),
        ),
        rig=Funnel(wall="wall"),
        gravity=gravity,
    )


class Laboratory:
    """``n`` bodies of a scene, put where a test wants them."""

    def __init__(self, scene, n, dt=None, fraction=0.1, plate=True, active=None):
        self.scene = dataclasses.replace(
            scene, numerics=dataclasses.replace(scene.numerics, rayleigh_fraction=fraction)
        )
        self.n = n
        self.dt = dt or time_step(self.scene)
        room = dataclasses.replace(capacity_for([self.scene], 1), bodies=256, members=2048, contacts=32768)
        self.batch = Batch(room)
        order = np.zeros(n, dtype=np.int32)
        self.batch.load(0, self.scene, layout(self.scene, order), self.dt, active or (plate, False, False))

    def put(self, b, position, velocity=AT_REST, spin=AT_REST, quaternion=UPRIGHT):
        """Place body ``b``: velocity in the world, spin in the principal frame."""
        self.batch.enter(0, b, *(np.asarray(x, dtype=float) for x in (position, quaternion, velocity, spin)))

    def run(self, steps):
        """Advance; returns the summary as a dict."""
        row = self.batch.advance(np.array([steps], dtype=np.int32))[0]
        return dict(zip(SUMMARY_COLUMNS, row.tolist(), strict=True))

    def state(self):
        """Rows of ``Batch.bodies``."""
        return self.batch.bodies(0, self.n)
