"""An arrow on a slider moves the slider, and not the pour as well; whichever message comes first."""

from types import SimpleNamespace

import pytest

from explorer.viewer import actions
from explorer.viewer.actions import ARROW_WAIT, AT_A_SLIDER, AT_A_SLIDER_WAIT, SliderHands


class Server:
    """What the hands ask of viser's server."""

    def __init__(self):
        self._websock_server = self

    def register_handler(self, kind, handler):
        self.kind, self.handler = kind, handler

    def send(self, value):
        self.handler(0, SimpleNamespace(updates={"value": value}))


class Clock:
    """Time that passes when it is told to, and the timers that end by it."""

    def __init__(self):
        self.now, self.due = 1000.0, []

    def timer(self, wait, act):
        return SimpleNamespace(start=lambda: self.due.append((self.now + wait, act)), daemon=False)

    def pass_by(self, seconds):
        self.now += seconds
        for at, act in [one for one in self.due if one[0] <= self.now]:
            self.due.remove((at, act))
            act()


@pytest.fixture
def page(monkeypatch):
    server, posted, clock = Server(), [], Clock()
    monkeypatch.setattr(actions, "time", SimpleNamespace(monotonic=lambda: clock.now))
    monkeypatch.setattr(actions, "threading", SimpleNamespace(Timer=clock.timer))
    post = SliderHands(server).unless_on_a_slider(posted.append)
    return SimpleNamespace(server=server, posted=posted, post=post, clock=clock)


def test_an_arrow_alone_acts_a_moment_later(page):
    page.post("step")
    page.clock.pass_by(0.9 * ARROW_WAIT)
    assert page.posted == []
    page.clock.pass_by(0.2 * ARROW_WAIT)
    assert page.posted == ["step"]


@pytest.mark.parametrize("first", ["key", "value"])
def test_an_arrow_on_a_slider_does_not(page, first):
    if first == "value":
        page.server.send(0.31)
        page.clock.pass_by(0.1)
    page.post("step")
    if first == "key":
        page.clock.pass_by(0.1)
        page.server.send(0.31)
    page.clock.pass_by(10.0)
    assert page.posted == []
    assert page.clock.due == []


def test_a_slow_browser_is_waited_for_where_a_slider_was_moved_not_long_before(page):
    page.server.send(0.30)
    page.clock.pass_by(0.5 * AT_A_SLIDER)
    page.post("step")
    page.clock.pass_by(0.9 * AT_A_SLIDER_WAIT)
    page.server.send(0.31)
    page.clock.pass_by(10.0)
    assert page.posted == []


def test_a_slider_that_was_moved_before_the_key_does_not_take_it(page):
    page.server.send(0.30)
    page.clock.pass_by(2.0 * ARROW_WAIT)
    page.post("step")
    page.clock.pass_by(1.1 * AT_A_SLIDER_WAIT)
    assert page.posted == ["step"]


@pytest.mark.parametrize("value", [True, "coarse", (1, 2)])
def test_other_inputs_are_no_sliders(page, value):
    page.post("step")
    page.server.send(value)
    page.clock.pass_by(1.1 * ARROW_WAIT)
    assert page.posted == ["step"]


def test_it_listens_to_what_a_browser_sends_when_a_slider_moves(page):
    assert page.server.kind.__name__ == "GuiUpdateMessage"
