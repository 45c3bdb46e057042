"""Made-up piles of known angle, and the bias of the estimators on them.

Geometry only, no simulation: a homogeneous cone, and seeds at random places and orientations that fill one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from solver.observables import OBSERVABLES, Value, observe_pile
from solver.pours.record import Pile, Spheres
from solver.scenes.insertion import random_quaternion, rotation_matrix

Array = npt.NDArray[np.float64]

SEED_AXES = np.array([27.92e-3, 11.18e-3, 6.11e-3])
"""Full axes of the ellipsoid that stands for a seed [m]."""
MEMBER = 1.0e-3
"""Radius of the spheres that a made-up surface is tiled with [m]."""
GRID = 0.8e-3
"""Spacing of the tiling spheres [m]; between them the surface is at most 0.16 mm lower."""


def pile_of(centre: Array, radius: Array, body: npt.NDArray[np.int32], component: list[int] | None = None) -> Pile:
    """Pile of bodies of equal mass whose centres of mass are the means of their spheres' centres."""
    count = np.bincount(body)
    position = np.stack([np.bincount(body, centre[:, k]) / count for k in range(3)], axis=1)
    parts = np.zeros(count.size, dtype=np.int32) if component is None else np.array(component, dtype=np.int32)
    names = tuple("abc"[: int(parts.max(initial=0)) + 1])
    return Pile(Spheres(centre, radius, body), position, np.full(count.size, 1e-4), parts, names)


def solid_of(height_at: Callable[[Array, Array], Array], half_width: float) -> Pile:
    """Pile that fills the space below z = ``height_at``(x, y) [m] homogeneously.

    One body per column of a grid: its mass is the column's, its centre of mass is half-way up, and its
    sphere lies inside and touches the surface's tangent plane.
    """
    n = int(np.ceil(half_width / GRID))
    axis = np.arange(-n, n + 1) * GRID
    x, y = np.meshgrid(axis, axis, indexing="ij")
    z = height_at(x, y)
    inside = z > 0.0
    step = 1e-7
    slope = np.hypot(height_at(x + step, y) - z, height_at(x, y + step) - z)[inside] / step
    x, y, z = x[inside], y[inside], z[inside]
    spheres = Spheres(
        np.stack([x, y, z - MEMBER * np.hypot(1.0, slope)], axis=1),
        np.full(z.size, MEMBER),
        np.arange(z.size, dtype=np.int32),
    )
    return Pile(spheres, np.stack([x, y, z / 2], axis=1), z, np.zeros(z.size, dtype=np.int32), ("a",))


def cone(angle_deg: float, height: float = 30e-3) -> Pile:
    """Homogeneous right cone."""
    slope = np.tan(np.radians(angle_deg))
    return solid_of(lambda x, y: height - slope * np.hypot(x, y), height / slope)


def seed_spheres() -> tuple[Array, Array]:
    """13 spheres inside the seed's ellipsoid: centres (13, 3) and radii (13,) [m]."""
    half = SEED_AXES / 2
    along = np.array([-0.86, -0.6, -0.3, 0.0, 0.3, 0.6, 0.86, -0.45, -0.15, 0.15, 0.45, 0.0, 0.0])
    across = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.4, -0.4, 0.4, -0.4, 0.5, -0.5])
    centre = np.stack([along * half[0], across * half[1], np.zeros(13)], axis=1)
    # Radius of the ellipsoid's half thickness there: the sphere touches near its top and its bottom.
    return centre, half[2] * np.sqrt(1.0 - along**2 - across**2)


def seeds_in_cone(angle_deg: float, n: int, rng: np.random.Generator, reach: float) -> Pile:
    """``n`` seeds at random places and orientations in a cone of their volume divided by a solid fraction of 0.45.

    ``reach`` is the scale at which a body, shrunk about its centre, must lie inside. 0: only its centre, so that
    mass is homogeneous and bodies stick out of the cone; 1: the whole body, so that nothing sticks out and mass
    is scarce below the surface. Geometry only: bodies may overlap, and parts below the plate are not seen.
    """
    solid_fraction = 0.45
    slope = np.tan(np.radians(angle_deg))
    volume = n * np.pi / 6 * SEED_AXES.prod() / solid_fraction
    base = (3 * volume / (np.pi * slope)) ** (1 / 3)
    height = base * slope
    local, radius = seed_spheres()
    # One member sphere is at the seed's centre: if it does not fit, no orientation does.
    middle = reach * float(radius[~local.any(axis=1)].max())
    found: list[Array] = []
    while len(found) < n:
        quaternion = random_quaternion(rng)
        x, y, z = place = np.append(rng.uniform(-base, base, 2), rng.uniform(0.0, height))
        if not middle <= z <= height - slope * np.hypot(x, y) - middle * np.hypot(1.0, slope):
            continue
        turn = rotation_matrix(quaternion)
        member = reach * local @ turn.T + place
        roof = height - slope * np.hypot(member[:, 0], member[:, 1]) - reach * radius * np.hypot(1.0, slope)
        if (member[:, 2] <= roof).all() and (member[:, 2] >= reach * radius).all():
            found.append(local @ turn.T + place)
    body = np.repeat(np.arange(n, dtype=np.int32), radius.size)
    return pile_of(np.concatenate(found), np.tile(radius, n), body)


REACHES = (0.0, 0.5, 1.0)
"""What "fills the cone" may mean: the centre of a body, half of it, or all of it lies inside."""


def estimator_bias(
    names: Sequence[str], angle_deg: float = 25.0, piles: int = 20, bodies: int = 80, seed: int = 0
) -> dict[str, tuple[tuple[float, float], ...]]:
    """Error of each estimator [°] on cones filled with seeds: (mean, standard error) for each of ``REACHES``.

    What "fills the cone" means is open and shifts the estimators by up to 20°: the three readings bound the bias, and
    none of them is the bias. There are ``piles`` cones of ``bodies`` seeds each. Names other than angles of repose are
    left out, as a made-up cone says nothing about them.
    """
    angles = tuple(name for name in names if name.startswith("angle_of_repose"))
    found: dict[str, list[tuple[float, float]]] = {name: [] for name in angles}
    for seen in _readings(angles, angle_deg, piles, bodies, seed):
        for name in angles:
            errors = np.array([values[name].value for values in seen]) - angle_deg
            spread = np.nanstd(errors, ddof=1) / np.sqrt(np.count_nonzero(~np.isnan(errors)))
            found[name].append((float(np.nanmean(errors)), float(spread)))
    return {name: tuple(readings) for name, readings in found.items()}


@lru_cache(maxsize=4)
def _readings(
    names: tuple[str, ...], angle_deg: float, piles: int, bodies: int, seed: int
) -> tuple[tuple[Mapping[str, Value], ...], ...]:
    """Readings of the cones of `estimator_bias`, for each of ``REACHES``; the same for every study."""
    found = []
    for reach in REACHES:
        rng = np.random.default_rng(seed)
        cones = (seeds_in_cone(angle_deg, bodies, rng, reach) for _ in range(piles))
        found.append(tuple(observe_pile(cone, [OBSERVABLES[name] for name in names]) for cone in cones))
    return tuple(found)
