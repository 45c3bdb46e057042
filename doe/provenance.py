"""What a result carries for its report beside the numbers: who made it and when, and of what it was made."""

from __future__ import annotations

from dataclasses import dataclass, field

from doe.record import Record


@dataclass(frozen=True)
class About(Record):
    """Who made a result and when ("2026-11-26"), and what they noted; empty where nobody said."""

    author: str = ""
    date: str = ""
    notes: str = ""


@dataclass(frozen=True)
class PouredPile(Record):
    """Mean silhouette of the piles of one setting, and ``sd`` between pours, over ``u`` from their middle [m]."""

    name: str
    pours: int
    u: tuple[float, ...]
    mean: tuple[float, ...]
    sd: tuple[float, ...]


@dataclass(frozen=True)
class SetUp(Record):
    """The scene at its reference values: ``rig``, the material of its ``wall``, and ``dt``, the time step [s].

    ``values``: path → value of every parameter (SI, or the name of a choice); ``materials``: body → its material.
    """

    rig: str
    wall: str
    dt: float
    values: dict[str, float | str]
    materials: dict[str, str] = field(default_factory=dict)
