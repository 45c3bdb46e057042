"""One solver process for the whole file: starting one and compiling takes seconds."""

import contextlib
import dataclasses
import math
import os
import signal
import subprocess
import sys
import time

import pytest

from explorer.live.frames import MAX_BODIES
from explorer.live.messages import SessionState
from explorer.live.session import SPEED_RANGE, Session, SessionError
from solver.params import ParameterError
from solver.pours.record import Outcome, Phase
from solver.scenes.scene import value, with_values
from solver.scenes.time_step import time_step
from solver.shapes.solid import Solid
from tests.explorer.background.waiting import wait_for
from tests.explorer.beads import MASS, bead_scene

"""Seconds that a process may take to start and compile on a busy machine."""
FRICTION = "pair.bead.steel.static_friction"
SHEAR_MODULUS = "material.glass.shear_modulus"


def wait_for_state(session, *states):
    wait_for(lambda: session.status().state in states)
    return session.status()


def take_a_step(session):
    """Step, and return the status at the end of it: a step comes in parts, and every part is told."""
    begun = session.status()
    session.step()
    end = begun.time + begun.scene.numerics.sample_interval - 1e-5 * begun.dt  # but for rounding
    return wait_for(lambda: session.status().time >= end and session.status())


@pytest.fixture(scope="module")
def process():
    session = Session()
    yield session
    session.close()


@pytest.fixture
def session(process):
    """A pour that has just begun and stands still."""
    # Slow until the pause is heard: at full speed a busy machine hears of it some sample intervals too late. Where no
    # process runs that could be told the speed, a new one has to compile, and finds the pause when that is done.
    with contextlib.suppress(SessionError):
        process.set_speed(SPEED_RANGE[0])
    process.start(bead_scene(), seed=1)
    process.pause()
    wait_for_state(process, SessionState.PAUSED)
    process.set_speed(1.0)
    process.new_events()
    return process


def test_a_pour_runs_to_rest(session):
    session.set_speed(10.0)
    session.play()
    status = wait_for_state(session, SessionState.ENDED)
    assert status.outcome == Outcome.NO_HEAP  # six beads
    assert status.phase == Phase.AT_REST
    assert status.bodies == status.bodies_planned == 6
    assert status.discharged_mass == pytest.approx(status.poured_mass)
    assert status.poured_mass == pytest.approx(6 * MASS)
    wait_for(lambda: session.frame().time == status.time)
    frame = session.frame()
    assert frame.position.shape == (6, 3)
    assert frame.position[:, 2].max() < status.scene.rig.outlet_height
    assert [event.text for event in session.new_events()] == ["no heap: no body lies still on the plate"]
    assert session.new_events() == ()


def test_a_slider_reaches_the_pour_and_is_told_old_and_new(session):
    session.set_parameters({FRICTION: 0.05, SHEAR_MODULUS: "20MPa"})
    status = wait_for(lambda: value(session.status().scene, FRICTION) == 0.05 and session.status())
    assert value(status.scene, SHEAR_MODULUS) == 20e6
    events = session.new_events()
    assert [event.text for event in events] == [
        "shear modulus glass 10 MPa → 20 MPa",
        "static friction bead–steel 0.3 → 0.05",
    ]
    assert all(event.is_change for event in events)


def test_a_stiffer_material_takes_shorter_steps(session):
    before = session.status().dt
    session.set_parameters({SHEAR_MODULUS: 4e7})
    after = wait_for(lambda: session.status().dt < before and session.status().dt)
    assert after == time_step(with_values(bead_scene(), {SHEAR_MODULUS: 4e7}))


def test_a_pile_at_rest_moves_when_friction_goes(session):
    session.set_speed(10.0)
    session.play()
    rest = wait_for_state(session, SessionState.ENDED)
    session.set_parameters({FRICTION: 0.0})
    wait_for(lambda: session.status().time > rest.time)


def test_pausing_stops_time_and_a_step_is_one_sample_interval(session):
    first = session.status().time
    time.sleep(0.1)
    assert session.status().time == first
    take_a_step(session)
    time.sleep(0.1)
    status = session.status()
    assert status.state == SessionState.PAUSED
    # Time goes in steps of dt: it stops at the first that reaches the end (but for rounding), not one launch later.
    assert first + 0.01 - 1e-5 * status.dt <= status.time < first + 0.01 + status.dt


def test_a_pause_shows_the_moment_that_it_tells(session):
    """Frames are published 60 times a second: without one of its own, a pause would show an earlier moment."""
    for _ in range(5):
        session.play()
        going = session.status().time
        wait_for(lambda going=going: session.status().time > going)
        session.pause()
        wait_for(lambda: session.status().state == SessionState.PAUSED)
        wait_for(lambda: session.frame().time == session.status().time)


def test_a_step_back_leads_to_where_the_step_began(session):
    session.set_speed(0.1)  # slow enough that every step comes in parts
    first = take_a_step(session)
    second = take_a_step(session)
    session.step_back()
    status = wait_for(lambda: session.status().time < second.time and session.status())
    assert (status.state, status.time) == (SessionState.PAUSED, first.time)
    assert status.earliest < 0.01
    wait_for(lambda: session.frame().time == first.time)


def test_steps_asked_for_in_a_row_are_all_taken(session):
    first = session.status().time
    session.set_speed(0.1)  # slow enough that the second and third come while the first runs
    for _ in range(3):
        session.step()
    wait_for(lambda: session.status().time >= first + 0.03 - 1e-6)
    time.sleep(0.1)
    assert session.status().time < first + 0.03 + 3 * session.status().dt


def test_energy_is_told_after_a_change_only_and_the_sums_of_a_moment_are_told(session):
    assert session.status().energy_put_in is None
    session.set_parameters({FRICTION: 0.05})
    wait_for(lambda: session.status().energy_put_in is not None)
    session.step()
    status = wait_for(lambda: session.status().kinetic_energy > 0.0 and session.status())
    # At the first moment of decision one bead is in; it falls, and touches nothing. The sums are of that moment, not of
    # the time that the status tells: a launch may have run before the fixture's pause came in.
    assert status.entered_mass == pytest.approx(MASS)
    assert status.contacts == 0
    speed = status.scene.insertion.drop_speed + 9.81 * status.scene.numerics.sample_interval
    assert status.kinetic_energy == pytest.approx(0.5 * MASS * speed**2, rel=0.01)


def test_time_does_not_outrun_the_wanted_speed(session):
    session.set_speed(0.1)
    session.play()
    begin, wall = session.status().time, time.monotonic()
    time.sleep(0.7)
    status = session.status()
    elapsed = time.monotonic() - wall
    assert 0.0 < status.time - begin <= 0.1 * elapsed + 0.1 / 60 + 1e-3
    assert 0.0 < status.real_time_factor < 0.13


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({FRICTION: math.nan}, "not a finite number"),
        ({FRICTION: 7.5}, "outside 0 … 3"),
        ({FRICTION: "much"}, "not a number"),
        ({"pair.bead.wood.static_friction": 0.1}, "no such pair"),
        ({"rig.mass": 0.02}, "on restart only"),
        ({SHEAR_MODULUS: "3mm"}, "unit"),
    ],
)
def test_a_bad_value_is_refused_and_changes_nothing(session, values, words):
    before = session.status().scene
    with pytest.raises(ParameterError, match=words):
        session.set_parameters({SHEAR_MODULUS: 2e7} | values)
    time.sleep(0.05)
    assert session.status().scene == before


@pytest.mark.parametrize("factor", [math.nan, 0.0, -1.0, math.inf])
def test_a_bad_speed_is_refused(session, factor):
    with pytest.raises(SessionError, match="speed"):
        session.set_speed(factor)


def test_a_scene_with_too_many_bodies_is_refused(session):
    heavy = bead_scene(MAX_BODIES + 1)
    with pytest.raises(ParameterError, match=r"rig\.mass"):
        session.restart(heavy)


def test_a_restart_begins_a_new_pour_with_the_parameters_in_force(session):
    session.set_parameters({FRICTION: 0.05})
    wait_for(lambda: value(session.status().scene, FRICTION) == 0.05)
    before = session.status().generation
    session.restart(seed=7)
    assert session.frame() is None
    status = wait_for_state(session, SessionState.RUNNING)
    assert (status.generation, status.seed) == (before + 1, 7)
    assert value(status.scene, FRICTION) == 0.05
    assert wait_for(session.frame).generation == before + 1


def test_the_same_seed_pours_the_same_bits(session):
    pictures = []
    for _ in range(2):
        session.restart(bead_scene(3), seed=5)
        session.set_speed(10.0)
        end = wait_for_state(session, SessionState.ENDED).time
        pictures.append(wait_for(lambda: session.frame().time == end and session.frame()))  # noqa: B023
    assert pictures[0].time == pictures[1].time
    assert (pictures[0].position == pictures[1].position).all()


def test_a_solver_error_is_a_state_with_a_message(session):
    scene = bead_scene()
    # Only the solver fits spheres to a solid, so only there does it show that there is no such resolution.
    odd = dataclasses.replace(scene.bodies[0], shape=Solid("sphere", (0.012,)), spheres="odd")
    session.restart(dataclasses.replace(scene, bodies=(odd,)))
    status = wait_for_state(session, SessionState.FAILED)
    assert status.message.startswith("the solver stopped: ")


def test_a_killed_process_is_a_state_and_a_restart_brings_a_new_one(session):
    first = session.process_id
    os.kill(first, signal.SIGKILL)
    status = wait_for_state(session, SessionState.DIED)
    assert "exit code -9" in status.message
    with pytest.raises(SessionError, match="exit code -9"):
        session.play()
    session.restart()
    wait_for_state(session, SessionState.RUNNING)
    assert session.process_id not in (None, first)


def test_nothing_can_be_asked_before_a_start():
    with pytest.raises(SessionError, match="no pour"):
        Session().status()


def test_closing_ends_the_process(session):
    number = session.process_id
    session.close()
    assert session.status().state == SessionState.CLOSED
    assert not alive(number)


def test_the_solver_ends_when_its_parent_is_killed():
    program = (
        "import time\n"
        "from explorer.live.session import Session\n"
        "from tests.explorer.beads import bead_scene\n"
        "if __name__ == '__main__':\n"
        "    session = Session()\n"
        "    session.start(bead_scene(), 1)\n"
        "    print(session.process_id, flush=True)\n"
        "    time.sleep(60)\n"
    )
    parent = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True)
    number = int(parent.stdout.readline())
    assert alive(number)
    parent.kill()
    parent.communicate()
    wait_for(lambda: not alive(number))


def test_the_page_process_never_loads_taichi():
    program = "import sys, explorer.viewer.app, explorer.live.session; print('taichi' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def alive(number):
    """Whether a process of that number runs; one that is over but not yet collected does not."""
    try:
        with open(f"/proc/{number}/stat") as stat:  # noqa: PTH123
            return stat.read().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False
