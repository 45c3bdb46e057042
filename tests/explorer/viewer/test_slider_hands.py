"""An arrow on a slider moves the slider, and not the pour as well; whichever message comes first."""

import time
from types import SimpleNamespace

import pytest

from explorer.viewer.actions import ARROW_WAIT, SliderHands
from tests.explorer.background.waiting import wait_for


class Server:
    """What the hands ask of viser's server."""

    def __init__(self):
        self._websock_server = self

    def register_handler(self, kind, handler):
        self.kind, self.handler = kind, handler

    def send(self, value):
        self.handler(0, SimpleNamespace(updates={"value": value}))


@pytest.fixture
def page():
    server, posted = Server(), []
    return SimpleNamespace(server=server, posted=posted, post=SliderHands(server).unless_on_a_slider(posted.append))


def test_an_arrow_alone_acts(page):
    page.post("step")
    assert page.posted == []
    wait_for(lambda: page.posted == ["step"])


@pytest.mark.parametrize("first", ["key", "value"])
def test_an_arrow_on_a_slider_does_not(page, first):
    if first == "value":
        page.server.send(0.31)
    page.post("step")
    if first == "key":
        page.server.send(0.31)
    time.sleep(2 * ARROW_WAIT)
    assert page.posted == []


@pytest.mark.parametrize("value", [True, "coarse", (1, 2)])
def test_other_inputs_are_no_sliders(page, value):
    page.post("step")
    page.server.send(value)
    wait_for(lambda: page.posted == ["step"])


def test_it_listens_to_what_a_browser_sends_when_a_slider_moves(page):
    assert page.server.kind.__name__ == "GuiUpdateMessage"
