"""Motion between the frames of a recording: closed forms for bodies that fall, leave and come."""

from dataclasses import replace

import numpy as np
import pytest

from explorer.recordings.recording import Component, Instances, Recording, Shape
from explorer.viewer.replay.recorded_frames import QUANTITIES, RecordedFrames, first_seen, mean_speeds, tells_who_is_who

STEP, G = 0.02, 9.81
SHAPE = Shape("bead", np.zeros((3, 3), np.float32), np.array([[0, 1, 2]], np.uint32), (1, 2, 3), 1.0)


def instances(place, height):
    """Bodies above one another, heights in single precision as in a file."""
    n = len(place)
    position = np.zeros((n, 3), np.float32)
    position[:, 2] = height
    quaternion = np.tile(np.float32([1, 0, 0, 0]), (n, 1))
    return Instances(position, quaternion, np.ones(n, np.float32), np.array(place, dtype=np.int64))


def recording(*frames):
    times = STEP * np.arange(len(frames))
    return Recording(times, (Component(SHAPE, times, frames),), (), {}, (), "", "")


FALLING = recording(*(instances([0], 1.0 - 0.5 * G * (STEP * k) ** 2) for k in range(6)))
LEAVING = recording(
    instances([0, 1], [0.0, 0.0]),
    instances([0, 1, 2], [0.0, 0.1, 5.0]),
    instances([1, 2], [0.2, 5.0]),
    instances([], []),
    instances([1], [0.0]),
)


def test_a_central_difference_of_a_parabola_is_its_speed():
    (falling,) = FALLING.components
    for k in range(1, 5):
        # Rounding of two heights of 1 m in single precision, over two steps.
        assert mean_speeds(falling, STEP * k) == pytest.approx([G * STEP * k], abs=1.2e-7 / STEP)
    # One-sided at the ends: the mean over half the time.
    assert mean_speeds(falling, 0.0) == pytest.approx([0.5 * G * STEP], abs=1.2e-7 / STEP)
    assert mean_speeds(falling, 9.0) == pytest.approx([4.5 * G * STEP], abs=1.2e-7 / STEP)
    assert mean_speeds(falling, 1.7 * STEP) == mean_speeds(falling, STEP)


def test_speeds_stay_with_their_bodies_when_others_leave_and_come():
    (leaving,) = LEAVING.components
    expected = [[0.0, 0.1], [0.0, 0.1, 0.0], [0.1, 0.0], [], [np.nan]]
    for k, steps in enumerate(expected):
        # A distance per step, single precision.
        np.testing.assert_allclose(mean_speeds(leaving, STEP * k), np.array(steps) / STEP, rtol=1e-6, atol=1e-5)


def test_a_last_frame_that_is_there_twice_keeps_its_speed():
    (falling,) = FALLING.components
    twice = replace(
        falling, times=np.append(falling.times, falling.times[-1]), frames=(*falling.frames, falling.frames[-1])
    )
    assert mean_speeds(twice, 9.0) == mean_speeds(falling, 9.0)


def test_bodies_are_there_since_their_first_frame():
    np.testing.assert_allclose(first_seen(LEAVING.components[0]), [0.0, 0.0, STEP])
    frames = RecordedFrames(LEAVING)
    motion = frames.motion(frames.number_at(2.5 * STEP))
    np.testing.assert_allclose(QUANTITIES["residence time"].shown(motion), [2 * STEP, STEP])
    np.testing.assert_allclose(QUANTITIES["speed"].shown(motion), [0.1 / STEP, 0.0], rtol=1e-6)


def test_frames_hold_what_was_recorded():
    frames = RecordedFrames(LEAVING)
    assert [frames.number_at(time) for time in (-1.0, 0.0, 0.5 * STEP, STEP, 9.0)] == [1, 1, 1, 2, 5]
    frame = frames.frame(2)
    assert (frame.number, frame.time) == (2, STEP)
    assert frame.position[:, 2] == pytest.approx([0.0, 0.1, 5.0])
    assert frame.component.tolist() == [0, 0, 0]
    assert frames.frame(4).position.shape == (0, 3)


def test_a_file_that_does_not_say_who_is_who_has_no_quantities():
    (bodies,) = FALLING.components
    old = replace(FALLING, components=(replace(bodies, frames=tuple(replace(f, place=None) for f in bodies.frames)),))
    assert tells_who_is_who(FALLING)
    assert not tells_who_is_who(old)
    frames = RecordedFrames(old)
    assert not frames.quantities
    assert "older" in frames.note
    assert "contact forces" in RecordedFrames(FALLING).note
    assert np.isnan(mean_speeds(old.components[0], STEP)).all()
