"""Targets to which a pour or a material can be exported: the protocol of a target, and the order that it gets."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from solver.scenes.scene import Scene


@dataclass(frozen=True)
class ExportOrder:
    """What to export, and how much of it."""

    scene: Scene
    seed: int = 1
    time: float | None = None
    """Simulated time of the other program's pour [s]; None: the time of ours."""
    every: float | None = None
    """Simulated time between two moments [s], for a target that takes ``every``; None: the last moment only."""


class ExportTarget(Protocol):
    """Another program, with the code that writes files for it; derive targets from this class.

    The module that defines a target must not import anything at its top that loads Taichi: the page names targets, and
    its process never loads Taichi.
    """

    name: str
    what: str
    """What the program gets, in a few words, for the command's help and the page."""
    pours: bool = True
    """Whether the pour runs here first."""
    of_material: bool = False
    """Whether it uses the material only, and neither seed nor time of a pour."""
    goes_on: bool = False
    """Whether the other program can simulate for longer than the pour that runs here."""
    options: tuple[str, ...] = ()
    """Options of the command that not every target accepts: ``every``."""
    extra: str = ""
    """Extra of this package that the target needs."""

    def check(self, scene: Scene) -> None:
        """Raise :class:`CommandError`, before anything is poured, for what the target cannot represent."""

    def write(self, folder: Path, order: ExportOrder) -> str:
        """Write the files into an existing folder; returns a line that says what it contains."""


def described(target: ExportTarget) -> str:
    """What a target gets and which options it accepts, in a line."""
    parts = [
        target.what,
        "the pour runs here first" if target.pours else "nothing is poured",
        *(f"takes --{option}" for option in target.options),
        *([f"pip install 'repose-explorer[{target.extra}]'"] if target.extra else []),
    ]
    return "; ".join(parts)
