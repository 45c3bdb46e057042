"""What people asked for is told to every browser, and by whom."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from viser._messages import GuiUpdateMessage

from explorer.background.command_process import CommandStatus
from explorer.live.messages import Event, SessionState, Status
from explorer.viewer.page import OrderEvents, People
from tests.explorer.beads import bead_scene

STATUS = Status(SessionState.RUNNING, "", bead_scene(), seed=7, generation=1, speed=1.0, time=0.4)


class Study:
    def __init__(self):
        self.state = "idle"

    def status(self):
        return CommandStatus(self.state)


def test_another_pour_is_an_order_and_the_first_is_not():
    orders = OrderEvents({})
    assert list(orders.of_the_pour(STATUS)) == []
    assert list(orders.of_the_pour(STATUS)) == []
    (event,) = orders.of_the_pour(replace(STATUS, generation=2, time=0.0))
    assert (event.generation, event.is_order, event.is_change) == (2, True, False)
    assert event.text == "poured anew: funnel, seed 7"


@pytest.mark.parametrize(
    ("state", "asked"),
    [("running", True), ("paused", True), ("cancelled", True), ("finished", False), ("failed", False)],
)
def test_a_study_is_told_once_per_state_and_ends_by_itself(state, asked):
    study = Study()
    orders = OrderEvents({"study": study})
    assert list(orders.in_the_background(STATUS)) == []
    study.state = state
    assert list(orders.in_the_background(STATUS)) == [Event(1, 0.4, f"study: {state}", is_order=asked)]
    assert list(orders.in_the_background(STATUS)) == []


def people(browsers, handed_on=lambda made: None):
    """With so many browsers, the second of which has just moved a control; ``handed_on``: what viser does with it."""
    handlers = {GuiUpdateMessage: [lambda client, message: handed_on(made)]}
    server = SimpleNamespace(
        get_clients=lambda: dict.fromkeys(range(browsers)),
        on_client_connect=lambda act: act,
        _websock_server=SimpleNamespace(_incoming_handlers=handlers),
    )
    made = People(server)
    for handler in handlers[GuiUpdateMessage]:
        handler(1, None)
    return made


def test_who_acted_is_known_before_viser_hands_the_act_on():
    """The page's loop may carry it out at once, in its own thread."""
    signed = []
    people(2, lambda made: signed.append(made.signed(Event(1, 0.4, "friction", is_change=True)).text))
    assert signed == ["friction · browser 2"]


def test_an_order_is_signed_and_what_happens_by_itself_is_not():
    order, ending = Event(1, 0.0, "poured anew", is_order=True), Event(1, 0.0, "at rest")
    assert people(2).signed(order).text == "poured anew · browser 2"
    assert people(2).signed(ending) == ending
    assert people(1).signed(order) == order


def test_a_change_that_comes_back_late_is_its_browser_s_and_one_from_the_timeline_nobody_s():
    change = Event(1, 0.2, "static friction 0.5 → 0.6", is_change=True)
    made = people(2)
    assert made.signed(change).text.endswith(" · browser 2")
    made.acted_in_the_frame()
    assert made.signed(change) == change
