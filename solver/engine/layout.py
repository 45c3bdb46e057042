"""Bodies of one world as flat tables: the form in which the arrays of a batch take them."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from solver.scenes.body import Body
from solver.scenes.scene import Scene

Array = npt.NDArray[np.float64]

Ints = npt.NDArray[np.int32]


@dataclass(frozen=True)
class Layout:
    """Bodies of one world in order of entry, as the arrays want them (n bodies, m member spheres)."""

    numbers: Array
    """mass, inertia (3), reach, semi-axes (3), diameter at equal volume, sphericity; shape (n, 10)."""
    places: Ints
    """first member, number of members, contact class; shape (n, 3)."""
    spheres: Array
    """local centre (3) and radius; shape (m, 4)."""
    owner: Ints
    """Body of each member; shape (m, 1)."""
    scale: Array
    """Linear size of each body relative to the declared one; shape (n,)."""


def layout(scene: Scene, order: Ints, scale: Array | None = None) -> Layout:
    """Arrange bodies of the components in ``order`` (index into ``scene.bodies``, in order of entry).

    ``scale`` (n,) is the linear size s of each body, by default 1: spheres and reach go with s, mass with s³, inertia
    with s⁵.
    """
    scale = np.ones(len(order)) if scale is None else scale
    clumps = [body.clump for body in scene.bodies]
    sizes = np.array([len(clumps[k].radii) for k in order], dtype=np.int32)
    first = np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.int32)
    each = [
        [clump.mass, *clump.inertia, clump.bounding_radius, *outline(body)]
        for clump, body in zip(clumps, scene.bodies, strict=True)
    ]
    numbers = np.array([each[k] for k in order])
    numbers *= scale[:, None] ** np.array([3, 5, 5, 5, 1, 1, 1, 1, 1, 0])
    spheres = np.concatenate([np.column_stack([clumps[k].centres, clumps[k].radii]) for k in order])
    spheres *= np.repeat(scale, sizes)[:, None]
    owner = np.repeat(np.arange(len(order), dtype=np.int32), sizes)[:, None]
    places = np.column_stack([first, sizes, order]).astype(np.int32)
    return Layout(numbers, places, np.ascontiguousarray(spheres), np.ascontiguousarray(owner), scale)


def outline(body: Body) -> tuple[float, ...]:
    """What the air meets: semi-axes (3) [m], diameter of the sphere of the same volume [m], sphericity.

    The surface is that of the ellipsoid with the body's outer dimensions, within 1.1 % (K. Thomsen 2004):
    4π (((ab)ᵖ + (ac)ᵖ + (bc)ᵖ)/3)^(1/p), p = 1.6075.
    """
    a, b, c = (extent / 2.0 for extent in body.extents)
    diameter = (6.0 * body.mass / (math.pi * body.density)) ** (1.0 / 3.0)
    p = 1.6075
    surface = 4.0 * math.pi * (((a * b) ** p + (a * c) ** p + (b * c) ** p) / 3.0) ** (1.0 / p)
    return a, b, c, diameter, min(1.0, math.pi * diameter**2 / surface)
