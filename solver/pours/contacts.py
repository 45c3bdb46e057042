"""The contacts of a pour at one moment, and what they tell about its bodies. NumPy only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Contacts:
    """Touching member spheres of different bodies, and of bodies and surfaces (m of them)."""

    body: Ints
    """Index of the body in order of entry, shape (m,)."""
    partner: Ints
    """Index of the other body, or -1 - index of a surface of the rig, shape (m,)."""
    point: Array
    """Point of contact [m], shape (m, 3)."""
    normal: Array
    """Unit vector from the partner to the body, shape (m, 3)."""
    force: Array
    """Force on the body at the last step [N], shape (m, 3)."""

    @property
    def normal_force(self) -> Array:
        """Normal component of the force [N], shape (m,); negative where the two attract each other."""
        return np.einsum("ij,ij->i", self.force, self.normal)

    @property
    def tangential_force(self) -> Array:
        """Magnitude of the tangential component of the force [N], shape (m,)."""
        return np.linalg.norm(self.force - self.normal_force[:, None] * self.normal, axis=1)


def contacts_from(rows: Array) -> Contacts:
    """Contacts from the rows of ``Batch.contacts``."""
    return Contacts(rows[:, 0].astype(np.int64), rows[:, 1].astype(np.int64), rows[:, 2:5], rows[:, 5:8], rows[:, 8:11])


def loads(contacts: Contacts, bodies: int) -> Array:
    """Σ |F_n| over the contacts of each of ``bodies`` bodies, surfaces of the rig included [N], shape (bodies,)."""
    size = np.abs(contacts.normal_force)
    among = contacts.partner >= 0
    total: Array = np.bincount(contacts.body, size, minlength=bodies).astype(np.float64)
    return total + np.bincount(contacts.partner[among], size[among], minlength=bodies)


def coordination_numbers(contacts: Contacts, bodies: int) -> Ints:
    """Number of other bodies that each of ``bodies`` bodies touches, with however many spheres, shape (bodies,)."""
    among = contacts.partner >= 0
    pairs = np.unique(np.column_stack([contacts.body[among], contacts.partner[among]]), axis=0)
    return np.bincount(pairs.ravel(), minlength=bodies)
