"""Tap, shake and pull: what the boxes say reaches the solver in SI, and is told with its peaks."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest

from explorer.errors import CommandError
from explorer.scene.source import material_source
from explorer.viewer.panel import Now
from explorer.viewer.pour.disturb_panel import TOPMOST, DisturbPanel, topmost
from solver.pours.disturbance import Pull, Shake, Tap
from tests.explorer.viewer.page_session import PageSession, frame_of, page_context

SOURCE = material_source("sunflower_extract")
PLACES = np.array([[0.0, 0.0, 0.01], [0.0, 0.02, 0.03], [0.3, 0.0, 0.2], [0.0, 0.0, 0.5]])


@pytest.fixture
def panel(server):
    return DisturbPanel(page_context(server, PageSession(SOURCE)))


def told(panel, **status):
    panel.show(Now(replace(panel._session.now, **status), frame_of([0] * 4, PLACES, [True, True, True, False])))
    return re.sub(r"<[^>]*>", " ", panel._text.content)


def test_boxes_in_mm_ms_and_hz_become_si(panel):
    panel._up.value, panel._time.value = 2.0, 50.0
    panel._to.value, panel._hertz.value, panel._periods.value = 1.0, 30.0, 6
    panel._tap()
    panel._shake()
    tap, shake = panel._session.asked
    assert (tap.amplitude, tap.duration) == (pytest.approx(2e-3), pytest.approx(0.05))
    assert shake == Shake(1e-3, 30.0, 6)
    assert isinstance(tap, Tap)


def test_the_motions_are_told_with_their_peaks_and_what_is_done_now(panel):
    said = told(panel)
    # 1 mm in 30 ms: π A/T and 2 π² A/T².
    assert (
        f"up to {math.pi * 1e-3 / 0.03:.3g} m/s and {2 * math.pi**2 * 1e-3 / 0.03**2 / 9.80665:.3g} × gravity" in said
    )
    assert "± 1.5 mm at 15 Hz, 10 periods; up to 0.141 m/s and 1.36 × gravity" in said
    assert "Now" not in said
    assert "Now: body 3 is pulled." in told(panel, disturbance="body 3 is pulled")


def test_the_body_on_top_is_pulled_unless_another_one_is_named(panel):
    told(panel)
    panel._force.value = 5.0
    panel._pull()
    assert panel._body.value == TOPMOST
    panel._body.value, panel._direction.value = 3, "against x"
    panel._pull()
    first, second = panel._session.asked
    assert (first.body, first.force) == (1, pytest.approx((0.0, 0.0, 5e-3)))
    assert (second.body, second.force) == (2, pytest.approx((-5e-3, 0.0, 0.0)))
    assert isinstance(first, Pull)


def test_nobody_to_pull_and_a_number_out_of_range_are_refused(panel):
    with pytest.raises(CommandError, match="no body"):
        topmost(None)
    panel._up.value = math.nan
    with pytest.raises(ValueError, match="finite"):
        panel._tap()
    assert "finite" in told(panel)
    assert panel._session.asked == []
