"""Which pours a diagnosis asks for: they belong to the declared model and its rigs, not to one data set.

A point is one setting with a number in a fixed sequence. The same model therefore asks for the same pours again, and
more pours continue a sequence instead of starting another. In the teaching sequences each parameter is moved by one
deviation to either side, by Walsh functions of the number: in every four pours (of three parameters) each parameter is
on either side equally often and no two are correlated, so the effects of parameters cost no extra pours.

Exact symmetries replace pours. In a rig that looks the same after a quarter turn, turning the pile on a tilted plate by
a quarter gives the pile on a plate tilted in another direction; the pile of a displaced funnel is the pile, displaced.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from doe.declared.model import CalibratedParameter, CandidateEffect, Declared
from doe.measurement.sight import PERFECT, Sight
from doe.record import Record
from solver import Record as PourRecord


@dataclass(frozen=True)
class View:
    """How a pour is viewed: its pile is turned by ``turns`` quarter turns about the rig's axis, then displaced by
    ``shift`` (x, y) [m], and its surface is seen through ``sight``.
    """

    turns: int = 0
    shift: tuple[float, float] = (0.0, 0.0)
    sight: Sight = PERFECT

    @property
    def label(self) -> str:
        """Suffix of the names of numbers that are read in this view."""
        if self == AS_IT_IS:
            return ""
        through = "" if self.sight == PERFECT else f" {self.sight.label}"
        return f"|{self.turns} {self.shift[0]:.6g} {self.shift[1]:.6g}{through}"

    def of(self, record: PourRecord) -> PourRecord:
        """``record`` with its pile turned and displaced."""
        pile = record.pile
        if self == AS_IT_IS:
            return record

        def seen(places: np.ndarray) -> np.ndarray:
            x, y, z = places.T
            for _ in range(self.turns % 4):
                x, y = -y, x
            return np.column_stack([x + self.shift[0], y + self.shift[1], z])

        spheres = dataclasses.replace(pile.spheres, centre=seen(pile.spheres.centre))
        pile = dataclasses.replace(pile, spheres=spheres, position=seen(pile.position))
        return dataclasses.replace(record, pile=pile)


AS_IT_IS = View()
BASE = "base"
"""Sequence of the base model."""


@dataclass(frozen=True)
class Point:
    """One setting of the declared model. ``sequence`` and ``number`` identify it permanently and give its seeds."""

    sequence: str
    number: int
    theta: tuple[float, ...]
    """Parameters in natural units, in the order of the declaration."""
    effects: tuple[tuple[str, tuple[float, ...]], ...] = ()
    """Names of the effects that are on, with their amplitudes."""
    view: View = AS_IT_IS

    def seen(self, view: View) -> Point:
        """The same pour in another view."""
        return dataclasses.replace(self, view=view)


@dataclass(frozen=True)
class Direction(Record):
    """One direction in which an effect can act: its amplitudes are multiples of ``full``, the end of its range.

    ``angle`` [rad]: that of a direction in the plane, else None.
    """

    effect: str
    name: str
    """The effect's name, with the sign or axis if the effect has several directions."""
    full: tuple[float, ...]
    angle: float | None = None

    def at(self, share: float) -> tuple[float, ...]:
        """The amplitude [natural units] at ``share`` of the range."""
        return tuple(share * end for end in self.full)


def directions_of(effect: CandidateEffect) -> list[Direction]:
    """Directions of ``effect``: up and, if its range goes below zero, down; +x, +y, −x and −y with two amplitudes."""
    name = effect.name
    if effect.amplitudes == 2:
        (east, north), (west, south) = effect.high, effect.low
        ends = ((east, 0.0), (0.0, north), (west, 0.0), (0.0, south))
        signs = ("+x", "+y", "-x", "-y")
        # One size in all directions, so that one amplitude also serves the directions in between.
        size = min(abs(a) + abs(b) for a, b in ends)
        return [
            Direction(
                name,
                f"{name} {sign}",
                (size * math.copysign(1.0, a) * (a != 0), size * math.copysign(1.0, b) * (b != 0)),
                k * 0.5 * math.pi,
            )
            for k, (sign, (a, b)) in enumerate(zip(signs, ends, strict=True))
        ]
    sides = [(sign, end) for sign, end in (("+", effect.high), ("-", effect.low)) if end[0] != 0.0]
    return [Direction(name, f"{name} {sign}" if len(sides) == 2 else name, end) for sign, end in sides]


def moved(declared: Declared, number: int) -> tuple[float, ...]:
    """Parameters [natural units] of pour ``number`` of a sequence: each one deviation off its middle, within range."""
    return declared.natural([_walsh(number, j + 1) for j in range(len(declared.parameters))])


def _walsh(number: int, mask: int) -> float:
    return -1.0 if (number & mask).bit_count() % 2 else 1.0


def base_points(declared: Declared, number: int, first: int = 0) -> list[Point]:
    """Pours ``first`` … ``number`` − 1 of the base model."""
    return [Point(BASE, k, moved(declared, k)) for k in range(first, number)]


def far_points(declared: Declared, parameter: int, theta: float, number: int) -> list[Point]:
    """``number`` pours of the base model with ``parameter`` at ``theta`` deviations off its middle, within its range:
    moves of one deviation to either side do not show how curved a response is.
    """
    name, natural = declared.parameters[parameter].name, declared.parameters[parameter].natural(theta)
    points = [Point(f"base {name}@{natural:.6g}", k, moved(declared, k)) for k in range(number)]
    return [dataclasses.replace(p, theta=(*p.theta[:parameter], natural, *p.theta[parameter + 1 :])) for p in points]


def effect_points(declared: Declared, direction: Direction, share: float, number: int, first: int = 0) -> list[Point]:
    """Pours ``first`` … ``number`` − 1 of an effect at ``share`` of its range."""
    amplitude = direction.at(share)
    name = f"{direction.effect}@{'_'.join(f'{one:.6g}' for one in amplitude)}"
    effects = ((direction.effect, amplitude),)
    return [Point(name, k, moved(declared, k), effects) for k in range(first, number)]


def middle(parameters: Sequence[CalibratedParameter]) -> tuple[float, ...]:
    """Every parameter at its independently measured mean, or in the middle of its range."""
    return tuple(p.middle for p in parameters)
