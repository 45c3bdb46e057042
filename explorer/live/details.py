"""What frames do not carry: velocities, loads and contacts. Read about ten times a second, while they are shown."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from explorer.live.frames import MAX_BODIES, SlotReader, SlotWriter, shared_slots
from solver.pours.contacts import Contacts, coordination_numbers, loads
from solver.pours.record import Bodies

Floats = npt.NDArray[np.float32]
Ints = npt.NDArray[np.int32]

MAX_CONTACTS = 4096
"""Maximum number of contacts: those of the inspected body, then the strongest."""

SLOT = np.dtype(
    [
        ("generation", np.int64),
        ("time", np.float64),
        ("bodies", np.int64),
        ("mass", np.float32, (MAX_BODIES,)),
        ("velocity", np.float32, (MAX_BODIES, 3)),
        ("load", np.float32, (MAX_BODIES,)),
        ("neighbours", np.int32, (MAX_BODIES,)),
        ("entered", np.float32, (MAX_BODIES,)),
        ("touching", np.int64),
        ("mean_force", np.float64),
        ("contacts", np.int64),
        ("body", np.int32, (MAX_CONTACTS,)),
        ("partner", np.int32, (MAX_CONTACTS,)),
        ("point", np.float32, (MAX_CONTACTS, 3)),
        ("normal_force", np.float32, (MAX_CONTACTS,)),
        ("tangential_force", np.float32, (MAX_CONTACTS,)),
    ],
    align=True,
)
"""One moment in memory; only the first ``bodies`` rows and the first ``contacts`` contacts are filled."""


@dataclass(frozen=True)
class Details:
    """The n bodies that have entered, in order of entry, and m ≤ ``MAX_CONTACTS`` of their contacts."""

    number: int
    generation: int
    """Which pour of the session this is."""
    time: float
    """Simulated time [s]."""
    mass: Floats
    """[kg], shape (n,)."""
    velocity: Floats
    """[m/s], shape (n, 3)."""
    load: Floats
    """Σ |F_n| over the contacts of a body [N], shape (n,)."""
    neighbours: Ints
    """Coordination number: how many other bodies a body touches, shape (n,)."""
    entered: Floats
    """When the bodies entered [s], shape (n,)."""
    touching: int
    """Number of all contacts."""
    mean_force: float
    """Mean of |F_n| over all of them [N]; 0 where there is none."""
    body: Ints
    """One body of each contact, shape (m,)."""
    partner: Ints
    """The other body, or -1 - index of a surface of the rig, shape (m,)."""
    point: Floats
    """[m], shape (m, 3)."""
    normal_force: Floats
    """[N], positive where the two press on each other, shape (m,)."""
    tangential_force: Floats
    """[N], shape (m,)."""


def shared_details(context: Any) -> Any:
    """Shared memory for details, for a process that ``context`` (multiprocessing) starts."""
    return shared_slots(context, SLOT)


def detail_reader(block: Any) -> SlotReader[Details]:
    """The page's end of the block."""
    return SlotReader(block, SLOT, _copy)


class DetailWriter:
    """The solver's end of the block."""

    def __init__(self, block: Any) -> None:
        self._writer = SlotWriter(block, SLOT)

    def publish(
        self,
        generation: int,
        time: float,
        bodies: Bodies,
        entered: npt.NDArray[np.float64],
        contacts: Contacts,
        looked_at: int | None,
    ) -> None:
        """Write a moment: ``entered`` [s] are the bodies' times of entry, ``looked_at`` the inspected body, if any."""
        n, size = len(bodies.mass), np.abs(contacts.normal_force)
        chosen = most_wanted(contacts, looked_at)
        m = len(chosen)

        def fill(slot: Any) -> None:
            slot["generation"], slot["time"], slot["bodies"], slot["contacts"] = generation, time, n, m
            slot["mass"][0, :n], slot["velocity"][0, :n] = bodies.mass, bodies.velocity
            slot["load"][0, :n] = loads(contacts, n)
            slot["neighbours"][0, :n] = coordination_numbers(contacts, n)
            slot["entered"][0, :n] = entered
            slot["touching"], slot["mean_force"] = len(size), size.mean() if len(size) else 0.0
            slot["body"][0, :m], slot["partner"][0, :m] = contacts.body[chosen], contacts.partner[chosen]
            slot["point"][0, :m] = contacts.point[chosen]
            slot["normal_force"][0, :m] = contacts.normal_force[chosen]
            slot["tangential_force"][0, :m] = contacts.tangential_force[chosen]

        self._writer.publish(fill)


def most_wanted(contacts: Contacts, looked_at: int | None) -> npt.NDArray[np.int64]:
    """Up to ``MAX_CONTACTS`` indices: contacts of the body ``looked_at``, then the strongest, in order of force."""
    size = np.abs(contacts.normal_force)
    if looked_at is not None:
        size = np.where((contacts.body == looked_at) | (contacts.partner == looked_at), np.inf, size)
    return np.argsort(-size, kind="stable")[:MAX_CONTACTS]


def _copy(slot: Any, number: int) -> Details:
    n, m = int(slot["bodies"]), int(slot["contacts"])
    return Details(
        number=number,
        generation=int(slot["generation"]),
        time=float(slot["time"]),
        mass=slot["mass"][:n].copy(),
        velocity=slot["velocity"][:n].copy(),
        load=slot["load"][:n].copy(),
        neighbours=slot["neighbours"][:n].copy(),
        entered=slot["entered"][:n].copy(),
        touching=int(slot["touching"]),
        mean_force=float(slot["mean_force"]),
        body=slot["body"][:m].copy(),
        partner=slot["partner"][:m].copy(),
        point=slot["point"][:m].copy(),
        normal_force=slot["normal_force"][:m].copy(),
        tangential_force=slot["tangential_force"][:m].copy(),
    )
