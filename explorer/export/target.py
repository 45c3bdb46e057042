"""What a pour or a material can be exported to: the protocol of a target, and what it is asked for."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from solver.scenes.scene import Scene


@dataclass(frozen=True)
class ExportOrder:
    """What is exported, and how much of it."""

    scene: Scene
    seed: int = 1
    time: float | None = None
    """Simulated time of the other program's pour [s]; None: that of ours."""
    every: float | None = None
    """Simulated time between two moments [s], for a target that takes ``every``; None: the last moment only."""


class ExportTarget(Protocol):
    """Another program, and what writes files for it; derive from this one.

    The file that defines a target imports nothing that loads Taichi at its top: the page names targets, and its
    process has none.
    """

    name: str
    what: str
    """What it gets, in a few words: for the help of the command, and the page."""
    pours: bool = True
    """Whether the pour runs here first."""
    of_material: bool = False
    """Whether it takes nothing of a pour, neither its seed nor its time."""
    goes_on: bool = False
    """Whether the other program can simulate for longer than the pour that runs here."""
    options: tuple[str, ...] = ()
    """Options of the command that not every target takes: ``every``."""
    extra: str = ""
    """Extra of this package that has to be installed for it."""

    def check(self, scene: Scene) -> None:
        """Raise :class:`CommandError`, before anything is poured, for what the target cannot take."""

    def write(self, folder: Path, order: ExportOrder) -> str:
        """Write the files into an existing folder; returns, in a line, what is in it."""


def described(target: ExportTarget) -> str:
    """What a target gets and what it takes, in a line."""
    parts = [
        target.what,
        "the pour runs here first" if target.pours else "nothing is poured",
        *(f"takes --{option}" for option in target.options),
        *([f"pip install 'repose-explorer[{target.extra}]'"] if target.extra else []),
    ]
    return "; ".join(parts)
