"""The page: one loop that takes actions, asks the session, and shows the panels what there is. They do the rest."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Iterator
from contextlib import nullcontext

import viser

from explorer.diagnosis.process import DiagnosisProcess
from explorer.files.user_data import data_folder
from explorer.live.messages import Event, Status
from explorer.session import Session
from explorer.study.process import StudyProcess
from explorer.viewer.actions import Actions
from explorer.viewer.frame_clock import FrameClock
from explorer.viewer.orders import Orders
from explorer.viewer.output.recording_switch import Recorder
from explorer.viewer.panel import OFTEN, SELDOM, TABS, Now, PageContext, Panel
from explorer.viewer.panels import PANELS
from explorer.viewer.people import People
from explorer.viewer.pour.readout import not_later
from explorer.viewer.theme import DARK, ThemeSwitch, apply_theme
from explorer.viewer.tour import Tour
from explorer.viewer.view import light

EVENTS_REMEMBERED = 1000

FRAME_INTERVAL = 1.0 / 36.0
"""Seconds between two looks at the newest frame: 30 a second are promised, and some come late or bring nothing new."""


class Page:
    """What a browser sees of ``session``, which must have been started."""

    def __init__(
        self,
        server: viser.ViserServer,
        session: Session,
        study: StudyProcess | None,
        diagnosis: DiagnosisProcess,
        recorder: Recorder | None = None,
    ) -> None:
        self._server, self._session, self._recorder = server, session, recorder
        self._events: deque[Event] = deque(maxlen=EVENTS_REMEMBERED)
        self._actions, self._people = Actions(), People(server)
        self._orders = Orders({"diagnosis": diagnosis} | ({} if study is None else {"study": study}))
        self._notice, self._time = "", session.status().time
        light(server)
        apply_theme(server, DARK)
        server.gui.main_panel.dock_right()
        Tour(server, [kind.stop for kind in PANELS.values() if kind.stop is not None])
        bar = server.gui.add_html("", visible=False)
        post = self._actions.post
        self._context = PageContext(server, session, post, study, diagnosis, data_folder(), bar)
        self.panels = {panel.name: panel for panel in self._made()}
        """By name, in their order on the page."""
        self._due = dict.fromkeys((OFTEN, SELDOM, *(panel.every for panel in self.panels.values())), 0.0)
        ThemeSwitch(server, post, self._follow_theme)

    def _made(self) -> Iterator[Panel]:
        """Make the panels that this page has, each in its place."""
        gui, kinds = self._server.gui, [kind for kind in PANELS.values() if kind.offered(self._context)]
        group = gui.add_tab_group()
        for tab in dict.fromkeys((*TABS, *(kind.tab for kind in kinds))):
            mine = [kind for kind in kinds if kind.tab == tab]
            with group.add_tab(tab.name, tab.icon) if mine else nullcontext():
                for kind in mine:
                    with gui.add_folder(kind.title, expand_by_default=not kind.folded) if kind.title else nullcontext():
                        yield kind(self._context)

    def _follow_theme(self, dark: bool) -> None:
        for panel in self.panels.values():
            panel.set_dark(dark)

    def close(self) -> None:
        """End what panels have started: a second pour, and a recording, with its file whole."""
        for panel in self.panels.values():
            panel.close()

    def run(self, stop: threading.Event) -> None:
        """Keep the page up to date until ``stop`` is set."""
        frames = FrameClock(FRAME_INTERVAL)
        while not stop.is_set():
            notice = self._actions.carry_out()
            self._notice = self._notice if notice is None else notice
            frame = self._session.frame()
            status = self._session.status()
            happened = (*self._session.new_events(), *self._orders.of_the_pour(status))
            self._events.extend(map(self._people.signed, happened))
            self._forget_what_comes_later(status)
            if frame is not None:
                # Before it is drawn: a playback keeps the messages to browsers, and the time between them.
                for recorder in filter(None, (self._recorder, self._context.recording)):
                    recorder.take(frame, status)
            with self._server.atomic():
                self._show(Now(status, frame, self._events, self._notice), notice is not None or bool(happened))
            frames.wait(stop)

    def _forget_what_comes_later(self, status: Status) -> None:
        if status.time < self._time:  # brought back, or another pour
            self._events = deque(not_later(self._events, status), maxlen=EVENTS_REMEMBERED)
        self._time = status.time

    def _show(self, now: Now, news: bool) -> None:
        """Let all panels draw, and those show whose time has come."""
        panels, began = self.panels.values(), time.monotonic()
        for panel in panels:
            panel.draw(now)
        for every, due in self._due.items():
            # A change that the solver has taken over is told at once: somebody's hand is on the slider.
            if began < due and not (news and every <= OFTEN):
                continue
            self._due[every] = began + every
            if every == SELDOM:
                self._events.extend(map(self._people.signed, self._orders.in_the_background(now.status)))
            for panel in panels:
                if panel.every == every:
                    panel.show(now)
