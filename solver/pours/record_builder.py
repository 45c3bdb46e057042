"""From the numbers of a running world to the frozen parts of a record."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from solver.engine.tables import BodyTables
from solver.observables.free_surface import column_places
from solver.pours.record import Bodies, Entries, FreeSurface, Pile, Spheres, Trace
from solver.pours.supply import Entry
from solver.rigs.rig import Container, Watch
from solver.scenes.insertion import rotation_matrix
from solver.scenes.numerics import ROLLING_SLOPE
from solver.scenes.scene import Scene

Array = npt.NDArray[np.float64]


def bodies_of(scene: Scene, order: npt.NDArray[np.int32], places: BodyTables, state: Array) -> Bodies:
    """Bodies that have entered, from the rows of ``Batch.bodies``."""
    n = len(state)
    return Bodies(
        component=order[:n].copy(),
        component_names=tuple(body.name for body in scene.bodies),
        mass=places.numbers[:n, 0].copy(),
        scale=places.scale[:n].copy(),
        position=state[:, 0:3].copy(),
        quaternion=state[:, 3:7].copy(),
        velocity=state[:, 7:10].copy(),
        inside=state[:, 13] > 0.5,
    )


def member_spheres(scene: Scene, bodies: Bodies) -> Spheres:
    """Member spheres of ``bodies`` in the world; bodies that were taken out have none."""
    centres, radii, owners = [np.zeros((0, 3))], [np.zeros(0)], [np.zeros(0, dtype=np.int32)]
    for k, body in enumerate(scene.bodies):
        chosen = np.flatnonzero((bodies.component == k) & bodies.inside)
        if len(chosen) == 0:
            continue
        clump = body.clump
        scale = bodies.scale[chosen]
        turned = np.einsum("bij,mj->bmi", rotation_matrix(bodies.quaternion[chosen]), clump.centres)
        centres.append((bodies.position[chosen, None, :] + scale[:, None, None] * turned).reshape(-1, 3))
        radii.append((scale[:, None] * clump.radii).ravel())
        owners.append(np.repeat(chosen.astype(np.int32), len(clump.radii)))
    return Spheres(np.concatenate(centres), np.concatenate(radii), np.concatenate(owners))


def rolling_away(scene: Scene, container: Container, state: Array) -> npt.NDArray[np.bool_]:
    """Bodies that still roll outward on the plate, alone and beyond the container's radius.

    The criterion is ``rolls_away`` of ``engine/kernels/batch.py``, for bodies that also move faster than
    ``numerics.rest_speed``. ``state``: rows of ``Batch.bodies``. Nothing slows these bodies down, so their positions
    depend on when one looks.
    """
    x, v, touching = state[:, 0:3], state[:, 7:10], state[:, 14]
    beyond = np.hypot(x[:, 0], x[:, 1]) > container.radius
    outward = (x[:, :2] * v[:, :2]).sum(axis=1) > 0.0
    speed = np.linalg.norm(v, axis=1)
    level = np.abs(v[:, 2]) < ROLLING_SLOPE * speed
    return beyond & outward & level & (speed > scene.numerics.rest_speed) & (touching == 0)


def measured_from(pile: Pile, axis: tuple[float, float]) -> Pile:
    """``pile`` in coordinates about a point of the plate from which the rig's axis is at ``axis`` [m]."""
    if axis == (0.0, 0.0):
        return pile
    shift = np.array([*axis, 0.0])
    spheres = replace(pile.spheres, centre=pile.spheres.centre + shift)
    return replace(pile, spheres=spheres, position=pile.position + shift)


def lying(container: Container, bodies: Bodies, rolling: npt.NDArray[np.bool_] | None = None) -> npt.NDArray[np.bool_]:
    """Bodies that lie below the container, inside the domain, and do not roll away."""
    below = bodies.inside & (bodies.position[:, 2] < container.height)
    return below if rolling is None else below & ~rolling


def pile_of(bodies: Bodies, spheres: Spheres, chosen: npt.NDArray[np.bool_]) -> Pile:
    """The pile of the ``chosen`` bodies, renumbered from 0."""
    number = np.where(chosen, np.cumsum(chosen) - 1, -1).astype(np.int32)
    kept = number[spheres.body] >= 0
    return Pile(
        spheres=Spheres(spheres.centre[kept], spheres.radius[kept], number[spheres.body[kept]]),
        position=bodies.position[chosen],
        mass=bodies.mass[chosen],
        component=bodies.component[chosen],
        component_names=bodies.component_names,
    )


def free_surface_of(watch: Watch | None, kept: list[tuple[float, Array]]) -> FreeSurface | None:
    """The free surface at the moments ``kept`` (time, heights); None if none was kept."""
    if watch is None or not kept:
        return None
    return FreeSurface(
        time=np.array([time for time, _ in kept]),
        x=column_places(watch.half_width),
        height=np.array([height for _, height in kept]),
    )


def trace_of(samples: list[dict[str, float]]) -> Trace:
    """Curves from the samples of a run."""

    def column(name: str) -> Array:
        return np.array([sample[name] for sample in samples], dtype=float)

    return Trace(
        time=column("time"),
        entered_mass=column("entered"),
        discharged_mass=column("discharged"),
        kinetic_energy=column("kinetic"),
        contacts=column("touching").astype(np.int32),
        max_overlap=column("overlap"),
        potential_energy=column("potential"),
        elastic_energy=column("elastic"),
        dissipated_energy=column("dissipated"),
        wall_work=column("wall_work"),
        taken_out_energy=column("taken_out"),
        supplied_energy=column("supplied"),
    )


def entries_of(order: npt.NDArray[np.int32], log: list[Entry]) -> Entries:
    """How bodies entered, from the log of a run."""
    n = len(log)
    return Entries(
        time=np.array([entry.time for entry in log], dtype=float),
        step=np.array([entry.step for entry in log], dtype=np.int32),
        component=order[:n].copy(),
        position=np.array([entry.pose.position for entry in log], dtype=float).reshape(n, 3),
        quaternion=np.array([entry.pose.quaternion for entry in log], dtype=float).reshape(n, 4),
        velocity=np.array([entry.velocity for entry in log], dtype=float).reshape(n, 3),
    )
