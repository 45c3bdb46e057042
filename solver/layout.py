"""Bodies of one world as flat tables: the form in which the arrays of a batch take them."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from solver.scene import Scene

Array = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int32]


@dataclass(frozen=True)
class Layout:
    """Bodies of one world in order of entry, as the arrays want them (n bodies, m member spheres)."""

    numbers: Array
    """mass, inertia (3), reach; shape (n, 5)."""
    places: Ints
    """first member, number of members, contact class; shape (n, 3)."""
    spheres: Array
    """local centre (3) and radius; shape (m, 4)."""
    owner: Ints
    """Body of each member; shape (m, 1)."""


def layout(scene: Scene, order: Ints) -> Layout:
    """Arrange bodies of the components in ``order`` (index into ``scene.bodies``, in order of entry)."""
    clumps = [body.clump for body in scene.bodies]
    sizes = np.array([len(clumps[k].radii) for k in order], dtype=np.int32)
    first = np.concatenate([[0], np.cumsum(sizes)[:-1]]).astype(np.int32)
    numbers = np.array([[clumps[k].mass, *clumps[k].inertia, clumps[k].bounding_radius] for k in order])
    spheres = np.concatenate([np.column_stack([clumps[k].centres, clumps[k].radii]) for k in order])
    owner = np.repeat(np.arange(len(order), dtype=np.int32), sizes)[:, None]
    places = np.column_stack([first, sizes, order]).astype(np.int32)
    return Layout(numbers, places, np.ascontiguousarray(spheres), np.ascontiguousarray(owner))
