"""The live parameters as they were, one entry per change: what undo and redo go along.

The solver's word counts: an entry is what it has in force, whoever asked for it. What undo and redo ask for comes back
as such a change too, and is recognised by its values.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from explorer.errors import CommandError
from solver.scenes.scene import Scene, parameters, values

LiveValues = Mapping[str, Any]
"""Path → value in SI, of all live parameters."""

MOST_ENTRIES = 200
MERGED = 1.0
"""Changes of the same parameters that follow one another within this wall time [s] are one entry: a slider's drag."""


class ParameterHistory:
    """Entries of one session; a scene with other live parameters begins anew."""

    def __init__(self) -> None:
        self._entries: list[LiveValues] = []
        self._at = self._goal = 0
        self._scene: Scene | None = None
        self._changed: frozenset[str] = frozenset()
        self._changed_at = 0.0

    @property
    def undoable(self) -> int:
        """How many changes can be undone."""
        return self._goal

    @property
    def redoable(self) -> int:
        """How many can be redone."""
        return len(self._entries) - 1 - self._goal if self._entries else 0

    def take(self, scene: Scene, wall: float) -> None:
        """Take note of the scene in force at the moment ``wall`` [s] of any steady clock."""
        if scene == self._scene:
            return
        self._scene = scene
        now = live_values(scene)
        if not self._entries or now.keys() != self._entries[0].keys():
            self._entries, self._at, self._goal = [now], 0, 0
            self._changed = frozenset()
        elif now != self._entries[self._at]:
            self._step(now, wall)

    def undo(self) -> LiveValues:
        """Values to be set so that the last change is undone; raises CommandError where there is none."""
        if self.undoable == 0:
            raise CommandError("nothing to undo: no live parameter was changed")
        return self._towards(self._goal - 1)

    def redo(self) -> LiveValues:
        """Values to be set so that the change that was undone last is made again; raises CommandError."""
        if self.redoable == 0:
            raise CommandError("nothing to redo")
        return self._towards(self._goal + 1)

    def stay(self) -> None:
        """The solver was not asked after all: where undo and redo stand is where the parameters are."""
        self._goal = self._at

    def _towards(self, goal: int) -> LiveValues:
        now, self._goal = self._entries[self._goal], goal
        self._changed = frozenset()  # what comes next is a change of its own
        return {path: wanted for path, wanted in self._entries[goal].items() if wanted != now[path]}

    def _step(self, now: LiveValues, wall: float) -> None:
        on_the_way = range(min(self._at, self._goal), max(self._at, self._goal) + 1)
        reached = next((k for k in on_the_way if self._entries[k] == now), None)
        if reached is not None:
            self._at = reached
            return
        before = self._entries[self._at]
        changed = frozenset(path for path in now if now[path] != before[path])
        merged = changed == self._changed and wall <= self._changed_at + MERGED and self._at > 0
        kept = self._entries[: self._at if merged else self._at + 1]
        self._entries = [*kept, now][-MOST_ENTRIES:]
        self._at = self._goal = len(self._entries) - 1
        self._changed, self._changed_at = changed, wall


def live_values(scene: Scene) -> LiveValues:
    """Values of all live parameters of ``scene``."""
    declared = parameters(scene)
    return {path: number for path, number in values(scene).items() if declared[path].live}
