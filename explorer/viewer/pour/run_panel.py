"""Play, pause, step, step back, restart, speed; by mouse and by key."""

from __future__ import annotations

from typing import Any

import viser

from explorer.live.messages import SessionState
from explorer.units import checked
from explorer.viewer.actions import SliderHands, add_keys, button_group
from explorer.viewer.panel import POUR, PageContext, Panel
from explorer.viewer.tour import Stop

PLAY_PAUSE, BACK, STEP, RESTART = "Play / pause (space)", "◀ Back (←)", "Step ▶ (→)", "Restart (R)"
KEYS: dict[str, Any] = {PLAY_PAUSE: "space", RESTART: "R"}
ARROWS: dict[str, Any] = {BACK: "arrowleft", STEP: "arrowright"}
SLOWEST, FASTEST = 0.05, 2.0
"""Range of the speed slider: simulated seconds per second."""


class RunPanel(Panel):
    """Buttons and keys that act on the pour as a whole."""

    name, tab = "run", POUR
    stop = Stop(
        "The pour",
        "Bodies fall through the funnel and pile up, computed while you watch. **Space** pauses and plays, the **right "
        "arrow** goes on by 10 ms and the **left arrow** back, **R** pours anew. Drag to turn the view, scroll to come "
        "closer.\n\n"
        "The big number is the angle of repose of the pile as it lies, ± its spread over the flanks. The lines below "
        "it say what the solver is doing, and how fast compared with real time.",
    )

    def __init__(self, page: PageContext) -> None:
        server, session, post = page.server, page.session, page.post
        self._session = session
        acts = {PLAY_PAUSE: self._toggle, BACK: session.step_back, STEP: session.step, RESTART: session.restart}
        button_group(
            server.gui,
            "Pour",
            acts,
            post,
            hint="Back goes by a sample interval (10 ms), to the parameters of that time as well; step goes on by one; "
            "restart pours anew with the same seed. Arrows on a slider move the slider only.",
        )

        add_keys(server.gui, acts, KEYS, post)
        add_keys(server.gui, acts, ARROWS, SliderHands(server).unless_on_a_slider(post))
        speed = server.gui.add_slider(
            "Speed",
            SLOWEST,
            FASTEST,
            SLOWEST,
            1.0,
            hint="Simulated seconds per second that the solver aims at; it goes as fast as it can up to that.",
        )

        @speed.on_update
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                value = event.target.value
                post(lambda: session.set_speed(checked(value, SLOWEST, FASTEST, "speed")))

    def _toggle(self) -> None:
        if self._session.status().state == SessionState.PAUSED:
            self._session.play()
        else:
            self._session.pause()
