"""Work off the page's loop: one thing at a time, and what must not be lost waits for its turn."""

import threading

import pytest

from explorer.errors import CommandError
from explorer.viewer.actions import Actions, BackgroundWork, OwnAction
from tests.explorer.viewer.page_session import finished


def refused():
    raise CommandError("no such file")


@pytest.mark.parametrize(("first", "told"), [(lambda: "spheres", ["spheres", "pour"]), (refused, ["pour"])])
def test_a_link_that_comes_while_spheres_are_fitted_is_read_afterwards(first, told):
    actions, gate, done = Actions(), threading.Event(), []
    work = BackgroundWork(actions.post)

    def fitting():
        assert gate.wait(60.0)
        return first()

    work.start("fitting spheres", fitting, done.append)
    with pytest.raises(CommandError, match="wait until this is done: fitting spheres"):
        work.start("reading the link", lambda: "lost", done.append)
    work.start_when_free("reading the link", lambda: "pour", done.append)
    assert work.busy_with == "fitting spheres"
    gate.set()
    line = finished(actions, work)
    assert done == told
    assert ("no such file" in line) == (first is refused)


def test_work_that_is_begun_by_what_was_done_comes_before_what_waits():
    actions, gate, done = Actions(), threading.Event(), []
    work = BackgroundWork(actions.post)
    work.start("fitting", lambda: gate.wait(60.0), lambda _: work.start("saving", lambda: "saved", done.append))
    work.start_when_free("reading the link", lambda: "pour", done.append)
    gate.set()
    finished(actions, work)
    assert done == ["saved", "pour"]


def test_what_the_page_does_by_itself_does_not_take_a_refusal_back():
    actions = Actions()
    actions.post(refused)
    actions.post(OwnAction(lambda: None))
    assert actions.carry_out() == "no such file"
    actions.post(OwnAction(lambda: None))
    assert actions.carry_out() is None
    actions.post(OwnAction(refused))
    assert actions.carry_out() == "no such file"
    actions.post(lambda: None)
    assert actions.carry_out() == ""
