"""The opening that a rig empties through, seen from above, and what lies across it once nothing moves.

A body lies across the outlet if its centre of mass is over the opening, and two parts of it reach the edge, on opposite
sides of that centre, so that the line between them crosses the opening within 0.71 half widths of its middle (in a
circle: cuts off more than a quarter turn of the edge). Such a body cannot fall, whatever else is there. Several bodies
that hold material although none of them lies across, along the edge or beside each other, form an arch.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from solver.pours.record import Bodies, Spheres

Array = npt.NDArray[np.float64]

EDGE = 0.99
"""Share of the half width from which a body reaches the edge: one between upright walls just touches them."""
CHORD = 0.5**0.5
"""Largest distance of the line from the middle, as a share of the half width."""


class Outlet(Protocol):
    """An opening about the z axis."""

    def across(self, place: Array) -> Array:
        """Components of ``place`` (n, 2) [m] across the opening, shape (n, 1 or 2); their norm counts."""
        ...

    @property
    def half_width(self) -> float:
        """Half of the narrowest way across [m]."""
        ...

    @property
    def depth(self) -> float:
        """How far below its edge the container ends [m]."""
        ...


@dataclass(frozen=True)
class RoundOutlet:
    """A circle; of an opening that is not round, the largest within it."""

    half_width: float
    depth: float = 0.0

    def across(self, place: Array) -> Array:
        """See :class:`Outlet`."""
        return place


@dataclass(frozen=True)
class Slot:
    """A slot along y."""

    half_width: float
    depth: float = 0.0

    def across(self, place: Array) -> Array:
        """See :class:`Outlet`."""
        return place[:, :1]


@dataclass(frozen=True)
class Obstruction:
    """A body that lies across the outlet."""

    component: str
    mass: float
    """Mass of the body itself [kg]."""
    above: float
    """Mass of the other bodies over the outlet [kg]; in a rig that is meant to empty, of all other bodies in it."""
    height: float = 0.0
    """Height of its lowest point above the edge [m] if that is more than the outlet's half width: it is wedged between
    walls. 0 if it is at the outlet."""


def obstruction(
    outlet: Outlet, height: float, bodies: Bodies, spheres: Spheres, held: npt.NDArray[np.bool_], keeps: bool
) -> Obstruction | None:
    """The lowest body across ``outlet``; None where there is none.

    ``height``: where the container ends [m], the outlet's ``depth`` below its edge.

    ``spheres``: the member spheres of ``bodies``. ``held``: which bodies are in the container, shape (n,). ``keeps``:
    whether bodies beside the outlet belong there, so that only those over it count.

    A body across the outlet that rests on others which hang lower is part of an arch and does not count. The centre of
    mass of the body may be just below the edge, since the parts of it that bear on the edge are not.
    """
    over = _over(outlet, bodies)
    counts = held & over if keeps else held
    lowest = np.full(bodies.mass.size, np.inf)
    np.minimum.at(lowest, spheres.body, spheres.centre[:, 2] - spheres.radius)
    for b in np.argsort(bodies.position[:, 2], kind="stable"):
        mine = (spheres.body == b) & (spheres.centre[:, 2] + spheres.radius >= height)
        if not bodies.inside[b] or not over[b] or not mine.any():
            continue
        others = counts & (np.arange(held.size) != b)
        if (bodies.position[others, 2] < lowest[b]).any():
            return None
        if _reaches_both_sides(outlet, spheres.centre[mine, :2], spheres.radius[mine], bodies.position[b, :2]):
            name = bodies.component_names[bodies.component[b]]
            gap = float(lowest[b]) - height - outlet.depth
            wedged = gap if gap > outlet.half_width else 0.0
            return Obstruction(name, float(bodies.mass[b]), float(bodies.mass[others].sum()), wedged)
    return None


def waiting(outlet: Outlet, height: float, bodies: Bodies, held: npt.NDArray[np.bool_]) -> int:
    """Number of bodies in the container (``held``, (n,)) over ``outlet`` and above its edge. ``height`` as above."""
    above = bodies.position[:, 2] > height + outlet.depth
    return int((held & above & _over(outlet, bodies)).sum())


def _over(outlet: Outlet, bodies: Bodies) -> npt.NDArray[np.bool_]:
    return np.asarray(np.linalg.norm(outlet.across(bodies.position[:, :2]), axis=1) < outlet.half_width)


def _reaches_both_sides(outlet: Outlet, place: Array, radius: Array, middle: Array) -> bool:
    """Whether discs at ``place`` (n, 2) of ``radius`` (n,) [m] reach the edge on opposite sides of ``middle`` (2,).

    The line between them must also cross the opening.
    """
    from_middle = outlet.across(place)
    at_edge = np.linalg.norm(from_middle, axis=1) + radius >= EDGE * outlet.half_width
    # Along a slot nothing is opposite.
    arms, start = (from_middle - outlet.across(middle[None]))[at_edge], from_middle[at_edge]
    way = start[None, :, :] - start[:, None, :]
    length2 = np.maximum((way**2).sum(axis=2), 1e-30)
    share = np.clip(-(start[:, None, :] * way).sum(axis=2) / length2, 0.0, 1.0)
    nearest = np.linalg.norm(start[:, None, :] + share[:, :, None] * way, axis=2)
    return bool(((arms @ arms.T < 0.0) & (nearest <= CHORD * outlet.half_width)).any())
