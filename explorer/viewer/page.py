"""The page: one loop that takes actions, asks the session, and passes its state to the panels, which do the rest.

Several browsers share one pour. viser tells a callback who moved a control, but a change comes back from the solver's
process later, on a busy machine much later. So every message of a browser is noted as it arrives, and a change is
attributed to the browser that sent one last. What users asked for apart from parameters (another pour, a study, a
diagnosis) becomes an event that every browser sees. The handlers are private names of viser; therefore viser is pinned
and a test watches them.
"""

from __future__ import annotations

import os
import threading
import time
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from typing import Any

import viser
from viser import _messages

from explorer.background.command_process import PourPlace
from explorer.background.orders import BackgroundOrders
from explorer.diagnosis.process import DiagnosisProcess
from explorer.live.frames import Frame
from explorer.live.messages import Event, SessionState, Status
from explorer.live.preview import load_preview
from explorer.live.session import Session
from explorer.project.project import Project
from explorer.scene.presets import data_folder
from explorer.study.process import StudyProcess
from explorer.viewer.actions import Actions, FrameClock, refusal
from explorer.viewer.guarded_server import GuardedServer
from explorer.viewer.output.recording_switch import Recorder
from explorer.viewer.panel import OFTEN, SELDOM, TABS, Now, PageContext, Panel, Place
from explorer.viewer.panels import PANELS
from explorer.viewer.pour.readout import not_later
from explorer.viewer.shell.channel import ShellChannel
from explorer.viewer.shell.web_pages import WebPages
from explorer.viewer.view import DARK, apply_theme, light

ACTS = (_messages.GuiUpdateMessage, _messages.CommandTriggerMessage)
"""Messages by which a user acts."""
ASKED_FOR = ("running", "paused", "cancelled")
"""States of a command that a user brings about; it reaches the others by itself."""
EVENTS_REMEMBERED = 1000
CONTROLS_WIDTH, STUDY_WIDTH = 320, 560
"""Widths of the panels right and left of the scene [px]; a browser may draw them wider."""
FRAME_INTERVAL = 1.0 / 36.0
"""Seconds between two checks for a new frame: 30 a second are promised, and some are late or bring nothing new."""


class Page:
    """What a browser sees of ``session``, which must have been started."""

    def __init__(
        self,
        server: GuardedServer,
        session: Session,
        project: Project,
        study: StudyProcess,
        diagnosis: DiagnosisProcess,
        channel: ShellChannel,
        pages: WebPages,
        recorders: Sequence[Recorder] = (),
        place: PourPlace | None = None,
    ) -> None:
        self._server, self._session, self._recorders = server, session, tuple(recorders)
        self._events: deque[Event] = deque(maxlen=EVENTS_REMEMBERED)
        self._actions, self._people = Actions(), People(server)
        channel.on_command(self._people.acted_in_the_frame)
        self._orders = OrderEvents({"diagnosis": diagnosis, "study": study})
        begun = session.status()
        self._notice, self._time = "", begun.time
        self._preview = load_preview(begun.scene, begun.seed)
        self._preview_since: float | None = None
        light(server)
        bar = server.gui.add_html("", visible=False)
        post = self._actions.post
        self._channel = channel
        self._context = PageContext(
            server, session, post, study, diagnosis, data_folder(), bar, project, channel, pages, place or PourPlace()
        )
        self.panels = {panel.name: panel for panel in self._made()}
        """Panels by name, in their order on the page."""
        self._due = dict.fromkeys((OFTEN, SELDOM, *(panel.every for panel in self.panels.values())), 0.0)
        channel.tell("keys", named_keys(server.gui))
        channel.offer("theme", lambda _: post(self._switch_theme))
        self._dark = not DARK
        self._switch_theme()

    def _made(self) -> Iterator[Panel]:
        """Make the panels of this page, each in its place."""
        gui, kinds = self._server.gui, [kind for kind in PANELS.values() if kind.offered(self._context)]
        controls, study = gui.add_tab_group(), self._context.study_panel
        gui.main_panel.dock_right()
        gui.main_panel.set_width(CONTROLS_WIDTH)
        study.dock_left()
        study.set_width(STUDY_WIDTH)
        study.minimize()
        for tab in dict.fromkeys((*TABS, *(kind.tab for kind in kinds))):
            mine = [kind for kind in kinds if kind.tab == tab]
            place = {Place.CONTROLS: controls, Place.STUDY: study}.get(tab.place)
            with place.add_tab(tab.name) if place is not None and mine else nullcontext():
                for kind in mine:
                    with gui.add_folder(kind.title, expand_by_default=not kind.folded) if kind.title else nullcontext():
                        yield kind(self._context)

    def _switch_theme(self) -> None:
        self._dark = not self._dark
        apply_theme(self._server, self._dark)
        self._channel.tell("theme", {"dark": self._dark})
        for panel in self.panels.values():
            panel.set_dark(self._dark)

    def close(self) -> None:
        """End what panels have started: a second pour, and a recording, with a complete file."""
        for panel in self.panels.values():
            panel.close()
        self._context.tables.close()

    def run(self, stop: threading.Event) -> None:
        """Keep the page up to date until ``stop`` is set."""
        frames = FrameClock(FRAME_INTERVAL)
        while not stop.is_set():
            notice = self._actions.carry_out()
            self._notice = self._notice if notice is None else self._without_folder(notice)
            frame = self._session.frame()
            status = self._session.status()
            happened = (*self._session.new_events(), *self._orders.of_the_pour(status))
            self._events.extend(map(self._people.signed, happened))
            self._forget_what_comes_later(status)
            preview = None if frame is not None else self._previewed(status)
            if frame is not None:
                # Before drawing: a playback keeps the messages to browsers and the time between them.
                self._record(frame, status)
            with self._server.atomic():
                now = Now(status, frame or preview, self._events, self._notice, preview is not None)
                self._show(now, notice is not None or bool(happened))
            frames.wait(stop)

    def _without_folder(self, notice: str) -> str:
        """``notice`` with an uploaded file named as in the lists: its folder means nothing to the user who sent it."""
        return notice.replace(f"{self._context.uploads}{os.sep}", "")

    def _record(self, frame: Frame, status: Status) -> None:
        """Hand on what is shown; a recorder that cannot continue (its folder is gone) is reported and dropped."""
        for recorder in (*self._recorders, self._context.recording):
            try:
                recorder.take(frame, status)
            except (ValueError, OSError) as error:
                self._notice = f"the recording has ended: {refusal(error)}"
                self._recorders = tuple(one for one in self._recorders if one is not recorder)

    def _previewed(self, status: Status) -> Frame | None:
        """A frame of the recording of exactly this pour, while the solver loads."""
        if self._preview is None or status.state != SessionState.STARTING or status.generation != 1:
            return None
        if self._preview_since is None and not self._server.get_clients():
            return None  # it begins when somebody is watching
        self._preview_since = self._preview_since or time.monotonic()
        return self._preview.frame(time.monotonic() - self._preview_since, status.generation)

    def _forget_what_comes_later(self, status: Status) -> None:
        if status.time < self._time:  # brought back, or another pour
            self._events = deque(not_later(self._events, status), maxlen=EVENTS_REMEMBERED)
        self._time = status.time

    def _show(self, now: Now, news: bool) -> None:
        """Let all panels draw, and let those show that are due."""
        panels, began = self.panels.values(), time.monotonic()
        for panel in panels:
            panel.draw(now)
        for every, due in self._due.items():
            # A change that the solver has applied is shown at once: a user is moving the slider.
            if began < due and not (news and every <= OFTEN):
                continue
            self._due[every] = began + every
            if every == SELDOM:
                self._events.extend(map(self._people.signed, self._orders.in_the_background(now.status)))
            for panel in panels:
                if panel.every == every:
                    panel.show(now)


def named_keys(gui: viser.GuiApi) -> list[tuple[str, str]]:
    """Keys of the page's commands, with what they do."""
    commands = [handle._impl.props for handle in gui._command_handle_from_uuid.values()]
    return [("+".join(key if isinstance(key, tuple) else (key,)), one.label) for one in commands if (key := one.hotkey)]


class People:
    """Browsers, numbered from 1 in the order in which they came; a number is never given twice."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._last: int | None = None
        for kind in ACTS:
            # Before viser's own handler, which passes the act to the page's loop: by then it must be known who acted.
            server._websock_server._incoming_handlers.setdefault(kind, []).insert(0, self._acted)

        @server.on_client_connect
        def _(client: viser.ClientHandle) -> None:
            if self.present > 1:
                client.add_notification(
                    f"You are browser {browser_number(client.client_id)}",
                    f"{self.present} browsers are at this page, with the same pour.",
                    auto_close_seconds=8.0,
                )

    @property
    def present(self) -> int:
        """Number of browsers at the page."""
        return len(self._server.get_clients())

    def signed(self, event: Event) -> Event:
        """``event``; a change or an order gets the browser after its text if there are several."""
        if not (event.is_change or event.is_order) or self.present < 2 or self._last is None:
            return event
        return replace(event, text=f"{event.text} · browser {self._last}")

    def acted_in_the_frame(self) -> None:
        """A command came from the state line or the timeline, whose channel does not know viser's browsers."""
        self._last = None

    def _acted(self, client_id: int, message: Any) -> None:
        self._last = browser_number(client_id)


def browser_number(client_id: int) -> int:
    """What a browser is called."""
    return client_id + 1


class OrderEvents:
    """Reports what has changed since the last call; ``commands``: name → what runs in the background."""

    def __init__(self, commands: Mapping[str, BackgroundOrders]) -> None:
        self._commands = dict(commands)
        self._states = {name: command.status().state for name, command in self._commands.items()}
        self._generation: int | None = None

    def of_the_pour(self, status: Status) -> Iterator[Event]:
        """A pour other than at the last call; the first one was not ordered by anybody."""
        before, self._generation = self._generation, status.generation
        if before not in (None, status.generation):
            text = f"poured anew: {status.scene.rig.name}, seed {status.seed}"
            yield Event(status.generation, 0.0, text, is_order=True)

    def in_the_background(self, status: Status) -> Iterator[Event]:
        """Commands whose state differs from that at the last call."""
        for name, command in self._commands.items():
            before, now = self._states[name], command.status().state
            self._states[name] = now
            if now != before:
                yield Event(status.generation, status.time, f"{name}: {now}", is_order=now in ASKED_FOR)
