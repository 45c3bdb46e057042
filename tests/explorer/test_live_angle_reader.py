"""When the angle of a moving pile is read. The clock is the test's."""

import itertools

import pytest

from explorer.live.angle_reader import LEAST_SHARE_BELOW, SIMULATED_INTERVAL, WALL_INTERVAL, WALL_SHARE, AngleReader
from solver.observables.made_up import cone

PILE = cone(30.0)


def read(reader, share_below=1.0, time=0.0, wall=0.0, took=0.0):
    reader.read(PILE, share_below, time, itertools.count(wall, took).__next__)


def test_a_cone_is_read_from_a_quarter_of_the_mass_on():
    reader = AngleReader()
    read(reader, share_below=LEAST_SHARE_BELOW - 1e-6)
    assert reader.observables == {}
    read(reader, share_below=LEAST_SHARE_BELOW)
    # Pixels of 0.2 mm on a flank of some 50 mm, and spheres in place of a smooth surface.
    assert reader.observables["angle_of_repose_deg"].value == pytest.approx(30.0, abs=1.0)
    assert set(reader.observables) == {f"angle_of_repose{side}_deg" for side in ("", "_left", "_right")}


def test_it_is_read_after_an_interval_of_simulated_or_of_wall_time():
    reader = AngleReader()
    assert reader.due(0.0, 0.0)
    read(reader, time=1.0, wall=100.0)
    assert not reader.due(1.0 + 0.9 * SIMULATED_INTERVAL, 100.0 + 0.9 * WALL_INTERVAL)
    assert reader.due(1.0 + 1.1 * SIMULATED_INTERVAL, 100.0)
    assert reader.due(1.001, 100.0 + 1.1 * WALL_INTERVAL)


def test_a_pile_that_stands_still_in_time_is_not_read_again():
    reader = AngleReader()
    read(reader, time=1.0)
    assert not reader.due(1.0, 1e6)


def test_a_reading_that_takes_long_waits_for_its_share_of_the_wall_time():
    reader = AngleReader()
    read(reader, time=1.0, wall=100.0, took=2.0)
    ended = 102.0
    assert not reader.due(9.0, ended + 0.9 * 2.0 / WALL_SHARE)
    assert reader.due(9.0, ended + 1.1 * 2.0 / WALL_SHARE)
