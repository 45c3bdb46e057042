"""One world as plain arrays, to save and restore: a run continued from a snapshot gives the same bits.

A snapshot is not tied to a slot: it can be put into any slot of a batch with room for it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from solver.effects.columns import HERTZ
from solver.engine.state import BODY, CONTACT, MEMBER, WALL, WORLD

Arrays = dict[str, npt.NDArray[Any]]

TABLES = {"world": WORLD, "body": BODY, "member": MEMBER, "contact": CONTACT, "wall": WALL}
"""Groups that a snapshot contains; what is not listed follows from the scene and is loaded from it."""


def take(state: Any, w: int) -> Arrays:
    """Arrays of world ``w``, truncated to the entries in use: ``"body.position"`` has shape (bodies, 3)."""
    used = _used(state, w)
    found: Arrays = {}
    for group, table in TABLES.items():
        for name in table:
            row = getattr(getattr(state, group), name).to_numpy()[w]
            found[f"{group}.{name}"] = row if group == "world" else row[: used[group]].copy()
    if state.effects:
        found["memory.number"] = state.memory.number.to_numpy()[w][: used["contact"]].copy()
    found["candidate.triangle"] = state.candidate.triangle.to_numpy()[w][: used["candidate"]].copy()
    # Surfaces are numbered from the members' capacity on; make the numbers independent of it.
    partner, room = found["contact.j"], state.member.body.shape[1]
    found["contact.j"] = np.where(partner >= room, room - 1 - partner, partner)
    return found


def put(state: Any, w: int, arrays: Arrays) -> None:
    """Replace world ``w``, which has been loaded with the same scene, by the arrays that :func:`take` returned.

    Raises ValueError if the batch has no room for it.
    """
    room = state.member.body.shape[1]
    if state.effects and "memory.number" not in arrays:
        # From a batch without effects: there is no memory of its contacts yet, and contact radii are Hertz's.
        memory = np.zeros((len(arrays["contact.radius"]), state.memory.number.shape[2]))
        memory[:, HERTZ] = arrays["contact.radius"]
        arrays = arrays | {"memory.number": memory}
    for key, kept in arrays.items():
        group, name = key.split(".")
        if group == "memory" and not state.effects:
            continue
        field = getattr(getattr(state, group), name)
        whole = field.to_numpy()
        if group == "world":
            whole[w] = kept
        elif len(kept) > whole.shape[1]:
            raise ValueError(f"{key}: {len(kept)} entries do not fit into {whole.shape[1]}")
        else:
            whole[w, : len(kept)] = np.where(kept < 0, room - 1 - kept, kept) if key == "contact.j" else kept
        field.from_numpy(whole)
    if state.sharing:
        # The list build determines which entries belong to one pair.
        state.world.outdated[w] = 1


def _used(state: Any, w: int) -> dict[str, int]:
    """Entries in use of each group of world ``w``."""
    world = state.world
    members = state.body.first.to_numpy()[w] + state.body.members.to_numpy()[w]
    bodies = int(world.loaded[w])
    return {
        "body": bodies,
        "member": int(members[:bodies].max()),
        "contact": int(world.contacts[w]),
        "wall": int(world.walls[w]),
        "candidate": int(world.candidates[w]),
    }
