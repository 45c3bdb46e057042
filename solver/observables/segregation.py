"""Composition of a pile by radius: which component lies inside, which outside. One number per component."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from solver.observables.observable import ComponentObservable, Value, first_line
from solver.observables.reading import PileReading


def inner_mass_share(reading: PileReading) -> dict[str, Value]:
    """Share of every component in the mass within r50 (bodies by their centres); the shares add up to 1."""
    return _shares(reading, reading.radii <= reading.r50)


def outer_mass_share(reading: PileReading) -> dict[str, Value]:
    """Share of every component in the mass beyond r50; NaN if nothing lies there."""
    return _shares(reading, reading.radii > reading.r50)


def segregation_index(reading: PileReading) -> dict[str, Value]:
    """Mass-weighted mean radius of every component over that of all bodies.

    1: spread like the pile as a whole; below 1: inside; above 1: outside. NaN for a component that is not
    there.
    """
    pile = reading.pile
    moment = np.bincount(pile.component, pile.mass * reading.radii, minlength=len(pile.component_names))
    mass = np.bincount(pile.component, pile.mass, minlength=len(pile.component_names))
    with np.errstate(invalid="ignore", divide="ignore"):
        index = (moment / mass) / (moment.sum() / mass.sum())
    return _by_name(reading, index.tolist())


def _shares(reading: PileReading, where: npt.NDArray[np.bool_]) -> dict[str, Value]:
    pile = reading.pile
    mass = np.bincount(pile.component[where], pile.mass[where], minlength=len(pile.component_names))
    total = mass.sum()
    return _by_name(reading, (mass / total if total > 0.0 else np.full(mass.size, np.nan)).tolist())


def _by_name(reading: PileReading, values: list[float]) -> dict[str, Value]:
    return {name: Value(value, "1") for name, value in zip(reading.pile.component_names, values, strict=True)}


OBSERVABLES = tuple(
    ComponentObservable(function.__name__, "1", first_line(function), function)
    for function in (inner_mass_share, outer_mass_share, segregation_index)
)
