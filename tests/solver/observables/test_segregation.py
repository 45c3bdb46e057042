"""Composition by radius on rings of known composition."""

from __future__ import annotations

import numpy as np
import pytest

from solver.observables.reading import PileReading
from solver.observables.segregation import inner_mass_share, outer_mass_share, segregation_index
from solver.pours.record import Pile
from tests.solver.observables.made_up import balls, empty_pile


def ring(radius: float, n: int) -> np.ndarray:
    angle = 2 * np.pi * np.arange(n) / n
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.full(n, 3e-3)], axis=1)


def rings(inner: list[int], outer: list[int]) -> PileReading:
    """Two rings of 8 bodies of given components, at 10 and 30 mm; r50 lies between."""
    return PileReading(balls(np.concatenate([ring(0.01, 8), ring(0.03, 8)]), component=inner + outer))


def test_petioles_outside():
    reading = rings(inner=[0] * 8, outer=[1] * 8)
    assert inner_mass_share(reading)["a"].value == 1.0
    assert inner_mass_share(reading)["b"].value == 0.0
    assert outer_mass_share(reading)["b"].value == 1.0
    index = segregation_index(reading)
    # Mean radius 20 mm; 10/20 and 30/20.
    assert index["a"].value == pytest.approx(0.5, rel=1e-12)
    assert index["b"].value == pytest.approx(1.5, rel=1e-12)


def test_a_mixed_pile_is_not_segregated():
    reading = rings(inner=[0, 1] * 4, outer=[0, 1] * 4)
    for observable in (inner_mass_share, outer_mass_share):
        assert [value.value for value in observable(reading).values()] == [0.5, 0.5]
    for value in segregation_index(reading).values():
        assert value.value == pytest.approx(1.0, rel=1e-12)


def test_shares_go_by_mass():
    pile = rings(inner=[0, 1] * 4, outer=[0, 1] * 4).pile
    mass = np.where(pile.component == 1, 3.0, 1.0)
    heavy = PileReading(Pile(pile.spheres, pile.position, mass, pile.component, pile.component_names))
    assert inner_mass_share(heavy)["b"].value == pytest.approx(0.75, rel=1e-12)


def test_a_component_that_is_not_there_has_no_index():
    reading = rings(inner=[0] * 8, outer=[2] * 8)
    assert np.isnan(segregation_index(reading)["b"].value)
    assert inner_mass_share(reading)["b"].value == 0.0


def test_an_empty_pile_has_no_composition():
    for observable in (inner_mass_share, outer_mass_share, segregation_index):
        assert all(np.isnan(value.value) for value in observable(PileReading(empty_pile())).values())
