"""What changes in one world as plain arrays, to save and restore: a run continued from a snapshot gives the same bits.

A snapshot is not tied to a slot: it can be put into any slot of a batch with room for it, once the same scene has been
loaded there.
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from solver.backend import ti
from solver.engine import moving_state
from solver.engine.moving_state import GROUPS, Moving
from solver.engine.state import WORLD

Arrays = dict[str, npt.NDArray[Any]]

MEMORY = "memory.number"
"""What effects keep of each contact, where they are compiled in."""
NAMES = (
    *(f"world.{name}" for name in WORLD),
    *(f"{group}.{name}" for group, table in GROUPS.items() for name in table),
)
"""Arrays of every snapshot."""


def take(state: Any, w: int) -> Arrays:
    """Arrays of world ``w``, truncated to the entries in use: ``"body.position"`` has shape (bodies, 3)."""
    last = int(state.world.loaded[w]) - 1
    members = int(state.body.first[w, last] + state.body.members[w, last])
    kept = moving_state.take(state, w, last + 1, members)
    once = _split(kept.world[None], WORLD, moving_state.world_fields(state))
    found = {f"world.{name}": array[0] for name, array in once}
    parts = moving_state.sections(state, kept.world, kept.bodies, kept.members)
    for part in parts:
        for name, array in _split(part.table(kept.row), GROUPS[part.group], part.fields):
            found[f"{part.group}.{name}"] = array
    if state.effects:
        found[MEMORY] = kept.row[parts[-1].end :].reshape(len(found["contact.i"]), state.memory.number.shape[2])
    # Surfaces are numbered from the members' capacity on; make the numbers independent of it.
    partner, room = found["contact.j"], state.member.body.shape[1]
    found["contact.j"] = np.where(partner >= room, room - 1 - partner, partner)
    return found


def put(state: Any, w: int, arrays: Arrays) -> None:
    """Replace world ``w``, which has been loaded with the same scene, by the arrays that :func:`take` returned.

    Raises ValueError if the batch has no room for it.
    """
    partner, room = arrays["contact.j"], state.member.body.shape[1]
    arrays = arrays | {"contact.j": np.where(partner < 0, room - 1 - partner, partner)}
    world = np.concatenate([np.ravel(arrays[f"world.{name}"]) for name in WORLD]).astype(float)
    parts = []
    for group, table in GROUPS.items():
        entries, fields = len(arrays[f"{group}.{table[0]}"]), moving_state.group_fields(state, group)
        if entries > (fits := fields[0].shape[1]):
            raise ValueError(f"{group}: {entries} entries do not fit into {fits}")
        columns = [
            arrays[f"{group}.{name}"].reshape(entries, moving_state.columns_of(field))
            for name, field in zip(table, fields, strict=True)
        ]
        parts.append(np.hstack(columns).ravel())
    if MEMORY in arrays:
        parts.append(arrays[MEMORY].ravel())
    bodies, members = len(arrays["body.position"]), len(arrays["member.centre"])
    moving_state.put(state, w, Moving(bodies, members, world, np.concatenate(parts).astype(float), MEMORY in arrays))


def _split(table: npt.NDArray[np.float64], names: Iterable[str], fields: Sequence[Any]) -> Iterator[tuple[str, Any]]:
    """Every field's name and array, of the shape and the type that the field has."""
    first = 0
    for name, field in zip(names, fields, strict=True):
        columns, dtype = moving_state.columns_of(field), np.int32 if field.dtype == ti.i32 else np.float64
        shape = [size for size in (getattr(field, "n", 1), getattr(field, "m", 1)) if size > 1]
        yield name, table[:, first : first + columns].astype(dtype).reshape(len(table), *shape)
        first += columns
