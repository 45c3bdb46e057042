"""A pour at given moments: what a viewer of particles needs to see of it, in the solver's terms."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from explorer.errors import CommandError
from solver import Bodies, Job, Record, Scene, Spheres, run_queue, value
from solver.contacts import Contacts
from solver.pour import Pour
from solver.record_builder import member_spheres

MOST = 2000
"""Moments of one pour that are kept in memory."""

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Moment:
    """Bodies, their member spheres and contacts at one time, and where the rig's surfaces are then."""

    time: float
    """[s]."""
    bodies: Bodies
    spheres: Spheres
    contacts: Contacts
    poses: Array
    """Of the surfaces: origin [m] and orientation wxyz, shape (k, 7)."""
    gate_shut: bool
    """Whether the rig is still being filled."""


def moments(scene: Scene, seed: int, every: float | None) -> tuple[tuple[Moment, ...], Record]:
    """Run a pour to its end: a moment each ``every`` s (to the next sample of its curves), and the last one.

    Only the last one for None. Raises CommandError for more than ``MOST`` moments.
    """
    if every is not None and value(scene, "numerics.max_time") > MOST * every:
        raise CommandError(
            f"--every {every:g}: more than {MOST} moments of a pour of up to {scene.numerics.max_time:g} s"
        )
    found: list[Moment] = []
    last: list[Moment] = []

    def look(_: Job, pour: Pour) -> None:
        due = every is not None and pour.time >= len(found) * every - 1e-9
        over = pour.steps_due() == 0
        if due or over:
            moment = _moment(pour)
            (found if due else last).append(moment)

    ((_, record),) = run_queue(deque([Job(scene, seed)]), [scene], threads=1, worlds=1, on_sample=look)
    return (*found, *last), record


def _moment(pour: Pour) -> Moment:
    bodies = pour.bodies()
    spheres = member_spheres(pour.scene, bodies)
    return Moment(pour.time, bodies, spheres, pour.contacts(), pour.surface_poses().copy(), pour.gate_shut)
