"""What people asked for beside parameters, as events that every browser sees: another pour, a study, a diagnosis."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Protocol

from explorer.background.command_process import CommandStatus
from explorer.live.messages import Event, Status

ASKED_FOR = ("running", "paused", "cancelled")
"""States of a command that somebody's hand brings about; it ends in the others by itself."""


class Command(Protocol):
    """A study, or a diagnosis."""

    def status(self) -> CommandStatus:
        """State and progress."""


class Orders:
    """Compares what there is with what there was; ``commands``: name → what runs in the background."""

    def __init__(self, commands: Mapping[str, Command]) -> None:
        self._commands = dict(commands)
        self._states = {name: command.status().state for name, command in self._commands.items()}
        self._generation: int | None = None

    def of_the_pour(self, status: Status) -> Iterator[Event]:
        """A pour other than the last time; the first one is nobody's order."""
        before, self._generation = self._generation, status.generation
        if before not in (None, status.generation):
            text = f"poured anew: {status.scene.rig.name}, seed {status.seed}"
            yield Event(status.generation, 0.0, text, is_order=True)

    def in_the_background(self, status: Status) -> Iterator[Event]:
        """Commands that are in another state than the last time."""
        for name, command in self._commands.items():
            before, now = self._states[name], command.status().state
            self._states[name] = now
            if now != before:
                yield Event(status.generation, status.time, f"{name}: {now}", is_order=now in ASKED_FOR)
