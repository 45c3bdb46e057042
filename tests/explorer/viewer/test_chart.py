"""What the charts draw: spread, energy, contacts, and changes of parameters as marks."""

import math
from dataclasses import replace

import numpy as np
import pytest

from explorer.live.messages import Event, SessionState
from explorer.viewer.panel import Now
from explorer.viewer.pour.chart import (
    LEGEND_INTERVAL,
    MOST_LETTERS,
    MOST_MARKS,
    NO_MARKS,
    Chart,
    Marks,
    PourCurves,
    change_label,
    change_times,
    with_marks,
)
from explorer.viewer.pour.motion_chart import MotionChart, MotionHistory
from solver.observables.observable import Value
from tests.explorer.viewer.page_session import page_context
from tests.explorer.viewer.person import Person
from tests.explorer.viewer.test_texts import STATUS

FRICTION = "pair.bead.bead.static_friction: 0.3 → 0.1"


def change(time, text=FRICTION, generation=1):
    return Event(generation, time, text, is_change=True)


def test_changes_of_this_pour_are_marked_once_a_moment():
    events = [change(0.5), change(0.5, "b: 1 → 2"), change(0.2), Event(1, 0.7, "at rest"), change(0.9, generation=2)]
    assert change_times(events, 1) == (0.2, 0.5)
    many = [change(0.01 * k) for k in range(3 * MOST_MARKS)]
    assert change_times(many, 1) == pytest.approx(tuple(0.01 * k for k in range(2 * MOST_MARKS, 3 * MOST_MARKS)))


def test_the_legend_tells_the_last_change_old_and_new():
    assert change_label([Event(1, 0.7, "at rest")], 1) == NO_MARKS
    assert (
        change_label([change(0.2, "a: 1 → 2"), change(0.5), change(0.5, "b")], 1) == f"0.50 s {FRICTION} (and 1 more)"
    )
    long = change_label([change(1.0, "x" * 200 + ": 1 → 2")], 1)
    assert long.endswith("x: 1 → 2")
    assert len(long) == len("1.00 s ") + MOST_LETTERS


def test_the_legend_is_not_renewed_with_every_step_of_a_drag():
    marks, drag = Marks(), [change(0.1 * k, f"a: 1 → {k}") for k in range(5)]
    assert marks.new_label([], 1, 0.0) is None
    assert marks.new_label(drag[:1], 1, 0.0) == "0.00 s a: 1 → 0"
    assert marks.new_label(drag[:3], 1, 0.3) is None
    assert marks.new_label(drag, 1, LEGEND_INTERVAL) == "0.40 s a: 1 → 4"
    assert marks.new_label(drag, 1, 9.0) is None
    # The moments are marked at once.
    assert marks.take(drag[:3], 1)
    assert not marks.take(drag[:3], 1)
    assert marks.times == pytest.approx((0.0, 0.1, 0.2))


def test_a_mark_is_a_spike_and_bends_no_curve():
    time, late = np.array([0.0, 1.0, 2.0]), np.array([math.nan, 10.0, 20.0])
    moments, level, curve, mark = with_marks((time, np.array([0.0, 5.0, 10.0]), late), (1.5,))
    assert moments[mark == 1].tolist() == [1.5]
    assert mark.sum() == 1
    assert level == pytest.approx(5.0 * moments)
    assert np.isnan(curve).tolist() == (moments < 1.0).tolist()
    assert curve[moments >= 1.0] == pytest.approx(10.0 * moments[moments >= 1.0])


def test_a_mark_beyond_the_last_point_leaves_no_gap_in_a_full_curve():
    moments, curve, mark = with_marks((np.array([0.0, 1.0]), np.array([3.0, 4.0])), (2.0,))
    assert np.isfinite(curve).all()
    assert moments[mark == 1].tolist() == [2.0]


def test_the_angle_is_drawn_between_its_spread():
    history = PourCurves()
    history.add(STATUS)
    wider = {"angle_of_repose_deg": Value(3.0, "deg", 5.0)}
    history.add(replace(STATUS, time=2.5, observables=wider))
    time, low, high, angle, _, mark = history.drawn((2.0,))
    ends = [0, len(time) - 1]
    assert angle[ends] == pytest.approx([23.44, 3.0])
    assert high[ends] == pytest.approx([26.65, 8.0])
    assert low[ends] == pytest.approx([20.23, 0.0])
    assert mark.sum() == 1


def test_energy_and_contacts_follow_the_statuses_and_begin_again():
    history = MotionHistory()
    assert not history.add(replace(STATUS, state=SessionState.STARTING, time=9.0, generation=0))
    for time, energy, contacts in ((1.0, 2e-3, 4), (2.0, 1e-3, 8), (2.0, 1e-3, 8)):
        drawn = history.add(replace(STATUS, time=time, kinetic_energy=energy, contacts=contacts))
    assert not drawn
    time, energy, contacts, _ = history.drawn(())
    assert (time.tolist(), energy.tolist(), contacts.tolist()) == ([1.0, 2.0], [2.0, 1.0], [4.0, 8.0])
    # The pour was set back: what came later is gone.
    assert history.add(replace(STATUS, time=1.5, kinetic_energy=5e-3, contacts=1))
    assert history.drawn(())[0].tolist() == [1.0, 1.5]
    assert history.add(replace(STATUS, generation=2, time=0.1))
    assert history.drawn(())[0].tolist() == [0.1]


def placed(server, kind):
    """A chart on the page, and the curves that a person sees there."""
    with server.gui.add_folder("chart") as place:
        chart = kind(page_context(server))
    (curves,) = Person(place).curves
    return chart, curves


def test_the_spread_is_a_band_between_its_ends(server):
    _, curves = placed(server, Chart)
    (band,) = curves.bands
    assert [curves.series[k]["label"] for k in band["series"]] == ["+ spread", "− spread over flanks"]


@pytest.mark.parametrize("kind", [Chart, MotionChart])
def test_a_change_reaches_both_charts_of_the_page(server, kind):
    chart, curves = placed(server, kind)
    chart.show(Now(STATUS))
    assert curves.data[-1].sum() == 0
    chart.show(Now(STATUS, events=[change(1.2)]))
    assert curves.data[0][curves.data[-1] == 1].tolist() == [1.2]
    assert curves.series[-1]["label"] == f"1.20 s {FRICTION}"
