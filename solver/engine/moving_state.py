"""What changes in a running world, as one row of numbers: a faster alternative to ``solver/engine/snapshot.py``.

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
    """Bodies, members, contacts, walls, candidates, and the effects' memory of contacts if ``effects``."""
    effects: bool

    @property
    def nbytes(self) -> int:
        """Memory that it takes [B]."""
        return int(self.world.nbytes + self.row.nbytes)


@dataclass(frozen=True)
class _Section:
    fields: tuple[Any, ...]
    entries: int
    width: int
    first: int

    @property
    def end(self) -> int:
        return self.first + self.entries * self.width


def take(state: Any, w: int, bodies: int, members: int) -> Moving:
    """Changing state of world ``w``, for which ``bodies`` bodies with ``members`` spheres in total have been loaded."""
    once = _world_fields(state)
    world = np.empty(_width(once))
    transfer.pack_world(once, w, world)
    sections = _sections(state, world, bodies, members)
    contacts, end = sections[2].entries, sections[-1].end
    columns = state.memory.number.shape[2] if state.effects else 0
    row = np.empty(end + contacts * columns)
    for section in sections:
        transfer.pack(section.fields, w, section.entries, section.width, section.first, row)
    if state.effects:
        transfer.pack_memory(state.memory.number, w, contacts, end, row)
    return Moving(bodies, members, world, row, bool(state.effects))


def put(state: Any, w: int, kept: Moving) -> None:
    """Restore world ``w`` to the state that :func:`take` saved."""
    transfer.unpack_world(_world_fields(state), w, kept.world)
    sections = _sections(state, kept.world, kept.bodies, kept.members)
    for section in sections:
        transfer.unpack(section.fields, w, section.entries, section.width, section.first, kept.row)
    if state.effects:
        contacts, end = sections[2].entries, sections[-1].end
        row = kept.row if kept.effects else np.append(kept.row, _memory_without_effects(state, kept.row, sections[2]))
        transfer.unpack_memory(state.memory.number, w, contacts, end, row)
    if state.sharing:
        # The list build determines which entries belong to one pair.
        state.world.outdated[w] = 1


def _memory_without_effects(state: Any, row: Array, contacts: _Section) -> Array:
    """Effects' memory of contacts saved without effects: zero except for the contact radii, which are Hertz's."""
    table = row[contacts.first : contacts.end].reshape(contacts.entries, contacts.width)
    before = tuple(CONTACT)[: tuple(CONTACT).index("radius")]
    memory = np.zeros((contacts.entries, state.memory.number.shape[2]))
    memory[:, HERTZ] = table[:, _width(tuple(getattr(state.contact, name) for name in before))]
    return memory.ravel()


@cache  # Kernels are compiled anew for every tuple, so each tuple is made once; the arrays of a batch are never freed.
def _world_fields(state: Any) -> tuple[Any, ...]:
    return tuple(getattr(state.world, name) for name in WORLD)


def _sections(state: Any, world: Array, bodies: int, members: int) -> list[_Section]:
    """Bodies, members, contacts, walls and candidates, in this order; ``world`` contains how many are in use."""
    contacts, walls, candidates = (
        int(world[_world_column(state, name)]) for name in ("contacts", "walls", "candidates")
    )
    sections, first = [], 0
    for fields, entries in zip(_groups(state), (bodies, members, contacts, walls, candidates), strict=True):
        section = _Section(fields, entries, _width(fields), first)
        sections.append(section)
        first = section.end
    return sections


@cache
def _groups(state: Any) -> tuple[tuple[Any, ...], ...]:
    return (
        _moving_fields(state.body, BODY),
        _moving_fields(state.member, MEMBER),
        tuple(getattr(state.contact, name) for name in CONTACT),
        tuple(getattr(state.wall, name) for name in WALL),
        (state.candidate.triangle,),
    )


def _moving_fields(group: Any, table: dict[str, Any]) -> tuple[Any, ...]:
    return tuple(getattr(group, name) for name in table if name not in LOADED_ONCE | SCRATCH)


def _world_column(state: Any, name: str) -> int:
    before = tuple(WORLD)[: tuple(WORLD).index(name)]
    return _width(tuple(getattr(state.world, name) for name in before))


def _width(fields: tuple[Any, ...]) -> int:
    """Number of columns that one entry of ``fields`` takes."""
    return sum(getattr(field, "n", 1) * getattr(field, "m", 1) for field in fields)
