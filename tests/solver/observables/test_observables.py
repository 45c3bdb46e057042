"""Contract of the registry: every observable, on every kind of pile."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from solver.observables import (
    AZIMUTHS_DEG,
    COMPONENT_OBSERVABLES,
    OBSERVABLES,
    observables_in,
    observe,
    observe_pile,
    silhouette,
)
from solver.pours.record import Pile, Record, Spheres
from solver.rigs import Funnel
from tests.solver.observables.made_up import balls, empty_pile, record_of, seeds_in_cone


def poured(pile: Pile) -> Record:
    return record_of(pile, np.array([0.0, 1.0, 2.0]), np.array([0.0, 0.02, 0.03]), 0.03)


@pytest.fixture(scope="module")
def seeds() -> Pile:
    pile = seeds_in_cone(25.0, 80, np.random.default_rng(7), reach=0.5)
    component = (np.arange(80) % 3).astype(np.int32)
    return dataclasses.replace(pile, component=component, component_names=("a", "b", "c"))


def test_names_are_unique_and_documented():
    names = [*OBSERVABLES] + [o.name for o in COMPONENT_OBSERVABLES]
    assert len(set(names)) == len(names)
    docs = [o.doc for o in OBSERVABLES.values()] + [o.doc for o in COMPONENT_OBSERVABLES]
    assert all(doc[0].isupper() or doc[0].isdigit() or doc.startswith("t90") for doc in docs)


def test_units_agree_with_names():
    suffixes = {"deg": "_deg", "m": "_m", "s": "_s", "kg": "_kg", "kg/m3": "_kg_m3"}
    for observable in OBSERVABLES.values():
        if observable.unit in suffixes:
            assert observable.name.split("@")[0].endswith(suffixes[observable.unit])


def test_what_can_be_measured_agrees_with_the_unit():
    for observable in OBSERVABLES.values():
        low, high = observable.possible
        assert low < high
        signed = observable.name.startswith(("centroid", "slope", "dynamic"))
        assert signed == observable.is_possible(-1e-6)
        assert (observable.unit == "deg") == (high == 90.0)
        assert (observable.unit == "1") == (high == 1.0)


def test_a_pile_gives_every_value_finite_and_in_its_unit(seeds):
    values = observe(poured(seeds))
    given = observables_in(Funnel())
    for name in given:
        assert values[name].unit == OBSERVABLES[name].unit
    assert set(values) == set(given) | {f"{o.name}.{component}" for o in COMPONENT_OBSERVABLES for component in "abc"}
    assert all(np.isfinite(value.value) for value in values.values())
    assert all(OBSERVABLES[name].is_possible(values[name].value) for name in given)


@pytest.mark.parametrize("n", [0, 1, 2])
def test_hardly_a_pile_is_no_error(n):
    pile = balls(np.array([[0.0, 0.0, 3e-3], [0.005, 0.0, 3e-3]])[:n]) if n else empty_pile()
    values = observe(poured(pile))
    assert set(values) >= set(observables_in(Funnel()))
    if n < 2:
        assert all(np.isnan(v.value) for name, v in values.items() if name.startswith("angle_of_repose"))


def test_a_diverged_pile_is_nan_and_no_error(seeds):
    centre = seeds.spheres.centre.copy()
    centre[3, 1] = np.nan
    broken = dataclasses.replace(seeds, spheres=dataclasses.replace(seeds.spheres, centre=centre))
    values = observe_pile(broken)
    assert set(values) == set(observe_pile(seeds))
    assert all(np.isnan(value.value) for value in values.values())


def test_the_order_of_bodies_and_spheres_does_not_matter(seeds):
    order = np.random.default_rng(0).permutation(80)
    rank = np.argsort(order).astype(np.int32)
    spheres = Spheres(seeds.spheres.centre[::-1], seeds.spheres.radius[::-1], rank[seeds.spheres.body[::-1]])
    shuffled = Pile(spheres, seeds.position[order], seeds.mass, seeds.component[order], seeds.component_names)
    before, after = observe_pile(seeds), observe_pile(shuffled)
    for name, value in before.items():
        # Sums in another order; the tiny shift of the centroid may move the height map's grid by rounding.
        assert after[name].value == pytest.approx(value.value, rel=1e-6, abs=1e-12), name


def test_observing_changes_nothing(seeds):
    before = seeds.spheres.centre.copy(), seeds.position.copy()
    assert observe_pile(seeds) == observe_pile(seeds)
    np.testing.assert_array_equal(seeds.spheres.centre, before[0])
    np.testing.assert_array_equal(seeds.position, before[1])


def test_every_view_is_drawn_once_for_all_that_is_read_off_it(seeds, monkeypatch):
    """Silhouettes take nearly all of the time: twelve views, the four that are named among them."""
    drawn = []

    def counted(spheres, azimuth_deg, *pixel):
        drawn.append(azimuth_deg)
        return silhouette(spheres, azimuth_deg, *pixel)

    monkeypatch.setattr("solver.observables.reading.silhouette", counted)
    observe(poured(seeds))
    assert sorted(drawn) == sorted(AZIMUTHS_DEG)
