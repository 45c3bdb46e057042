"""What may not change: momentum, angular momentum, energy without dissipation, and the motion of a free body."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
from scipy.special import ellipk

from solver.scenes.body import Body, Members
from solver.scenes.insertion import rotation_matrix
from solver.scenes.material import Pair
from solver.single_body.free_world import EARTH, GRAIN, RADIUS, WALL, FreeWorld, grain_on_plate, scene_of, sphere
from solver.verification.row import Row, of_scale, of_value

Array = npt.NDArray[np.float64]

ROUNDING = 1e-9
"""Limit [%] where only rounding may differ."""
ENERGY_STEPS = 100_000
ENERGY_LIMIT = 0.5
TUMBLING_LIMIT = 0.1
BRICK_INERTIA = np.array([1e-8, 3e-8, 4e-8])


def momentum() -> Iterator[Row]:
    """Two unequal spinning spheres in an oblique, frictional, damped impact."""
    large, small = sphere(0.008, name="large"), sphere(0.003, name="small")
    pairs = (Pair("grain", "grain", 0.6, 0.5), Pair("grain", "wall", 0.6, 0.5))
    lab = FreeWorld(scene_of((large, small), (GRAIN, WALL), pairs), [0, 1], plate=False)
    lab.put(0, (0.0, 0.0, 0.0), velocity=(0.1, 0.2, 0.0), spin=(30.0, -20.0, 10.0))
    lab.put(1, (0.0115, 0.002, 0.001), velocity=(-0.9, 0.1, 0.2), spin=(-50.0, 80.0, 40.0))
    before = _momenta(lab, (large, small))
    lab.run_apart(100_000, 50)
    for name, old, new in zip(("momentum", "angular momentum"), before, _momenta(lab, (large, small)), strict=True):
        scale, worst = (float(np.linalg.norm(old)), "its size"), int(np.argmax(np.abs(new - old)))
        quantity = f"{name} of two spheres, worst component"
        yield of_scale("momentum", quantity, old[worst], new[worst], scale, ROUNDING, "conservation")


def energy() -> Iterator[Row]:
    """e = 1 and μ = 0: one bouncing sphere, and eight that bounce and meet, with the time step of a pour."""
    for name, places in (
        ("bouncing sphere", [(0.0, 0.0, 2.0)]),
        ("eight spheres", [(x, y, z) for x in (-0.55, 0.55) for y in (-0.55, 0.55) for z in (1.5, 3.0)]),
    ):
        scene = grain_on_plate(friction=0.0, restitution=1.0, gravity=EARTH)
        lab = FreeWorld(scene, len(places), fraction=0.3)
        generator = np.random.default_rng(5)
        for b, place in enumerate(places):
            aside = generator.normal(size=3) * (0.02 if len(places) > 1 else 0.0)
            lab.put(b, 2.0 * RADIUS * np.array(place), velocity=aside)
        before = _mechanical(lab)
        lab.run(ENERGY_STEPS)
        while lab.run(1)["touching"]:
            pass
        quantity = f"energy after {ENERGY_STEPS} steps, {name} [J]"
        yield of_value("energy", quantity, before, _mechanical(lab), ENERGY_LIMIT, "conservation")


def tumbling() -> Iterator[Row]:
    """A free brick that spins about its middle axis turns over and over; period by elliptic integrals."""
    members = Members(((0.0, 0.0, 0.0),), (2e-3,), 1e-3, tuple(BRICK_INERTIA))
    lab = FreeWorld(grain_on_plate(Body("grain", "grain", 1.0, members, GRAIN.density)), 1, dt=1e-5, plate=False)
    start = np.array([0.3, 60.0, 0.2])
    lab.put(0, (0.0, 0.0, 0.0), spin=start)
    chunk, spins, axes = 50, [start], []
    for _ in range(4000):
        lab.run(chunk)
        row = lab.state()[0]
        spins.append(row[10:13])
        axes.append(rotation_matrix(row[3:7]) @ (BRICK_INERTIA * row[10:13]))
    period = 2.0 * float(np.diff(_crossings(np.array(spins)[:, 1])).mean()) * chunk * lab.dt
    exact = "Euler's equations, elliptic integral"
    yield of_value("tumbling", "period [s]", tumbling_period(BRICK_INERTIA, start), period, TUMBLING_LIMIT, exact)
    energies = 0.5 * np.array(spins) ** 2 @ BRICK_INERTIA
    furthest = energies[np.argmax(np.abs(energies - energies[0]))]
    yield of_value("tumbling", "energy [J], furthest", energies[0], furthest, 1e-6, "conservation")
    momentum = BRICK_INERTIA * start
    worst = max(axes, key=lambda axis: float(np.linalg.norm(axis - momentum)))
    size = float(np.linalg.norm(momentum))
    off = float(np.linalg.norm(worst - momentum))
    # Spin and orientation stand half a step apart: ½ |ω| dt = 3e-4, which may not grow.
    yield of_scale("tumbling", "angular momentum off by [kg m²/s]", 0.0, off, (size, "its size"), 0.05, "conservation")


def tumbling_period(inertia: Array, spin: Array) -> float:
    """Period [s] of a torque-free body with principal moments I1 < I2 < I3 (Landau & Lifshitz, Mechanics, § 37)."""
    one, two, three = (float(x) for x in inertia)
    twice_energy, squared = float(inertia @ spin**2), float((inertia * spin) @ (inertia * spin))
    if squared < twice_energy * two:
        one, three = three, one
    rate = np.sqrt((three - two) * (squared - twice_energy * one) / (one * two * three))
    modulus = (two - one) * (twice_energy * three - squared) / ((three - two) * (squared - twice_energy * one))
    return float(4.0 * ellipk(modulus) / rate)


def _crossings(values: Array) -> Array:
    """Indices, between samples by a straight line, at which ``values`` change sign."""
    k = np.flatnonzero(values[:-1] * values[1:] < 0.0)
    return np.asarray(k + values[k] / (values[k] - values[k + 1]))


def _momenta(lab: FreeWorld, bodies: tuple[Body, ...]) -> tuple[Array, Array]:
    linear, angular = np.zeros(3), np.zeros(3)
    for row, body in zip(lab.state(), bodies, strict=True):
        linear += body.mass * row[7:10]
        angular += body.mass * np.cross(row[0:3], row[7:10])
        angular += rotation_matrix(row[3:7]) @ (np.asarray(body.clump.inertia) * row[10:13])
    return linear, angular


def _mechanical(lab: FreeWorld) -> float:
    """Kinetic and potential energy [J] of bodies in free flight; velocities brought from the half to the full step."""
    gravity = np.array(lab.scene.gravity)
    rows, body = lab.state(), lab.scene.bodies[0]
    velocity = rows[:, 7:10] + 0.5 * lab.dt * gravity
    return float(body.mass * (0.5 * (velocity**2).sum() - (rows[:, 0:3] @ gravity).sum()))
