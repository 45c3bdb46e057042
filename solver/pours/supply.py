"""What is fed into a pour: its bodies in order of entry, when each is due, and how those already in it entered."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from solver.engine.tables import body_tables
from solver.pours.record import Spheres
from solver.rigs.feed import Feed
from solver.scenes import insertion
from solver.scenes.scene import Scene, body_counts
from solver.scenes.sizes import drawn_sizes
from solver.shapes.clump import scaled

Array = npt.NDArray[np.float64]


class Entry(NamedTuple):
    """How a body entered."""

    time: float
    """[s]"""
    step: int
    """Steps done before."""
    pose: insertion.Pose
    velocity: Array
    """[m/s]"""


class Supply:
    """The bodies of one pour; the seed determines their order, sizes, orientations and places."""

    def __init__(self, scene: Scene, seed: int) -> None:
        self.random = np.random.default_rng(seed)
        self.order = insertion.shuffled_components(body_counts(scene), self.random)
        """Component of every body, (n,)."""
        self.layout = body_tables(
            scene, self.order, drawn_sizes([body.sizes for body in scene.bodies], self.order, seed)
        )
        self.entries: list[Entry] = []
        self._scene = scene
        self._due = insertion.entry_times(self.layout.numbers[:, 0], scene.insertion.rate) - scene.insertion.lead

    @property
    def entered(self) -> int:
        """Number of bodies that have entered."""
        return len(self.entries)

    @property
    def missing(self) -> int:
        """Number of bodies that have not yet entered."""
        return len(self.order) - len(self.entries)

    @property
    def mass(self) -> float:
        """Mass of all bodies [kg]."""
        return float(self.layout.numbers[:, 0].sum())

    @property
    def entered_mass(self) -> float:
        """Mass of the bodies that have entered [kg]."""
        return float(self.layout.numbers[: self.entered, 0].sum())

    @property
    def times(self) -> Array:
        """When the bodies entered [s], in order of entry."""
        return np.array([entry.time for entry in self.entries], dtype=float)

    @property
    def last_entry(self) -> float:
        """When the last body entered [s]; 0 before the first."""
        return self.entries[-1].time if self.entries else 0.0

    def due(self, time: float) -> bool:
        """Whether the next body may enter at ``time`` [s]."""
        return self.missing > 0 and bool(self._due[self.entered] <= time)

    def overdue(self, time: float, by: float) -> bool:
        """Whether the next body has been due, and has found no place, for more than ``by`` [s]."""
        return self.missing > 0 and bool(time > max(self._due[self.entered], self.last_entry) + by)

    def placed(self, feed: Feed, there: Spheres, time: float, step: int) -> Iterator[tuple[int, Entry]]:
        """Number and entry of each body that is due, in order, until one finds no place beside ``there``."""
        near = there.centre[:, 2] + there.radius > feed.floor
        centres, radii = there.centre[near], there.radius[near]
        velocity = np.array([0.0, 0.0, -self._scene.insertion.drop_speed])
        while self.due(time):
            b = self.entered
            clump = scaled(self._scene.bodies[self.order[b]].clump, self.layout.scale[b])
            pose = insertion.find_place(clump, self._scene.insertion, feed, centres, radii, self.random)
            if pose is None:
                return
            centres = np.concatenate([centres, pose.position + insertion.turned(clump.centres, pose.quaternion)])
            radii = np.concatenate([radii, clump.radii])
            self.entries.append(Entry(time, step, pose, velocity))
            yield b, self.entries[-1]
