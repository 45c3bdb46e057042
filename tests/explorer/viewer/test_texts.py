"""Readout, chart and study panel: what is shown for a given state."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from explorer.background.command_process import CommandStatus
from explorer.live.frames import Frame
from explorer.live.messages import Event, SessionState, Status
from explorer.outcomes import OUTCOME_SENTENCES
from explorer.viewer.palette import BODY_COLOURS, linear
from explorer.viewer.pour.chart import MOST_POINTS, PourCurves
from explorer.viewer.pour.readings_panel import readings_html, time_step_text
from explorer.viewer.pour.readout import (
    FORMING,
    PHASE_WORDS,
    STATE_WORDS,
    VOID,
    AngleDoubt,
    condition,
    not_later,
    pace,
    readout_html,
)
from explorer.viewer.pour.standing_panel import notes, recent
from explorer.viewer.scene_nodes import component_poses
from explorer.viewer.study.process_view import escaped, progress, time_left
from solver.observables.observable import Value
from solver.pours.record import Outcome, Phase
from tests.explorer.beads import bead_scene

STATUS = Status(
    state=SessionState.RUNNING,
    message="",
    scene=bead_scene(),
    seed=1,
    generation=1,
    speed=1.0,
    real_time_factor=0.336,
    phase=Phase.PILE,
    time=1.5,
    dt=6.19e-6,
    bodies=5,
    bodies_planned=6,
    discharged_mass=0.0113,
    poured_mass=0.01357,
    energy_put_in=2.5e-6,
    observables={
        "angle_of_repose_deg": Value(23.44, "deg", 3.21),
        "angle_of_repose_left_deg": Value(21.0, "deg"),
        "angle_of_repose_right_deg": Value(math.nan, "deg"),
    },
)


def test_the_readout_tells_what_the_solver_said():
    text = readout_html(STATUS) + readings_html(STATUS)
    for part in ("settling", "1.500 s", "0.34 of 1 wanted", "6.19 µs", "5 of 6", "11.3 of 13.6 g", "2.5 µJ"):
        assert part in text
    assert "23.4°" in text
    assert "SD over flanks 3.2°" in text
    assert "class='dot'" in text
    assert "class='dot'" not in readout_html(STATUS, by_component=False)
    assert "left 21.0°" in text
    assert "right –" in text


@pytest.mark.parametrize(("factor", "said"), [(0.336, "0.34"), (1.0, "1.00"), (0.0043, "0.004"), (0.0, "0")])
def test_a_slow_pour_is_not_said_to_stand(factor, said):
    assert pace(replace(STATUS, real_time_factor=factor)) == said


def test_the_time_step_is_told_against_its_limit():
    assert time_step_text(STATUS) == "6.19 µs"
    assert time_step_text(replace(STATUS, dt_limit=4 * STATUS.dt)) == "6.19 µs, 25% of the stability limit"


@pytest.mark.parametrize(
    ("now", "word"),
    [
        ({}, ""),
        ({"capped": True}, "slow"),
        ({"state": SessionState.ENDED, "outcome": Outcome.AT_REST}, "at rest"),
        ({"state": SessionState.ENDED, "outcome": Outcome.JAMMED}, "jammed"),
        ({"state": SessionState.ENDED, "outcome": Outcome.NO_HEAP}, "no heap"),
        ({"state": SessionState.ENDED, "outcome": Outcome.OBSTRUCTED}, "obstructed"),
        ({"state": SessionState.ENDED, "outcome": Outcome.NON_FINITE}, "unstable"),
        ({"state": SessionState.ENDED, "outcome": Outcome.OVERLAP_LIMIT}, "unstable"),
    ],
)
def test_how_the_pour_stands_is_said_in_a_word(now, word):
    status = replace(STATUS, **now)
    assert condition(status) == word
    pill = f">{word}</span>" if word else "class='condition"
    assert (pill in readout_html(status)) == bool(word)


def test_what_has_not_happened_yet_is_not_told():
    events = [Event(1, 1.0, "a"), Event(1, 2.0, "b"), Event(2, 9.0, "c")]
    assert [event.text for event in not_later(events, replace(STATUS, time=1.0))] == ["a", "c"]


def test_every_state_phase_and_outcome_has_words():
    assert set(STATE_WORDS) == set(SessionState)
    assert set(PHASE_WORDS) == set(Phase)
    assert set(OUTCOME_SENTENCES) == set(Outcome)


def test_texts_from_outside_cannot_bring_html():
    evil = "<img src=x onerror=alert(1)>"
    scene = replace(STATUS.scene, bodies=(replace(STATUS.scene.bodies[0], name=evil),))
    status = replace(STATUS, message=f"{evil} 3", scene=scene)
    text = readout_html(status)
    assert "<img" not in text
    assert text.count("&lt;img") == 1


def test_events_of_one_moment_take_one_line_and_the_newest_comes_first():
    events = [Event(1, 0.5, f"change {k}") for k in range(9)] + [Event(1, 0.7, "at rest"), Event(2, 0.1, "later")]
    assert recent(events, 1) == "0.700 s  at rest"
    assert recent(events[:9], 1) == "0.500 s  change 8 (and 8 more)"
    assert recent(events, 3) == ""


def test_a_number_that_means_nothing_yet_is_not_shown():
    before = replace(STATUS, observables={}, energy_put_in=None)
    text = readout_html(before) + readings_html(before)
    assert "Energy" not in text
    assert "from 25% of the mass below the outlet on" in text
    # A change that put nothing in is told as such.
    assert "0 µJ" in readings_html(replace(STATUS, energy_put_in=0.0))
    starting = readings_html(replace(before, state=SessionState.STARTING))
    assert "µs" not in starting
    assert OUTCOME_SENTENCES[Outcome.RUNNING] not in starting


def test_nothing_is_said_twice():
    jammed = replace(STATUS, message="4.1 g stay in the funnel")
    events = [Event(1, 1.5, "jammed: 4.1 g stay in the funnel")]
    assert notes(jammed, events, "") == ["1.500 s  jammed: 4.1 g stay in the funnel"]
    assert notes(jammed, [], jammed.message) == [jammed.message]


def test_the_chart_has_the_mass_from_the_start_and_the_angle_where_it_was_read():
    history = PourCurves()
    read = STATUS.observables
    for time, mass, observed in ((0.0, 0.0, {}), (1.0, 4e-3, {}), (2.0, 8e-3, read), (3.0, 9e-3, read)):
        assert history.add(replace(STATUS, time=time, discharged_mass=mass, observables=observed))
    later = {"angle_of_repose_deg": Value(25.44, "deg")}
    assert history.add(replace(STATUS, time=4.0, discharged_mass=10e-3, observables=later))
    assert not history.add(replace(STATUS, time=4.0, discharged_mass=10e-3, observables=later))
    time, angle, mass = history.columns()
    assert time.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert mass.tolist() == pytest.approx([0.0, 4.0, 8.0, 9.0, 10.0])
    # At 3 s nothing was read anew: a point of the line between its neighbours, no step.
    assert angle.tolist() == pytest.approx([math.nan, math.nan, 23.44, 24.44, 25.44], nan_ok=True)


def test_the_chart_begins_again_with_a_new_pour():
    history = PourCurves()
    history.add(STATUS)
    assert history.add(replace(STATUS, generation=2, time=0.2, observables={}))
    time, angle, _ = history.columns()
    assert time.tolist() == [0.2]
    assert np.isnan(angle).all()


def test_the_chart_goes_back_with_the_pour():
    history = PourCurves()
    readings = [{"angle_of_repose_deg": Value(20.0 + k, "deg")} for k in range(5)]
    for k, read in enumerate(readings):
        history.add(replace(STATUS, time=1.0 + k, observables=read, discharged_mass=1e-3 * k))
    back = replace(STATUS, time=3.5, observables=readings[2], discharged_mass=2.4e-3)
    assert history.add(back)
    time, angle, mass = history.columns()
    assert time.tolist() == [1.0, 2.0, 3.0, 3.5]
    assert angle[:3].tolist() == [20.0, 21.0, 22.0]
    assert mass[-1] == pytest.approx(2.4)
    # Standing still draws nothing new; going on does, and takes the angle up again.
    assert not history.add(back)
    assert history.add(replace(back, time=4.0, observables={"angle_of_repose_deg": Value(30.0, "deg")}))
    assert history.columns()[1][-1] == 30.0


def test_a_long_chart_is_thinned_out():
    history = PourCurves()
    for k in range(5 * MOST_POINTS):
        read = {"angle_of_repose_deg": Value(20.0 + 1e-3 * k, "deg")}
        history.add(replace(STATUS, time=1.0 + k, observables=read))
    time = history.columns()[0]
    assert len(time) <= 2 * MOST_POINTS
    assert np.isfinite(history.columns()[1]).sum() > MOST_POINTS / 4
    assert time[0] == 1.0
    assert time[-1] > 5 * MOST_POINTS - 20
    assert (np.diff(time) > 0).all()


def test_bodies_that_have_not_entered_or_have_left_are_hidden():
    frame = Frame(
        number=1,
        generation=1,
        time=0.0,
        position=np.arange(12, dtype=np.float32).reshape(4, 3),
        quaternion=np.tile(np.float32([0, 1, 0, 0]), (4, 1)),
        component=np.array([1, 0, 1, 1], dtype=np.int32),
        inside=np.array([True, True, False, True]),
        scale=np.float32([0.5, 1.0, 1.0, 2.0]),
    )
    poses = component_poses(frame, 1, 5)
    assert poses.scale.tolist() == [0.5, 0, 2, 0, 0]
    assert poses.position[:3].tolist() == [[0, 1, 2], [6, 7, 8], [9, 10, 11]]
    assert poses.quaternion.tolist() == [[0, 1, 0, 0]] * 3 + [[1, 0, 0, 0]] * 2


def test_components_have_colours_that_differ():
    assert len(set(BODY_COLOURS)) == len(BODY_COLOURS)
    assert linear((0, 255, 128))[:2] == (0, 255)
    # 255 · (128/255)^2.2 = 55.98
    assert linear((0, 255, 128))[2] == 56


@pytest.mark.parametrize(
    ("seconds", "text"), [(None, "–"), (math.nan, "–"), (7.4, "7 s"), (125, "2 min 05 s"), (-1, "–")]
)
def test_time_left(seconds, text):
    assert time_left(seconds) == text


def test_progress_is_a_share():
    assert progress(CommandStatus("running", done=7, planned=28)) == 0.25
    assert progress(CommandStatus("running", done=30, planned=28)) == 1.0
    assert progress(CommandStatus("idle")) == 0.0


def test_text_from_a_command_brings_no_markdown():
    assert escaped("a\n# b") == r"a \# b"


def read(time, angle, spread=2.0, phase=Phase.PILE, outcome=Outcome.RUNNING):
    found = {"angle_of_repose_deg": Value(angle, "deg", spread)}
    return replace(STATUS, time=time, phase=phase, outcome=outcome, observables=found)


def test_an_angle_forms_until_it_stands_within_its_own_spread():
    angle = AngleDoubt()
    # While bodies still come down, however steady it looks and however wide its spread is.
    assert {angle.doubt(read(0.1 * k, 33.4, 28.3, Phase.DISCHARGE)) for k in range(20)} == {FORMING}
    falling = [angle.doubt(read(2.0 + 0.1 * k, 30.0 - 2.0 * k)) for k in range(8)]
    assert set(falling) == {FORMING}
    standing = [angle.doubt(read(2.8 + 0.1 * k, 16.0 + 0.1 * k)) for k in range(8)]
    assert standing[0] == FORMING
    assert standing[-1] == ""
    # Friction is taken away and it flows apart.
    assert [angle.doubt(read(3.6 + 0.1 * k, 16.0 - 1.5 * k)) for k in range(1, 5)][-1] == FORMING


def test_an_end_decides_at_once_and_a_step_back_forgets_what_came_later():
    angle = AngleDoubt()
    assert angle.doubt(read(1.0, 20.0)) == FORMING
    assert angle.doubt(read(1.1, 20.0, outcome=Outcome.AT_REST)) == ""
    assert angle.doubt(read(1.1, 20.0, outcome=Outcome.JAMMED)) == VOID
    for k in range(6):
        angle.doubt(read(2.0 + 0.1 * k, 20.0))
    assert angle.doubt(read(2.6, 24.0)) == FORMING
    assert angle.doubt(read(2.55, 20.5)) == ""
    assert angle.doubt(replace(read(2.6, 20.5), generation=2)) == FORMING


def test_an_angle_in_doubt_is_small_and_says_why():
    forming = readout_html(STATUS, doubt=FORMING)
    assert re.search(r"class='doubt'>[\d.–°]+ · forming<", forming)
    assert "class='big'" not in forming
    assert "class='big'" in readout_html(STATUS)
    assert "before: 16.9°, one pour each" in readout_html(STATUS, former=16.9)
    assert "before" not in readout_html(STATUS)
