"""Surfaces that rigs are made of: a plane, and a straight line turned about the z axis."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Plane:
    """The plane z = ``height`` [m]; bodies lie above it."""

    height: float
    material: str


@dataclass(frozen=True)
class Revolved:
    """The segment (r0, z0)–(r1, z1) [m] turned about the z axis: a cone, a cylinder (r0 = r1) or a disc (z0 = z1).

    A thin shell that pushes from either side; its two edge circles (an outlet's rim) act as edges.
    """

    r0: float
    z0: float
    r1: float
    z1: float
    material: str


Surface = Plane | Revolved
