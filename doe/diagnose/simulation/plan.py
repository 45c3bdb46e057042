"""Which pours the diagnosis asks for: they belong to the declared model and its rigs, not to one data set.

Points come from fixed sequences, so that the same model asks for the same pours again, and more pours continue a
sequence instead of beginning another:

    base              parameters over the whole box (scrambled Sobol sequence)
    effect, scaling   parameters in the middle, the amplitude where it stands at present
    effect, screening parameters and amplitude over their box together, the amplitude in quarters of its range, both
                      signs where there are two, two amplitudes around a circle
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.stats import qmc

from doe.diagnose.runs import Effect, Parameter

FloatArray = npt.NDArray[np.float64]

LEVELS = (0.25, 0.5, 0.75, 1.0)
"""Shares of an amplitude's range. Which one a point gets is a dimension of the sequence: taken in turn, they would go
with the digits of a parameter, and a curvature in the amplitude would look like a product with that parameter."""
ANGLES = 8
"""Directions of two amplitudes."""
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
    rows = sobol([(p.low, p.high) for p in parameters], number, 0)
    return [Point("base", k, row) for k, row in enumerate(rows)]


def effect_points(
    parameters: tuple[Parameter, ...], effect: Effect, stream: int, number: int, first: int = 0
) -> list[Point]:
    """Points ``first`` … ``number`` - 1 of an effect's sequence; ``stream`` is its place in the list of effects."""
    axes = [(p.low, p.high) for p in parameters] + [(0.0, 1.0)] * effect.amplitudes
    rows = sobol(axes, number, EFFECT_STREAM + stream)
    name, k = sequence(effect), len(parameters)
    return [
        Point(name, n, row[:k], ((effect.name, amplitude_at(effect, row[k:])),))
        for n, row in list(enumerate(rows))[first:]
    ]


def middle_points(parameters: tuple[Parameter, ...], number: int) -> list[Point]:
    """Replicates of the base model with every parameter at its mean, or in the middle of its range."""
    return [Point("middle", k, middle(parameters)) for k in range(number)]


def scaling_points(parameters: tuple[Parameter, ...], effect: Effect, number: int) -> list[Point]:
    """Replicates with the effect at its full range, parameters in the middle."""
    name = f"{sequence(effect)} middle"
    return [Point(name, k, middle(parameters), ((effect.name, full(effect)),)) for k in range(number)]


def sequence(effect: Effect) -> str:
    """Name of the points of an effect over its present range; over another one they are others."""
    return f"{effect.name}@{'_'.join(f'{bound:.6g}' for bound in effect.high)}"


def amplitude_at(effect: Effect, unit: Sequence[float]) -> tuple[float, ...]:
    """The amplitude at ``unit`` (m,) in [0, 1)^m: sign and level of one, level and direction of two."""
    if effect.amplitudes == 1:
        low, high = effect.low[0], effect.high[0]
        sided = [level * low for level in reversed(LEVELS)] if low < 0.0 else []
        choices = [*sided, *(level * high for level in LEVELS)]
        return (choices[int(unit[0] * len(choices))],)
    level = LEVELS[int(unit[0] * len(LEVELS))]
    return tuple(level * part for part in directions(effect)[int(unit[1] * ANGLES)])


def directions(effect: Effect) -> list[tuple[float, ...]]:
    """Full amplitudes in every direction that is simulated: up and, where there is one, down; two around a circle."""
    if effect.amplitudes == 1:
        return [effect.high, *([effect.low] if effect.low[0] < 0.0 else [])]
    around = [2.0 * math.pi * k / ANGLES for k in range(ANGLES)]
    return [
        tuple(
            part * (high if part > 0 else -low)
            for part, low, high in zip((math.cos(angle), math.sin(angle)), effect.low, effect.high, strict=True)
        )
        for angle in around
    ]


def full(effect: Effect) -> tuple[float, ...]:
    """The effect at its full range; of two amplitudes the first alone."""
    return (effect.high[0], *(0.0 for _ in effect.high[1:]))


def middle(parameters: tuple[Parameter, ...]) -> tuple[float, ...]:
    """Every parameter at its independently measured mean, or in the middle of its range."""
    return tuple(p.mean if p.mean is not None else (p.low + p.high) / 2.0 for p in parameters)


def sobol(axes: Sequence[tuple[float, float]], number: int, stream: int) -> list[tuple[float, ...]]:
    """The first ``number`` points of a scrambled Sobol sequence over the box of ``axes`` (low, high)."""
    if number == 0:
        return []
    power = max(3, math.ceil(math.log2(number)))
    unit = qmc.Sobol(len(axes), scramble=True, seed=stream).random_base2(power)[:number]
    return [tuple(low + u * (high - low) for (low, high), u in zip(axes, row, strict=True)) for row in unit]
