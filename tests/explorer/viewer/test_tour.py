"""The tour leads from window to window, and what it names is on the page."""

from types import SimpleNamespace

from explorer.viewer.panels import PANELS
from explorer.viewer.tour import open_stop, ways

STOPS = [kind.stop for kind in PANELS.values() if kind.stop is not None]


def test_every_window_can_be_left_and_the_way_leads_through_all():
    seen, k = [], 0
    while k is not None:
        seen.append(k)
        assert None in dict(ways(k, len(STOPS) - 1)).values()
        assert k == 0 or dict(ways(k, len(STOPS) - 1))["Back"] == k - 1
        k = ways(k, len(STOPS) - 1)[0][1]
    assert seen == list(range(len(STOPS)))


def test_a_button_closes_its_window_and_opens_the_next(server):
    modal = open_stop(server.gui, STOPS, 0)
    opened = []
    close = modal.close
    modal.close = lambda: (opened.append("closed"), close())
    buttons = [
        child for child in modal._children.values() if getattr(getattr(child, "_impl", None), "props", None) is not None
    ]
    (forward,) = [child for child in buttons if getattr(child, "label", "") == "Next"]
    (callback,) = forward._impl.update_cb
    before = set(server.gui._modal_handle_from_uuid)
    callback(SimpleNamespace(client=None, client_id=0, target=forward))
    after = set(server.gui._modal_handle_from_uuid)
    assert opened == ["closed"]
    assert len(after - before) == 1
