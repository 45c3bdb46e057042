import dataclasses
import multiprocessing

import numpy as np
import pytest

from explorer.live.frames import FrameReader, FrameWriter, shared_block
from solver.pours.record import Bodies


def bodies(n, shift=0.0):
    rng = np.random.default_rng(n)
    return Bodies(
        component=np.arange(n, dtype=np.int32) % 3,
        component_names=("a", "b", "c"),
        mass=np.ones(n),
        scale=rng.uniform(0.5, 1.5, size=n),
        position=rng.normal(size=(n, 3)) + shift,
        quaternion=rng.normal(size=(n, 4)),
        velocity=np.zeros((n, 3)),
        inside=np.arange(n) % 2 == 0,
    )


@pytest.fixture
def block():
    return shared_block(multiprocessing.get_context("spawn"))


def test_no_frame_before_the_first(block):
    assert FrameReader(block).newest() is None


def test_a_frame_comes_out_as_it_went_in(block):
    one = bodies(7)
    FrameWriter(block).publish(one, generation=3, time=0.25)
    frame = FrameReader(block).newest()
    assert (frame.number, frame.generation, frame.time) == (1, 3, 0.25)
    # Frames are single precision: half an ulp of float32.
    np.testing.assert_allclose(frame.position, one.position, rtol=2**-24)
    np.testing.assert_allclose(frame.quaternion, one.quaternion, rtol=2**-24)
    np.testing.assert_allclose(frame.scale, one.scale, rtol=2**-24)
    np.testing.assert_array_equal(frame.component, one.component)
    np.testing.assert_array_equal(frame.inside, one.inside)


def test_the_newest_frame_wins_and_old_ones_stay_as_they_were(block):
    writer, reader = FrameWriter(block), FrameReader(block)
    writer.publish(bodies(5), 1, 0.1)
    first = reader.newest()
    kept = dataclasses.replace(first, position=first.position.copy())
    for k in range(2, 6):
        writer.publish(bodies(5, shift=k), 1, 0.1 * k)
    assert reader.newest().number == 5
    assert reader.newest() is reader.newest()
    np.testing.assert_array_equal(first.position, kept.position)


def test_a_copy_that_the_writer_overtook_is_taken_again(block):
    writer, waiting = FrameWriter(block), [2, 3]

    def overtake():
        if waiting:
            k = waiting.pop(0)
            writer.publish(bodies(4, shift=k), 1, float(k))

    writer.publish(bodies(4), 1, 1.0)
    frame = FrameReader(block, between=overtake).newest()
    assert (frame.number, frame.time) == (3, 3.0)
    np.testing.assert_allclose(frame.position, bodies(4, shift=3).position, rtol=1e-6)


def test_a_writer_that_never_lets_go_leaves_the_last_whole_frame(block):
    writer = FrameWriter(block)
    racing = []
    reader = FrameReader(block, between=lambda: writer.publish(bodies(4, 9), 1, 9.0) if racing else None)
    writer.publish(bodies(4), 1, 1.0)
    whole = reader.newest()
    writer.publish(bodies(4), 1, 2.0)
    racing.append(True)
    assert reader.newest() is whole
