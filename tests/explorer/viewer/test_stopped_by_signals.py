"""A signal that comes while the page waits ends it."""

import signal

from explorer.viewer.app import stopped_by_signals


def test_a_signal_that_finds_the_event_locked_stops_all_the_same():
    with stopped_by_signals() as stop:
        with vars(stop)["_cond"]:  # as inside stop.wait
            signal.raise_signal(signal.SIGTERM)
        assert stop.wait(60.0)
