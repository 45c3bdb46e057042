import pytest

from explorer.live.throttle import FRAME_WALL, LAUNCH_WALL, Throttle


def driven(speed, dt, cost, seconds):
    """Let a pour with the given cost of a step [s] run for ``seconds`` of wall time; returns it and the times."""
    pace, wall, time, longest = Throttle(speed), 100.0, 5.0, 0.0
    pace.restart(wall, time)
    while wall < 100.0 + seconds:
        wait = pace.wait(wall, time)
        if wait > 0.0:
            wall += wait
            continue
        steps = pace.steps(dt)
        took = steps * cost
        wall, time = wall + took, time + steps * dt
        longest = max(longest, took)
        pace.launched(steps, took, wall, time)
    return pace, wall - 100.0, time - 5.0, longest


def test_a_fast_pour_keeps_to_the_wanted_speed():
    pace, wall, time, _ = driven(speed=0.5, dt=1e-5, cost=1e-6, seconds=4.0)
    # One launch may be under way at either end.
    assert time == pytest.approx(0.5 * wall, abs=2 * 0.5 * FRAME_WALL)
    assert pace.real_time_factor == pytest.approx(0.5, rel=2 * FRAME_WALL)


@pytest.mark.parametrize(
    ("cost", "seconds", "capped"), [(1e-6, 4.0, False), (4e-5, 4.0, True), (4e-5, 0.2, False), (1e-6, 0.2, False)]
)
def test_a_pour_that_cannot_keep_the_wanted_speed_says_so_but_not_in_its_first_moments(cost, seconds, capped):
    assert driven(speed=0.5, dt=1e-5, cost=cost, seconds=seconds)[0].capped == capped


def test_a_slow_pour_runs_without_a_break_and_says_how_fast():
    pace, wall, time, _ = driven(speed=1.0, dt=5e-6, cost=20e-6, seconds=4.0)
    assert time / wall == pytest.approx(0.25, rel=1e-6)
    assert pace.real_time_factor == pytest.approx(0.25, rel=1e-6)


@pytest.mark.parametrize("cost", [1e-6, 2e-5, 1e-3])
def test_launches_are_short(cost):
    _, _, _, longest = driven(speed=1.0, dt=5e-6, cost=cost, seconds=1.0)
    # 20 steps are launched before anything is known; after that the aim holds.
    assert longest <= max(LAUNCH_WALL * (1 + 1e-9), 20 * cost)


def test_a_stall_is_not_caught_up():
    pace = Throttle(1.0)
    pace.restart(0.0, 0.0)
    pace.launched(10, 3.0, 3.0, 0.001)
    assert pace.wait(3.0, 0.001) == 0.0


def test_a_new_speed_counts_from_now():
    pace, _, _, _ = driven(speed=2.0, dt=1e-5, cost=1e-6, seconds=1.0)
    pace.speed = 0.1
    pace.restart(50.0, 1.0)
    assert pace.wait(50.0, 1.0) == 0.0
    assert pace.wait(50.0, 1.001) == pytest.approx(0.01)
    assert pace.real_time_factor == 0.0
