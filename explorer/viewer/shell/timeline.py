"""The timeline below the page: play, pause, step, go to a moment, speed, also by keys; and what happened when."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import Any

from explorer.live.messages import SessionState, Status
from explorer.units import checked
from explorer.viewer.actions import add_keys
from explorer.viewer.panel import AROUND, Now, PageContext, Panel
from explorer.viewer.pour.readout import PHASE_WORDS, STATE_WORDS, TROUBLE, condition, pace

PLAY_PAUSE, BACK, STEP = "Play / pause (space)", "◀ Back (←)", "Step ▶ (→)"
KEYS: dict[str, Any] = {PLAY_PAUSE: "space", BACK: "arrowleft", STEP: "arrowright"}
MOVING = (SessionState.RUNNING, SessionState.STARTING)
"""States in which the main button pauses; in the others it plays."""
SLOWEST, FASTEST = 0.05, 2.0
"""Range of the speed: simulated seconds per second."""
SPEEDS = (0.05, 0.1, 0.25, 0.5, 1.0, 2.0)
FIRST_MOMENT = 1e-3
"""Time [s] before which no moment but the beginning is kept; longer than one step."""
MOST_EVENTS = 60
"""Events on the timeline at most; older ones are left out."""
PREVIEWED = "recording of this pour, while the solver loads"
LONGEST_EVENT, LONGEST_NOTICE = 120, 400
"""Longest texts of an event and of a notice [characters]."""


class Timeline(Panel):
    """Controls the session; its state is sent to the browsers as one small object."""

    name, tab = "timeline", AROUND

    def __init__(self, page: PageContext) -> None:
        session, post = page.session, page.post
        self._page, self._session = page, session
        self._begins_paused: int | None = None
        """The pour that is to pause as soon as it has started, by its generation."""
        acts = {PLAY_PAUSE: self._toggle, BACK: session.step_back, STEP: session.step}
        page.channel.offer("toggle", lambda _: post(self._toggle))
        page.channel.offer("back", lambda _: post(session.step_back))
        page.channel.offer("step", lambda _: post(session.step))
        page.channel.offer("seek", lambda command: post(partial(self._seek, command.get("time"))))
        page.channel.offer("speed", lambda command: post(partial(self._set_speed, command.get("factor"))))
        add_keys(page.server.gui, acts, KEYS, post)

    def show(self, now: Now) -> None:
        """Send the state of the pour to the browsers."""
        page = self._page
        busy = page.bench_work.busy_with or page.background.busy_with
        state = timeline_state(now, page.recording.state.words, busy)
        page.channel.tell("timeline", {**state, "playing": state["playing"] and not self._waits_to_pause(now.status)})

    def _toggle(self) -> None:
        status = self._session.status()
        if status.state in MOVING and not self._waits_to_pause(status):
            self._session.pause()
            self._begins_paused = status.generation
        else:
            self._session.play()
            self._begins_paused = None

    def _waits_to_pause(self, status: Status) -> bool:
        """Whether a pour that is still starting has been told to pause; it obeys once it has started."""
        return status.state == SessionState.STARTING and self._begins_paused == status.generation

    def _seek(self, wanted: object) -> None:
        """Go back to ``wanted`` [s], with the parameters of that moment; a later moment has to be computed first."""
        status = self._session.status()
        if math.isfinite(status.earliest):
            moment = checked(wanted, 0.0, math.inf, "time")
            if moment < status.time:
                self._session.back_to(max(moment, status.earliest))

    def _set_speed(self, factor: object) -> None:
        self._session.set_speed(checked(factor, SLOWEST, FASTEST, "speed"))


def timeline_state(now: Now, recording: str, busy: str = "") -> Mapping[str, Any]:
    """What the timeline shows; ``recording``: what is being recorded, in a few words, empty if nothing is; ``busy``:
    the same for work beside the pour.
    """
    status = now.status
    # A pour is kept from after its first step on; it began before, and so did what is said of its beginning.
    earliest = status.earliest if status.earliest >= FIRST_MOMENT else 0.0
    mine = [event for event in now.events if event.generation == status.generation and event.time <= status.time]
    return {
        "time": status.time,
        "earliest": min(earliest, status.time),
        "end": status.time,
        "playing": status.state in MOVING,
        "speed": status.speed,
        "speeds": SPEEDS,
        "condition": condition_words(now),
        "trouble": status.state in TROUBLE,
        "recording": recording,
        "notice": now.notice[:LONGEST_NOTICE],
        "busy": f"Busy {busy} …" if busy else "",
        "events": [{"time": event.time, "text": event.text[:LONGEST_EVENT]} for event in mine[-MOST_EVENTS:]],
    }


def condition_words(now: Now) -> str:
    """State, phase and pace of the pour, such as "discharging · 0.42 × real time"."""
    status = now.status
    if now.previewed:
        return PREVIEWED
    words = [STATE_WORDS[status.state] if status.state != SessionState.RUNNING else PHASE_WORDS[status.phase]]
    if word := condition(status):
        words.append(word)
    if status.state == SessionState.RUNNING:
        words.append(f"{pace(status)} × real time")
    return " · ".join(words)
