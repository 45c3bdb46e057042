"""Tap, shake and pull: what the boxes say reaches the solver in SI, and is told with its peaks."""

import math
from dataclasses import replace

import numpy as np
import pytest

from explorer.scene.source import material_source
from explorer.viewer.actions import Actions
from explorer.viewer.panel import Now
from explorer.viewer.pour.disturb_panel import TOPMOST, DisturbPanel
from solver.pours.disturbance import Pull, Shake, Tap
from tests.explorer.viewer.page_session import PageSession, frame_of, page_context
from tests.explorer.viewer.person import Person

SOURCE = material_source("sunflower_extract")
PLACES = np.array([[0.0, 0.0, 0.01], [0.0, 0.02, 0.03], [0.3, 0.0, 0.2], [0.0, 0.0, 0.5]])


class Bench:
    """The panel with a person at it."""

    def __init__(self, server):
        self.session, actions = PageSession(SOURCE), Actions()
        with server.gui.add_folder("Tap, shake, pull") as place:
            self.panel = DisturbPanel(page_context(server, self.session, actions.post))
        self.person = Person(place, actions.carry_out)

    def told(self, **status):
        """What stands there once the pile is on the plate."""
        frame = frame_of([0] * 4, PLACES, [True, True, True, False])
        self.panel.show(Now(replace(self.session.now, **status), frame))
        return self.person.text


@pytest.fixture
def bench(server):
    return Bench(server)


def test_boxes_in_mm_ms_and_hz_become_si(bench):
    for label, number in (
        ("Tap: up [mm]", 2.0),
        ("Tap: time [ms]", 50.0),
        ("Shake: ± [mm]", 1.0),
        ("Shake: f [Hz]", 30.0),
        ("Shake: periods", 6),
    ):
        bench.person.enter(label, number)
    assert bench.person.press("Tap") == bench.person.press("Shake") == ""
    tap, shake = bench.session.asked
    assert (tap.amplitude, tap.duration) == (pytest.approx(2e-3), pytest.approx(0.05))
    assert shake == Shake(1e-3, 30.0, 6)
    assert isinstance(tap, Tap)


def test_the_motions_are_told_with_their_peaks_and_what_is_done_now(bench):
    said = bench.told()
    # 1 mm in 30 ms: π A/T and 2 π² A/T².
    assert (
        f"up to {math.pi * 1e-3 / 0.03:.3g} m/s and {2 * math.pi**2 * 1e-3 / 0.03**2 / 9.80665:.3g} × gravity" in said
    )
    assert "± 1.5 mm at 15 Hz, 10 periods; up to 0.141 m/s and 1.36 × gravity" in said
    assert "Now" not in said
    assert "Now: body 3 is pulled." in bench.told(disturbance="body 3 is pulled")


def test_the_body_on_top_is_pulled_unless_another_one_is_named(bench):
    bench.told()
    bench.person.enter("Pull: force [mN]", 5.0)
    assert bench.person.press("Pull") == ""
    assert bench.person.value("Pull: body") == TOPMOST
    bench.person.enter("Pull: body", 3)
    bench.person.enter("Pull: direction", "against x")
    assert bench.person.press("Pull") == ""
    assert bench.person.press("Let go") == ""
    first, second, let_go = bench.session.asked
    assert (first.body, first.force) == (1, pytest.approx((0.0, 0.0, 5e-3)))
    assert (second.body, second.force) == (2, pytest.approx((-5e-3, 0.0, 0.0)))
    assert isinstance(first, Pull)
    assert let_go is None


def test_nobody_to_pull_and_a_number_out_of_range_are_refused(bench):
    assert bench.person.press("Pull") == "pull: no body has entered yet"
    bench.person.send("Tap: up [mm]", math.nan)
    assert "finite" in bench.person.press("Tap")
    assert "finite" in bench.told()
    assert bench.session.asked == []
