"""What changes in a running world, as one row of numbers; ``solver/engine/snapshot.py`` gives it names.

A row can be restored only to the slot from which it was taken, in a batch of the same capacity; what is loaded once and
never changes (masses, shapes, surfaces) is not in it. Integers of 32 bits are exact in double precision.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from solver.effects.columns import HERTZ
from solver.engine.kernels import transfer
from solver.engine.state import BODY, CONTACT, MEMBER, WALL, WORLD

Array = npt.NDArray[np.float64]

LOADED_ONCE = frozenset(
    (
        *("mass", "inertia", "inverse_mass", "inverse_inertia", "reach", "semi_axes", "diameter", "drag_factors"),
        *("swing", "first", "members", "kind", "local", "radius", "body"),
    )
)
"""Fields of bodies and members that are written only when a scene is loaded."""
SCRATCH = frozenset(("near", "next"))
"""Fields of bodies that the list build fills before it reads them."""
GROUPS = {
    "body": tuple(name for name in BODY if name not in LOADED_ONCE | SCRATCH),
    "member": tuple(name for name in MEMBER if name not in LOADED_ONCE),
    "contact": tuple(CONTACT),
    "wall": tuple(WALL),
    "candidate": ("triangle",),
}
"""Groups of a row, each with its fields, in their order."""


@dataclass(frozen=True)
class Moving:
    """Changing state of one world at one time."""

    bodies: int
    """Bodies that will enter."""
    members: int
    """Their member spheres."""
    world: Array
    """Fields that exist once per world."""
    row: Array
    """The groups of ``GROUPS``, and the effects' memory of contacts if ``effects``."""
    effects: bool

    @property
    def nbytes(self) -> int:
        """Memory that it takes [B]."""
        return int(self.world.nbytes + self.row.nbytes)


@dataclass(frozen=True)
class Section:
    """The part of a row that holds one group, entry by entry."""

    group: str
    fields: tuple[Any, ...]
    entries: int
    first: int

    @property
    def width(self) -> int:
        """Columns per entry."""
        return _width(self.fields)

    @property
    def end(self) -> int:
        """Index behind the section."""
        return self.first + self.entries * self.width

    def table(self, row: Array) -> Array:
        """Its part of ``row``, shape (entries, width)."""
        return row[self.first : self.end].reshape(self.entries, self.width)


def take(state: Any, w: int, bodies: int, members: int) -> Moving:
    """Changing state of world ``w``, for which ``bodies`` bodies with ``members`` spheres in total have been loaded."""
    once = world_fields(state)
    world = np.empty(_width(once))
    transfer.pack_world(once, w, world)
    parts = sections(state, world, bodies, members)
    contacts, end = _contacts(parts).entries, parts[-1].end
    columns = state.memory.number.shape[2] if state.effects else 0
    row = np.empty(end + contacts * columns)
    for part in parts:
        transfer.pack(part.fields, w, part.entries, part.width, part.first, row)
    if state.effects:
        transfer.pack_memory(state.memory.number, w, contacts, end, row)
    return Moving(bodies, members, world, row, bool(state.effects))


def put(state: Any, w: int, kept: Moving) -> None:
    """Restore world ``w`` to the state that :func:`take` saved."""
    transfer.unpack_world(world_fields(state), w, kept.world)
    parts = sections(state, kept.world, kept.bodies, kept.members)
    for part in parts:
        transfer.unpack(part.fields, w, part.entries, part.width, part.first, kept.row)
    if state.effects:
        contacts, end = _contacts(parts), parts[-1].end
        row = kept.row if kept.effects else np.append(kept.row, _memory_without_effects(state, kept.row, contacts))
        transfer.unpack_memory(state.memory.number, w, contacts.entries, end, row)
    if state.sharing:
        # The list build determines which entries belong to one pair.
        state.world.outdated[w] = 1


def sections(state: Any, world: Array, bodies: int, members: int) -> list[Section]:
    """Sections of a row, in the order of ``GROUPS``; ``world`` contains how many contacts, walls … are in use."""
    used = (int(world[_world_column(state, name)]) for name in ("contacts", "walls", "candidates"))
    parts, first = [], 0
    for group, entries in zip(GROUPS, (bodies, members, *used), strict=True):
        part = Section(group, group_fields(state, group), entries, first)
        parts.append(part)
        first = part.end
    return parts


@cache  # Kernels are compiled anew for every tuple, so each tuple is made once; the arrays of a batch are never freed.
def world_fields(state: Any) -> tuple[Any, ...]:
    """Fields that exist once per world, in the order of ``WORLD``."""
    return tuple(getattr(state.world, name) for name in WORLD)


@cache
def group_fields(state: Any, group: str) -> tuple[Any, ...]:
    """Fields of a group of ``GROUPS``."""
    return tuple(getattr(getattr(state, group), name) for name in GROUPS[group])


def columns_of(field: Any) -> int:
    """Number of columns that one entry of ``field`` takes."""
    return int(getattr(field, "n", 1) * getattr(field, "m", 1))


def _contacts(parts: list[Section]) -> Section:
    return parts[list(GROUPS).index("contact")]


def _memory_without_effects(state: Any, row: Array, contacts: Section) -> Array:
    """Effects' memory of contacts saved without effects: zero except for the contact radii, which are Hertz's."""
    before = GROUPS["contact"].index("radius")
    memory = np.zeros((contacts.entries, state.memory.number.shape[2]))
    memory[:, HERTZ] = contacts.table(row)[:, _width(contacts.fields[:before])]
    return memory.ravel()


def _world_column(state: Any, name: str) -> int:
    return _width(world_fields(state)[: tuple(WORLD).index(name)])


def _width(fields: tuple[Any, ...]) -> int:
    """Number of columns that one entry of ``fields`` takes."""
    return sum(map(columns_of, fields))
