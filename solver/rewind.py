"""A pour brought back to an earlier moment of its own, in the same batch: from there it repeats the same bits.

Quicker than a checkpoint (``solver/checkpoint.py``), which can be kept in a file and go on elsewhere.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from solver.checkpoint import PLAIN
from solver.moving_state import Moving
from solver.pour import Pour
from solver.scene import Scene

DECIDED = (*(name for name in PLAIN if name != "samples"), "ended", "outcome", "message", "_table", "_ramp", "_inside")
"""What a pour has decided, in values that it replaces and never changes."""


@dataclass(frozen=True)
class Kept:
    """One moment of a pour."""

    time: float
    """[s]"""
    scene: Scene
    """With the parameters that were in force."""
    decided: Mapping[str, Any]
    lengths: tuple[int, ...]
    to_do: tuple[Any, ...]
    random: Mapping[str, Any]
    world: Moving

    @property
    def nbytes(self) -> int:
        """Memory that it takes [B], but for a few hundred."""
        return self.world.nbytes


def growing(pour: Pour) -> tuple[list[Any], ...]:
    """Lists that only grow, so that their length is enough to have them as they were."""
    return pour.samples, pour.supply.entries, pour._free_surface


def keep(pour: Pour) -> Kept:
    """The present moment of ``pour``, between two launches."""
    places = pour.supply.layout
    return Kept(
        time=pour.time,
        scene=pour.scene,
        decided={name: getattr(pour, name) for name in DECIDED},
        lengths=tuple(map(len, growing(pour))),
        to_do=tuple(pour._to_do),
        random=pour.supply.random.bit_generator.state,
        world=pour.batch.take_moving(pour.w, len(places.numbers), len(places.spheres)),
    )


def put_back(pour: Pour, kept: Kept) -> None:
    """Bring ``pour`` back to ``kept``, one of its earlier moments; what came after is forgotten."""
    for name, found in kept.decided.items():
        setattr(pour, name, found)
    for rows, length in zip(growing(pour), kept.lengths, strict=True):
        del rows[length:]
    pour.scene = kept.scene
    pour._to_do = list(kept.to_do)
    pour.supply.random.bit_generator.state = kept.random
    # These two wake every body; what follows puts the sleepers back to sleep.
    pour.batch.set_law(pour.w, pour._table)
    pour.batch.set_effects(pour.w, kept.scene)
    pour.batch.put_moving(pour.w, kept.world)
