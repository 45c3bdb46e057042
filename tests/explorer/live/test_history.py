"""The history of a live pour: what is kept within its room, and a pour that goes back and repeats itself."""

import multiprocessing
from types import SimpleNamespace

import numpy as np
import pytest

from explorer.live.details import DetailWriter, detail_reader, shared_details
from explorer.live.frames import FrameReader, FrameWriter, shared_block
from explorer.live.history import History, thinnest
from explorer.live.messages import (
    BackTo,
    Event,
    MovePlate,
    Pause,
    RunTo,
    SessionState,
    SetParameters,
    SetPull,
    Start,
    Status,
    Step,
    StepBack,
)
from solver.pours.disturbance import Pull, Shake, Tap
from solver.pours.record import Outcome
from solver.scenes.scene import value
from tests.explorer.beads import bead_scene

FRICTION = "pair.bead.steel.static_friction"


def moment(time, nbytes=100):
    return SimpleNamespace(time=time, kept=SimpleNamespace(nbytes=nbytes))


def history_of(count, **limits):
    history = History(**limits)
    for k in range(count):
        history.add(moment(0.01 * k))
    return history


def test_it_stays_within_its_room_and_reaches_back_to_the_beginning():
    history = history_of(2000, room=100 * 80)
    times = history.times
    assert len(times) == 80
    assert times[0] == 0.0
    np.testing.assert_allclose(times[-3:], [19.97, 19.98, 19.99])
    gaps, ages = np.diff(times)[:-1], times[-1] - np.array(times[:-2])
    # Gaps grow with age: nowhere a hole that is large for how long ago it is.
    assert (gaps <= np.maximum(0.011, 0.35 * ages)).all()


def test_it_stays_within_its_number():
    assert len(history_of(300, most=50).times) == 50


def test_even_one_that_is_too_large_keeps_the_newest_and_the_first():
    times = history_of(50, room=1).times
    assert (len(times), times[0], times[-1]) == (3, 0.0, 0.49)


def test_the_thinnest_is_neither_the_first_nor_the_last():
    assert thinnest([0.0, 1.0, 1.01, 1.02, 2.0]) == 2


def test_the_last_moment_before_a_time_is_found_and_later_ones_are_forgotten():
    history = history_of(10)
    found, until = history.back_to(0.055, now=0.09)
    assert (found.time, until) == (0.05, 0.055)
    assert history.times[-1] == 0.05


def test_before_the_first_moment_there_is_the_first():
    history = history_of(10)
    assert history.back_to(-1.0, now=0.09)[0].time == 0.0
    assert history.back_to(-1.0, now=0.0) is None
    assert History().back_to(0.0, now=1.0) is None


def test_nothing_is_repeated_across_a_change_of_parameters():
    history = history_of(3)
    history.changed(0.032)
    history.add(moment(0.08))
    assert history.back_to(0.07, now=0.08)[1] == 0.032
    history.changed(0.01)
    # A change at the moment itself is in it.
    assert history_of(3).back_to(0.01, now=0.08)[1] == 0.01


def test_a_moment_replaces_one_of_the_same_time():
    history = history_of(3)
    changed = moment(0.02)
    history.add(changed)
    assert len(history.times) == 3
    assert history.back_to(0.02, now=0.03)[0] is changed


@pytest.fixture
def live(taichi):
    """A live pour of beads that stands still at its beginning, in this process."""
    from explorer.live.live_pour import LivePour, Publisher

    block, reports = shared_block(multiprocessing.get_context("spawn")), []
    details = shared_details(multiprocessing.get_context("spawn"))
    screen = Publisher(FrameWriter(block), DetailWriter(details))
    pour = LivePour(Start(bead_scene(), 1, 1), screen, reports.append)
    pour.obey(Pause())
    return SimpleNamespace(pour=pour, reports=reports, reader=FrameReader(block), details=detail_reader(details))


def run(live, seconds):
    """Step on by ``seconds`` of simulated time, whatever the clock; the frame and the status at the end."""
    live.pour.obey(Step(seconds))
    while live.pour.seconds_to_wait() is not None:
        live.pour.advance()
    return live.reader.newest(), live.pour.status()


def test_going_back_and_on_ends_in_the_same_bits(live):
    first, begun = run(live, 0.4)
    again, _ = run(live, 0.2)
    live.pour.obey(StepBack(0.2))
    back = live.pour.status()
    assert (back.state, back.time) == (SessionState.PAUSED, begun.time)
    assert (back.kinetic_energy, back.bodies) == (begun.kinetic_energy, begun.bodies)
    np.testing.assert_array_equal(live.reader.newest().position, first.position)
    repeated, _ = run(live, 0.2)
    assert repeated.time == again.time
    np.testing.assert_array_equal(repeated.position, again.position)
    np.testing.assert_array_equal(repeated.quaternion, again.quaternion)


def test_moments_asked_for_one_after_the_other_are_moments_of_the_pour(live):
    """Two clicks on the timeline before the first is answered; steps back would add up."""
    first, begun = run(live, 0.3)
    run(live, 0.2)
    live.pour.obey(BackTo(begun.time + 0.1))
    live.pour.obey(BackTo(begun.time))
    assert (live.pour.status().state, live.pour.status().time) == (SessionState.PAUSED, begun.time)
    np.testing.assert_array_equal(live.reader.newest().position, first.position)
    live.pour.obey(BackTo(begun.time + 0.1))
    assert live.pour.status().time == begun.time


def test_a_step_forward_and_one_back_lead_to_the_same_moment(live):
    run(live, 0.3)
    live.pour.obey(Step(0.0043))  # a moment between two of decision
    while live.pour.seconds_to_wait() is not None:
        live.pour.advance()
    before = live.pour.status()
    run(live, 0.01)
    live.pour.obey(StepBack(0.01))
    assert live.pour.status().time == before.time


def test_moments_that_were_thinned_out_are_run_again(live):
    live.pour._history = History(room=1)
    first, begun = run(live, 0.4)
    run(live, 0.2)
    live.pour.obey(StepBack(0.2))
    assert len(live.pour._history.times) < 4
    assert live.pour.status().time == begun.time
    np.testing.assert_array_equal(live.reader.newest().position, first.position)


def test_going_back_past_a_change_of_parameters_undoes_it_and_says_so(live):
    run(live, 0.2)
    live.pour.obey(SetParameters({FRICTION: 0.05}))
    changed = live.pour.status()
    run(live, 0.01)
    live.pour.obey(StepBack(0.01))
    # Back at the moment of the change itself: it stays.
    assert (live.pour.status().time, value(live.pour.status().scene, FRICTION)) == (changed.time, 0.05)
    live.reports.clear()
    live.pour.obey(StepBack(0.01))
    status = live.pour.status()
    assert value(status.scene, FRICTION) == 0.3
    assert status.energy_put_in is None
    assert [report.text for report in live.reports if isinstance(report, Event)] == [
        "static friction bead–steel 0.05 → 0.3"
    ]
    assert isinstance(live.reports[-1], Status)


def test_a_pour_that_is_on_its_way_to_a_moment_runs_until_it_is_there(live):
    live.pour.obey(RunTo(0.1))
    assert live.pour.status().state == SessionState.RUNNING
    while live.pour.seconds_to_wait() is not None:
        live.pour.advance()
    assert live.pour.status().state == SessionState.PAUSED
    live.pour.obey(Step(0.1))
    assert live.pour.status().state == SessionState.RUNNING
    live.pour.obey(Pause())
    assert live.pour.status().state == SessionState.PAUSED


def test_a_pile_at_rest_can_be_brought_back_too(live):
    _, rest = run(live, 5.0)
    assert rest.state == SessionState.ENDED
    live.pour.obey(StepBack(0.1))
    status = live.pour.status()
    assert (status.state, status.outcome) == (SessionState.PAUSED, Outcome.RUNNING)
    assert status.time == pytest.approx(rest.time - 0.1, abs=status.dt)
    assert run(live, 5.0)[1].time == rest.time


def test_before_the_beginning_there_is_nothing(live):
    run(live, 0.05)
    assert live.pour.status().earliest < 1e-4
    live.pour.obey(StepBack(10.0))
    assert live.pour.status().time == live.pour.status().earliest
    live.reports.clear()
    live.pour.obey(StepBack(0.01))
    assert [report.text for report in live.reports if isinstance(report, Event)] == [
        "this is the earliest moment that is kept"
    ]


SHAKE = Shake(amplitude=2e-3, frequency=20.0, periods=4)


def events(live):
    found = [report for report in live.reports if isinstance(report, Event)]
    live.reports.clear()
    return found


def test_a_shake_is_an_event_wakes_the_pile_and_comes_to_rest_again(live):
    _, rest = run(live, 5.0)
    assert not rest.disturbed
    live.reports.clear()
    live.pour.obey(MovePlate(SHAKE))
    shaken = live.pour.status()
    assert shaken.state in (SessionState.RUNNING, SessionState.PAUSED)
    assert (shaken.disturbed, shaken.disturbance) == (True, str(SHAKE))
    assert [(event.time, event.text, event.is_order) for event in events(live)] == [(rest.time, str(SHAKE), True)]
    _, after = run(live, 5.0)
    assert after.state == SessionState.ENDED
    assert (after.disturbed, after.disturbance) == (True, "")
    assert after.time > rest.time + SHAKE.duration


def test_back_into_a_shake_repeats_its_bits_and_back_past_it_there_was_none(live):
    run(live, 0.5)
    still = live.pour.status()
    live.pour.obey(MovePlate(SHAKE))
    first, _ = run(live, 0.1)
    again, _ = run(live, 0.05)
    live.pour.obey(StepBack(0.05))
    assert live.pour.status().disturbance == str(SHAKE)
    np.testing.assert_array_equal(live.reader.newest().position, first.position)
    repeated, _ = run(live, 0.05)
    np.testing.assert_array_equal(repeated.position, again.position)
    np.testing.assert_array_equal(repeated.surfaces, again.surfaces)
    live.pour.obey(StepBack(live.pour.status().time - still.time + 0.05))
    back = live.pour.status()
    assert (back.disturbed, back.disturbance) == (False, "")
    frame, _ = run(live, 0.3)
    np.testing.assert_array_equal(frame.surfaces[0, :3], 0.0)


def test_a_pull_lasts_until_it_is_let_go_and_is_undone_by_going_back(live):
    before, rest = run(live, 5.0)
    live.pour.obey(Pause())  # the step of 5 s is over
    live.pour.obey(SetPull(Pull(0, (0.0, 0.0, 0.1))))  # a bead weighs 22 mN
    lifted, held = run(live, 0.05)
    assert "body no. 1 is pulled with (0, 0, 100) mN" in held.disturbance
    # Height a t²/2 with a = F/m - g, from rest.
    rise = lifted.position[0, 2] - before.position[0, 2]
    assert rise == pytest.approx(0.5 * (0.1 / (22.18e-3 / 9.81) - 9.81) * (held.time - rest.time) ** 2, rel=0.03)
    live.pour.obey(SetPull(None))
    assert live.pour.status().disturbance == ""
    live.pour.obey(StepBack(0.02))
    assert "body no. 1 is pulled" in live.pour.status().disturbance
    live.pour.obey(StepBack(0.2))
    assert live.pour.status().disturbance == ""


def test_what_is_refused_is_an_event_and_changes_nothing(live):
    run(live, 0.3)
    live.pour.obey(MovePlate(SHAKE))
    live.reports.clear()
    live.pour.obey(MovePlate(Tap(1e-3, 0.02)))
    live.pour.obey(SetPull(Pull(999, (0.0, 0.0, 0.1))))
    texts = [event.text for event in events(live)]
    assert texts[0] == "refused: the plate is already moving; wait until it stops"
    assert texts[1].startswith("refused: pull: there is no body 1000; ")
    assert live.pour.status().disturbance == str(SHAKE)
