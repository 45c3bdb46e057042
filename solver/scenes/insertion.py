"""Insertion: when and where bodies enter. A body is placed only where it fits; if the inlet is full it waits.

Bodies start above the feed opening of the rig (``rigs/feed.py``), entirely within its outline, at a constant mass rate,
with uniformly random orientation and a downward speed, to which the fall to the opening adds (1.1 m/s over 60 mm).
Order, orientations and places come from one NumPy generator per run, so a seed repeats a run.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from solver.params import param
from solver.rigs.feed import Feed
from solver.shapes.clump import Clump

Array = npt.NDArray[np.float64]

PROTOCOLS = ("pour_through", "fill_then_open")
TRIES = 40
"""Number of random places that are tried for one body before it waits for the next moment of decision."""


@dataclass(frozen=True)
class Insertion:
    """How material is fed."""

    protocol: str = param(
        "pour_through",
        doc="pour_through: the outlet is open from the start; fill_then_open: fill, settle, then open, lift or turn.",
        choices=PROTOCOLS,
    )
    rate: float = param(0.020, unit="kg/s", low=1e-4, high=10.0, doc="Mass fed per second.")
    lead: float = param(
        0.0,
        unit="s",
        low=0.0,
        high=1.0,
        doc="How long before it is due a body may enter. At numerics.sample_interval each batch is filled for the "
        "interval ahead.",
    )
    drop_speed: float = param(0.5, unit="m/s", low=0.0, high=10.0, doc="Downward speed of a body where it enters.")
    region_radius: float = param(0.045, unit="m", low=0.002, high=1.0, doc="Radius of the region where bodies enter.")
    region_height: float = param(
        0.060,
        unit="m",
        low=0.002,
        high=1.0,
        doc="Height of the region where bodies enter; longer bodies stick out of its top.",
    )


@dataclass(frozen=True)
class Pose:
    """Centre of mass [m] and orientation (unit quaternion wxyz) of a body."""

    position: Array
    quaternion: Array


def shuffled_components(counts: tuple[int, ...], rng: np.random.Generator) -> npt.NDArray[np.int32]:
    """Component index of every body in order of entry: the given counts, shuffled."""
    order = np.repeat(np.arange(len(counts), dtype=np.int32), counts)
    rng.shuffle(order)
    return order


def entry_times(masses: Array, rate: float) -> Array:
    """Times [s] at which bodies are due: the k-th when the mass of those before it has been fed at ``rate`` [kg/s]."""
    return np.concatenate([[0.0], np.cumsum(masses)[:-1]]) / rate


def find_place(
    clump: Clump,
    insertion: Insertion,
    feed: Feed,
    occupied_centres: Array,
    occupied_radii: Array,
    rng: np.random.Generator,
) -> Pose | None:
    """A random pose above the opening of ``feed`` that touches nothing, or None.

    The orientation is drawn once, and places are tried for it, so that orientations that are harder to place are hardly
    rarer. Only one for which no place is found is drawn anew when the body is next tried: long bodies in a rig that is
    hardly wider then enter somewhat more upright (petioles of 58 mm in a cylinder of 60 mm: mean |cos| to the vertical
    0.56 in place of 0.5; in the default funnel no body, in the default cylinder one of 763 is drawn anew).
    ``occupied_centres`` (n, 3) and ``occupied_radii`` (n,) are the member spheres already there [m].
    """
    quaternion = random_quaternion(rng)
    offsets = turned(clump.centres, quaternion)
    lowest, highest = (offsets[:, 2] - clump.radii).min(), (offsets[:, 2] + clump.radii).max()
    height = min(insertion.region_height, feed.ceiling - feed.floor)
    spare = max(0.0, height - (highest - lowest))
    for _ in range(TRIES):
        x, y = feed.draw(insertion.region_radius, rng)
        position = np.array([x, y, feed.floor - lowest + rng.uniform() * spare])
        centres = position + offsets
        inside = feed.holds(centres, clump.radii, insertion.region_radius)
        if inside and _clear(centres, clump.radii, occupied_centres, occupied_radii):
            return Pose(position, quaternion)
    return None


def random_quaternion(rng: np.random.Generator) -> Array:
    """Uniformly distributed orientation, wxyz (Marsaglia 1972: a normalised 4-D Gaussian)."""
    q = rng.normal(size=4)
    return q / np.linalg.norm(q)


def turned(points: Array, quaternion: Array) -> Array:
    """``points`` (n, 3) turned about the origin by a unit quaternion wxyz."""
    return points @ rotation_matrix(quaternion).T


def rotation_matrix(quaternion: Array) -> Array:
    """Rotation matrix (…, 3, 3) of unit quaternions wxyz (…, 4)."""
    w, x, y, z = np.moveaxis(np.asarray(quaternion, dtype=float), -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array([[np.asarray(c) for c in row] for row in rows]), (0, 1), (-2, -1))


def _clear(centres: Array, radii: Array, others: Array, other_radii: Array) -> bool:
    if len(others) == 0:
        return True
    distance = np.linalg.norm(centres[:, None, :] - others[None, :, :], axis=2)
    return bool((distance > radii[:, None] + other_radii[None, :]).all())
