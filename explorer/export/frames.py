"""The output of the engines: the state of all member spheres at one moment, in the text form of a LAMMPS dump.

``final.txt`` holds the last moment, ``trajectory.txt`` (if requested) one moment every so many steps. Columns: id,
radius, x, y, z, vx, vy, vz, omegax, omegay, omegaz; SI. Spheres are numbered from 1 in order of entry; the spheres of a
body are consecutive, in the order of its clump.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from explorer.export.deck import Deck

Array = npt.NDArray[np.float64]
FINAL, TRAJECTORY = "final.txt", "trajectory.txt"
HEADER = 9
"""Lines of a frame before its first sphere."""


@dataclass(frozen=True)
class SphereFrame:
    """All spheres of one moment (n of them), in order of their numbers."""

    step: int
    """Steps done, in the engine's own counting."""
    id: npt.NDArray[np.int64]
    radius: Array
    """[m], shape (n,)."""
    position: Array
    """Centres [m], shape (n, 3)."""
    velocity: Array
    """Velocity of the centres [m/s], shape (n, 3)."""
    spin: Array
    """Spin of the body, in the world's frame [rad/s], shape (n, 3)."""


@dataclass(frozen=True)
class BodyFrame:
    """Bodies of one moment (n of them), in order of entry."""

    position: Array
    """Centres of mass [m], shape (n, 3)."""
    rotation: Array
    """Principal frame → world, shape (n, 3, 3); about the axis of a straight row of spheres it is arbitrary."""
    velocity: Array
    """Velocity of the centres of mass [m/s], shape (n, 3)."""
    spin: Array
    """In the world's frame [rad/s], shape (n, 3)."""


def read_frames(path: Path) -> Iterator[SphereFrame]:
    """Frames of a dump, in the order of the file."""
    lines = path.read_text(encoding="ascii").splitlines()
    start = 0
    while start < len(lines):
        step, count = int(lines[start + 1]), int(lines[start + 3])
        rows = lines[start + HEADER : start + HEADER + count]
        table = np.array([row.split() for row in rows], dtype=float).reshape(count, 11)
        table = table[np.argsort(table[:, 0], kind="stable")]
        yield SphereFrame(step, table[:, 0].astype(np.int64), table[:, 1], table[:, 2:5], table[:, 5:8], table[:, 8:11])
        start += HEADER + count


def final_frame(folder: Path) -> SphereFrame:
    """The last moment of a run in ``folder``; OSError if it wrote none."""
    return next(read_frames(folder / FINAL))


def motion(deck: Deck, frame: SphereFrame) -> BodyFrame:
    """Bodies behind the spheres of ``frame``: those that have entered by then, as far as their spheres are there."""
    places, turns, velocities, spins, first = [], [], [], [], 0
    for body in range(deck.bodies):
        local = deck.members(body)
        if first + len(local) > len(frame.id):
            break
        chosen = slice(first, first + len(local))
        turn, place = rigid_fit(local, frame.position[chosen])
        spin = frame.spin[first]
        arms = frame.position[chosen] - place
        places.append(place)
        turns.append(turn)
        spins.append(spin)
        velocities.append((frame.velocity[chosen] - np.cross(spin, arms)).mean(axis=0))
        first += len(local)
    rows = [np.array(values).reshape(len(places), -1) for values in (places, turns, velocities, spins)]
    return BodyFrame(rows[0], rows[1].reshape(-1, 3, 3), rows[2], rows[3])


def rigid_fit(local: Array, world: Array) -> tuple[Array, Array]:
    """Rotation and translation with ``world ≈ rotation · local + translation`` in least squares (Kabsch 1976)."""
    local_mean, world_mean = local.mean(axis=0), world.mean(axis=0)
    u, _, vt = np.linalg.svd((world - world_mean).T @ (local - local_mean))
    mirror = np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    turn = u @ mirror @ vt
    return turn, world_mean - turn @ local_mean
