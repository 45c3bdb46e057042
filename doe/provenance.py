"""Information for the report that a result carries beside its numbers: its author and date, and its set-up."""

from __future__ import annotations

from dataclasses import dataclass, field

from doe.record import Record


@dataclass(frozen=True)
class About(Record):
    """Author of a result, its date ("2026-11-26") and the author's notes; empty where not given."""

    author: str = ""
    date: str = ""
    notes: str = ""


@dataclass(frozen=True)
class PouredPile(Record):
    """Mean silhouette of the piles of one setting and its ``sd`` between pours, over ``u`` from the middle [m]."""

    name: str
    pours: int
    u: tuple[float, ...]
    mean: tuple[float, ...]
    sd: tuple[float, ...]


@dataclass(frozen=True)
class SetUp(Record):
    """The scene at its reference values: ``rig``, the material of its ``wall``, and ``dt``, the time step [s].

    ``values``: path → value of every parameter (SI, or the name of a choice); ``materials``: body → material.
    """

    rig: str
    wall: str
    dt: float
    values: dict[str, float | str]
    materials: dict[str, str] = field(default_factory=dict)
