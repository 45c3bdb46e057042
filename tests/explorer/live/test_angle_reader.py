"""When the angle of a moving pile is read, here and by another process. The clock is the test's."""

import multiprocessing
import queue
import threading
from contextlib import suppress
from types import SimpleNamespace

import pytest

from explorer.live import angle_reader
from explorer.live.angle_reader import (
    LEAST_SHARE_BELOW,
    SIMULATED_INTERVAL,
    WALL_INTERVAL,
    WALL_SHARE,
    AngleReader,
    PileAngles,
    read_angles,
)
from solver.observables.made_up import cone

PILE, STEEPER = cone(30.0), cone(35.0)
FEW = cone(30.0, height=1e-3)
"""Fits into the line's buffer, so that nobody has to listen."""
NAMES = {f"angle_of_repose{side}_deg" for side in ("", "_left", "_right")}


class Clock:
    """Wall time that goes on by ``step`` whenever it is asked for."""

    def __init__(self, now=0.0, step=0.0):
        self.now, self.step = now, step

    def __call__(self):
        self.now += self.step
        return self.now


def due(reader, clock, time, wall):
    clock.now = wall
    return reader.due(time)


def test_a_cone_is_read_from_a_quarter_of_the_mass_on():
    reader = AngleReader(None, Clock())
    reader.read(PILE, LEAST_SHARE_BELOW - 1e-6, 0.0)
    assert reader.newest == PileAngles()
    reader.read(PILE, LEAST_SHARE_BELOW, 0.0)
    # Pixels of 0.2 mm on a flank of some 50 mm, and spheres in place of a smooth surface.
    assert reader.newest.observables["angle_of_repose_deg"].value == pytest.approx(30.0, abs=1.0)
    assert set(reader.newest.observables) == NAMES


def test_it_is_read_after_an_interval_of_simulated_or_of_wall_time():
    clock = Clock(100.0)
    reader = AngleReader(None, clock)
    assert due(reader, clock, 0.0, 100.0)
    reader.read(PILE, 1.0, 1.0)
    assert not due(reader, clock, 1.0 + 0.9 * SIMULATED_INTERVAL, 100.0 + 0.9 * WALL_INTERVAL)
    assert due(reader, clock, 1.0 + 1.1 * SIMULATED_INTERVAL, 100.0)
    assert due(reader, clock, 1.001, 100.0 + 1.1 * WALL_INTERVAL)


def test_a_pile_that_stands_still_in_time_is_not_read_again():
    clock = Clock()
    reader = AngleReader(None, clock)
    reader.read(PILE, 1.0, 1.0)
    assert not due(reader, clock, 1.0, 1e6)


def test_a_reading_that_takes_long_waits_for_its_share_of_the_wall_time():
    clock = Clock(98.0, step=2.0)
    reader = AngleReader(None, clock)
    reader.read(PILE, 1.0, 1.0)
    assert clock.now == 102.0
    clock.step = 0.0
    assert not due(reader, clock, 9.0, 102.0 + 0.9 * 2.0 / WALL_SHARE)
    assert due(reader, clock, 9.0, 102.0 + 1.1 * 2.0 / WALL_SHARE)


@pytest.fixture
def line():
    """A reader's line; ``answer()`` has the other end, a thread that has taken the pile, read it and answer."""
    near, far = multiprocessing.Pipe()
    asked = queue.Queue()

    def listen():
        with suppress(EOFError, OSError):
            while True:
                asked.put(far.recv())

    listener = threading.Thread(target=listen)
    listener.start()
    yield SimpleNamespace(near=near, cut=far.close, answer=lambda: far.send(read_angles(asked.get(timeout=60.0))))
    near.close()
    listener.join()
    far.close()


def test_what_another_process_reads_is_the_same_and_comes_when_it_is_heard(line):
    reader = AngleReader(line.near, Clock())
    reader.ask(PILE, 1.0, 1.0)
    assert not reader.hear()
    assert not reader.due(9.0)  # one pile at a time
    line.answer()
    assert reader.hear()
    here = AngleReader(None, Clock())
    here.read(PILE, 1.0, 1.0)
    assert {name: one.value for name, one in reader.newest.observables.items()} == {
        name: one.value for name, one in here.newest.observables.items()
    }
    assert reader.due(9.0)


def test_an_answer_about_another_moment_than_the_present_one_is_not_taken(line):
    reader = AngleReader(line.near, Clock())
    reader.ask(PILE, 1.0, 1.0)
    reader.forget(PileAngles())  # the pour is brought back
    assert reader.due(0.5)
    reader.ask(STEEPER, 1.0, 0.5)  # nobody listens yet
    line.answer()
    assert not reader.hear()
    assert reader.newest == PileAngles()
    reader.ask(STEEPER, 1.0, 0.5)
    line.answer()
    assert reader.hear()
    assert reader.newest.observables["angle_of_repose_deg"].value == pytest.approx(35.0, abs=1.0)


def test_what_is_read_here_meanwhile_stands(line):
    reader = AngleReader(line.near, Clock())
    reader.ask(PILE, 1.0, 1.0)
    reader.read(STEEPER, 1.0, 1.1)  # the pour was paused
    line.answer()
    assert not reader.hear()
    assert reader.newest.observables["angle_of_repose_deg"].value == pytest.approx(35.0, abs=1.0)


@pytest.mark.parametrize("asked", [False, True])
def test_without_the_other_process_everything_is_read_here(asked):
    near, far = multiprocessing.Pipe()
    reader = AngleReader(near, Clock())
    if asked:
        reader.ask(FEW, 1.0, 1.0)
    far.close()
    if asked:
        reader.hear()
    else:
        reader.ask(FEW, 1.0, 1.0)
    assert reader.due(1.0)
    reader.ask(PILE, 1.0, 1.0)
    assert set(reader.newest.observables) == NAMES
    near.close()


def test_the_process_answers_until_its_line_is_cut():
    context = multiprocessing.get_context("spawn")
    near, far = context.Pipe()
    process = context.Process(target=angle_reader.run, args=(far,), daemon=True)
    process.start()
    far.close()
    reader = AngleReader(near, Clock())
    reader.ask(PILE, 1.0, 1.0)
    assert near.poll(60.0)
    assert reader.hear()
    assert set(reader.newest.observables) == NAMES
    near.close()
    process.join(60.0)
    assert process.exitcode == 0
