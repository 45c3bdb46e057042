"""What the tests of effects share: one size of batch, every effect at a strength that is felt, and a few set-ups."""

import dataclasses

import numpy as np

from solver.effects import EFFECTS, Effect, body_effects, contact_effects
from solver.engine.tables import body_tables
from solver.engine.world import SUMMARY_COLUMNS, Batch
from solver.rigs.surface import Plane, SurfacePose
from solver.scenes.body import Body, Members
from solver.scenes.material import Pair
from solver.scenes.time_step import time_step
from solver.single_body.free_world import FREE, GRAIN, RADIUS, ROOM, UPRIGHT, WALL, FreeWorld, scene_of, sphere

ROOM_WITH_EFFECTS = dataclasses.replace(ROOM, effects=True)
"""That of a laboratory with an effect on."""
NOT_TURNED = np.eye(3)
THREE_WORLDS = dataclasses.replace(ROOM_WITH_EFFECTS, worlds=3)

FELT: dict[str, dict[str, float]] = {
    "rolling_resistance": {"rolling_friction": 0.1, "rolling_damping": 0.3},
    "adhesion_jkr": {"work_of_adhesion": 2.0},
    "adhesion_sjkr": {"cohesion_energy_density": 1e5},
    "capillary_bridge": {"surface_tension": 0.3, "bridge_volume": 1e-9, "contact_angle": 0.3},
    "air_drag": {"strength": 20.0},
    "twisting": {"strength": 5.0},
    "velocity_dependent_restitution": {"speed_sensitivity": 1.0, "reference_speed": 0.5},
    "plastic_contact": {"plasticity": 0.5},
    "kinetic_friction": {"friction_drop": 0.5, "transition_speed": 0.05},
    "wall_adhesion": {"work_of_adhesion": 2.0},
    "size_dispersion": {"spread": 0.05},
    "shape_elongation": {"elongation": 0.2},
    "density_error": {"excess": 0.2},
    "plate_tilt": {"tilt_x": 3.0, "tilt_y": -2.0},
    "funnel_offset": {"dx": 0.01, "dy": -0.02},
}
"""A value for every parameter of every effect."""

IN_KERNELS = tuple(kind.name for kind in (*contact_effects(), *body_effects()))
ON_CONTACTS = tuple(kind.name for kind in contact_effects())


def felt(name: str, **changes: float) -> Effect:
    """The effect ``name`` as strong as ``FELT`` says, but for ``changes``."""
    return EFFECTS[name](**(FELT[name] | changes))


def with_effects(scene, *effects):
    for effect in effects:
        scene = scene.with_effect(effect)
    return scene


def all_felt(scene):
    """``scene`` with every effect on contacts and flight at once."""
    return with_effects(scene, *(felt(name) for name in IN_KERNELS))


def scene_with(
    *effects,
    bodies=None,
    friction=0.5,
    restitution=0.6,
    gravity=FREE,
    turn=(1.0, 0.0, 0.0, 0.0),
    grain=GRAIN,
    sleep_speed=0.0,
):
    """Bodies of the material "grain" over a plane through the origin, which ``turn`` (wxyz) turns; with ``effects``."""
    pairs = (Pair("grain", "grain", friction, restitution), Pair("grain", "wall", friction, restitution))
    plane = Plane("wall", SurfacePose((0.0, 0.0, 0.0), tuple(float(x) for x in turn)))
    scene = scene_of(bodies or (sphere(material=grain),), (grain, WALL), pairs, (plane,), tuple(map(float, gravity)))
    scene = dataclasses.replace(scene, numerics=dataclasses.replace(scene.numerics, sleep_speed=sleep_speed))
    return with_effects(scene, *effects)


def heavy(mass, radius=RADIUS, name="grain"):
    """A sphere so heavy that contacts hardly change its velocity: it moves as it is told."""
    inertia = 0.4 * mass * radius**2
    return Body(name, "grain", 1.0, Members(((0.0, 0.0, 0.0),), (radius,), mass, (inertia,) * 3), GRAIN.density)


def sled(side=0.02, radius=RADIUS):
    """Four spheres in a square, which slide and do not roll, with the centre of mass between their centres."""
    centres = tuple((x * side, y * side, 0.0) for x in (-1, 1) for y in (-1, 1))
    mass = 5e-3
    flat = mass * side**2
    return Body("grain", "grain", 1.0, Members(centres, (radius,) * 4, mass, (flat, flat, 2.0 * flat)), GRAIN.density)


def hertz_rest(force, e_star, radius=RADIUS):
    """Overlap [m] at which a Hertzian contact carries ``force`` [N]."""
    return (3.0 * force / (4.0 * e_star * np.sqrt(radius))) ** (2.0 / 3.0)


def crowd(capacity, scene, n=24, w=0):
    """``n`` spheres of ``scene`` in world ``w`` that fall on each other: the batch, ready to run."""
    batch = Batch(capacity)
    fill(batch, scene, w, n)
    return batch


def fill(batch, scene, w, n=24):
    """The same in a batch that is there."""
    batch.load(w, scene, body_tables(scene, np.zeros(n, dtype=np.int32)), time_step(scene), (True,))
    rng = np.random.default_rng(3)
    for b in range(n):
        place = RADIUS * np.array([2.1 * (b % 3 - 1), 2.1 * (b // 3 % 3 - 1), 1.1 + 2.1 * (b // 9)])
        batch.enter(w, b, place, np.array([1.0, 0, 0, 0]), rng.normal(0, 0.1, 3), rng.normal(0, 5.0, 3))


def onward(batch, steps, w=0):
    """Run world ``w`` for ``steps``; its summary by name."""
    todo = np.zeros(batch.capacity.worlds, dtype=np.int32)
    todo[w] = steps
    return dict(zip(SUMMARY_COLUMNS, batch.advance(todo)[w].tolist(), strict=True))


def tumble(scene, dt=None, scale=(1.0, 1.0), turn=NOT_TURNED, quaternion=UPRIGHT, seconds=0.06):
    """Three spheres: one drops on the plane with spin, one rolls along it, one falls on the first; then state and dt.

    ``scale`` multiplies lengths and times, ``turn`` turns all of it (``quaternion``: the same rotation).
    """
    length, time = scale
    lab = FreeWorld(scene, 3, dt=dt)
    places = RADIUS * np.array([[0.0, 0.0, 1.1], [8.0, 0.0, 1.001], [0.7, 0.3, 3.4]])
    velocities = np.array([[0.1, 0.05, -0.3], [0.2, 0.0, 0.0], [0.0, 0.0, -0.4]])
    spins = np.array([[3.0, -8.0, 20.0], [0.0, 0.2 / RADIUS, 10.0], [-5.0, 4.0, 9.0]])
    for b in range(3):
        place, velocity = turn @ places[b] * length, turn @ velocities[b] * (length / time)
        lab.put(b, place, velocity, spins[b] / time, quaternion)
    lab.run(round(seconds * time / lab.dt))
    return lab.state(), lab.dt
