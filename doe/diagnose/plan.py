"""Which pours the diagnosis asks for: they belong to the declared model and its rigs, not to one data set.

Points come from fixed sequences, so that the same model asks for the same pours again, and more pours continue a
sequence instead of beginning another:

    base              parameters over the whole box (scrambled Sobol sequence)
    effect, scaling   parameters in the middle, the amplitude where it stands at present
    effect, screening parameters over the box, amplitude at half and full range in turn, both signs where there are two
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.stats import qmc

from doe.diagnose.runs import Effect, Parameter

FloatArray = npt.NDArray[np.float64]

LEVELS = (1.0, 0.5)
"""Shares of an amplitude's range, in turn."""
EFFECT_STREAM = 1000
"""Seed of the sequence of the first effect; the base model has 0."""


@dataclass(frozen=True)
class Point:
    """One setting of the declared model. ``sequence`` and ``number`` name it for good and give its seeds."""

    sequence: str
    number: int
    theta: tuple[float, ...]
    """Parameters in natural units, in the order of the declaration."""
    effects: tuple[tuple[str, tuple[float, ...]], ...] = ()
    """Names of the effects that are on, with their amplitudes."""


def base_points(parameters: tuple[Parameter, ...], number: int) -> list[Point]:
    """The first ``number`` points of the base model."""
    rows = box_points(parameters, number, 0)
    return [Point("base", k, row) for k, row in enumerate(rows)]


def effect_points(
    parameters: tuple[Parameter, ...], effect: Effect, stream: int, number: int, first: int = 0
) -> list[Point]:
    """Points ``first`` … ``number`` - 1 of an effect's sequence; ``stream`` is its place in the list of effects."""
    rows = box_points(parameters, number, EFFECT_STREAM + stream)
    directions = list(amplitudes(effect))
    scale = "_".join(f"{bound:.6g}" for bound in effect.high)
    return [
        Point(f"{effect.name}@{scale}", k, rows[k], ((effect.name, directions[k % len(directions)]),))
        for k in range(first, number)
    ]


def middle_points(parameters: tuple[Parameter, ...], number: int) -> list[Point]:
    """Replicates of the base model with every parameter at its mean, or in the middle of its range."""
    return [Point("middle", k, middle(parameters)) for k in range(number)]


def scaling_points(parameters: tuple[Parameter, ...], effect: Effect, number: int) -> list[Point]:
    """Replicates with the effect at its full range, parameters in the middle."""
    scale = "_".join(f"{bound:.6g}" for bound in effect.high)
    return [
        Point(f"{effect.name}@{scale} middle", k, middle(parameters), ((effect.name, full(effect)),))
        for k in range(number)
    ]


def amplitudes(effect: Effect) -> Iterator[tuple[float, ...]]:
    """Amplitudes of an effect's sequence: one at its upper or either bound, two around a circle."""
    if effect.amplitudes == 1:
        signs = (1.0, -1.0) if effect.low[0] < 0.0 else (1.0,)
        for level in LEVELS:
            for sign in signs:
                yield (level * (effect.high[0] if sign > 0 else -effect.low[0] * sign),)
        return
    for k in range(8):
        level, angle = LEVELS[k // 4], 2.0 * math.pi * ((k % 4) + 0.5 * (k // 4)) / 4.0
        yield tuple(
            level * part * (high if part > 0 else -low)
            for part, low, high in zip((math.cos(angle), math.sin(angle)), effect.low, effect.high, strict=True)
        )


def full(effect: Effect) -> tuple[float, ...]:
    """The effect at its full range; of two amplitudes the first alone."""
    return (effect.high[0], *(0.0 for _ in effect.high[1:]))


def middle(parameters: tuple[Parameter, ...]) -> tuple[float, ...]:
    """Every parameter at its independently measured mean, or in the middle of its range."""
    return tuple(p.mean if p.mean is not None else (p.low + p.high) / 2.0 for p in parameters)


def box_points(parameters: tuple[Parameter, ...], number: int, stream: int) -> list[tuple[float, ...]]:
    """The first ``number`` points of a scrambled Sobol sequence over the box, natural units."""
    if number == 0:
        return []
    power = max(3, math.ceil(math.log2(number)))
    unit = qmc.Sobol(len(parameters), scramble=True, seed=stream).random_base2(power)[:number]
    return [tuple(p.low + u * (p.high - p.low) for p, u in zip(parameters, row, strict=True)) for row in unit]
