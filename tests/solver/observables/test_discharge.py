"""Discharge times and masses on curves with known answers."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from solver.observables.discharge import (
    discharge_curve,
    discharge_t10,
    discharge_t50,
    discharge_t90,
    discharge_time,
    left_domain_fraction,
    residual_mass,
    time_of_share,
)
from tests.solver.observables.made_up import balls, record_of

PILE = balls(np.array([[0.0, 0.0, 3e-3], [0.01, 0.0, 3e-3]]))


def test_a_linear_curve_gives_linear_times():
    time = np.linspace(0.0, 3.0, 31)
    # 30 g between 0.55 s and 2.55 s: corners fall between samples, shares of 10, 50, 90 % do not.
    mass = np.clip((time - 0.55) / 2.0, 0.0, 1.0) * 0.03
    record = record_of(PILE, time, mass, 0.03)
    assert discharge_t10(record).value == pytest.approx(0.75, rel=1e-6)
    assert discharge_t50(record).value == pytest.approx(1.55, rel=1e-6)
    assert discharge_t90(record).value == pytest.approx(2.35, rel=1e-6)
    assert discharge_time(record).value == pytest.approx(1.6, rel=1e-6)
    assert residual_mass(record).value == pytest.approx(0.0, abs=1e-15)


def test_the_clock_starts_when_the_gate_opens():
    time = np.linspace(0.0, 3.0, 31)
    record = record_of(PILE, time, np.clip((time - 1.0) / 2.0, 0.0, 1.0) * 0.03, 0.03, gate_opened=1.0)
    assert discharge_t50(record).value == pytest.approx(1.0, rel=1e-6)
    assert discharge_time(record).value == pytest.approx(1.6, rel=1e-6)
    assert discharge_curve(record)[0][0] == -1.0


def test_a_jam_leaves_mass_and_later_times_unknown():
    time = np.array([0.0, 1.0, 2.0])
    record = record_of(PILE, time, np.array([0.0, 0.02, 0.02]), 0.03)
    assert discharge_t50(record).value == pytest.approx(0.75, rel=1e-6)
    assert np.isnan(discharge_t90(record).value)
    assert np.isnan(discharge_time(record).value)
    assert residual_mass(record).value == pytest.approx(0.01, rel=1e-12)


@given(st.lists(st.floats(0.0, 1.0), min_size=2, max_size=30), st.floats(0.01, 1.0))
def test_at_that_time_that_share_has_passed(steps, share):
    mass = np.cumsum(steps)
    if not mass[-1] > 1e-6:
        return
    time = np.arange(mass.size, dtype=np.float64)
    found = time_of_share(share, time, mass, mass[-1])
    # The share is asked for minus a billionth; a step may start above it at the first sample.
    assert np.interp(found, time, mass) >= (share - 2e-9) * mass[-1] - 1e-12
    earlier = time[time < found]
    assert (mass[: earlier.size] <= share * mass[-1]).all()


def test_bodies_out_of_the_domain_are_counted_by_mass():
    record = record_of(PILE, np.array([0.0]), np.array([0.0]), 1.0, inside=np.array([True, False]))
    assert left_domain_fraction(record).value == pytest.approx(0.5, rel=1e-12)


def test_a_run_without_samples_has_no_values():
    record = record_of(balls(np.zeros((0, 3))), np.zeros(0), np.zeros(0), 0.03)
    for observable in (discharge_t10, discharge_time, residual_mass, left_domain_fraction):
        assert np.isnan(observable(record).value)


def test_rounding_of_the_sums_leaves_no_residue():
    record = record_of(balls(np.zeros((2, 3))), np.array([0.0, 1.0]), np.array([0.0, 0.1 + 0.2]), 0.3)
    assert record.trace.discharged_mass[-1] != 0.3
    assert residual_mass(record).value == 0.0
