"""Where a replay stands, by the clock, by steps, and at its ends."""

import numpy as np
import pytest

from explorer.viewer.replay.replay_page import Timeline

TIMES = np.array([0.0, 0.02, 0.05, 0.10])


def test_it_plays_at_its_speed_and_stops_at_the_end():
    timeline = Timeline(TIMES)
    timeline.speed = 0.5
    timeline.pass_by(0.08)
    assert (timeline.time, timeline.playing) == (pytest.approx(0.04), True)
    timeline.pass_by(10.0)
    assert (timeline.time, timeline.playing) == (0.10, False)
    timeline.pass_by(10.0)
    assert timeline.time == 0.10


def test_play_at_the_end_begins_anew():
    timeline = Timeline(TIMES)
    timeline.go_to(5.0)
    timeline.playing = False
    timeline.toggle()
    assert (timeline.time, timeline.playing) == (0.0, True)
    timeline.toggle()
    assert not timeline.playing


@pytest.mark.parametrize(
    ("start", "frames", "expected"),
    [(0.02, 1, 0.05), (0.02, -1, 0.0), (0.03, 1, 0.05), (0.03, -1, 0.02), (0.10, 1, 0.10), (0.0, -1, 0.0)],
)
def test_steps_go_to_frames_also_from_between_two(start, frames, expected):
    timeline = Timeline(TIMES)
    timeline.go_to(start)
    timeline.step(frames)
    assert (timeline.time, timeline.playing) == (expected, False)


def test_a_single_frame_stands_still():
    timeline = Timeline(np.array([0.3]))
    timeline.pass_by(1.0)
    assert (timeline.time, timeline.playing) == (0.3, False)
