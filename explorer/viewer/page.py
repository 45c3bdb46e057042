"""The page: one loop that takes actions, asks the session, and moves nodes and panels. Everything else only helps."""

from __future__ import annotations

import threading
import time
from collections import deque

import viser

from explorer.diagnosis.process import DiagnosisProcess
from explorer.files.user_data import uploads_folder
from explorer.live.frames import Frame
from explorer.live.messages import Event, Status
from explorer.scene.meshes import scene_height
from explorer.session import Session
from explorer.study.process import StudyProcess
from explorer.viewer.actions import Actions
from explorer.viewer.frame_clock import FrameClock
from explorer.viewer.laboratory.laboratory_tab import LaboratoryTab
from explorer.viewer.look.look_tab import LookTab
from explorer.viewer.orders import Orders
from explorer.viewer.output.recording_switch import Recorder
from explorer.viewer.people import People
from explorer.viewer.pour.chart import Chart
from explorer.viewer.pour.pour_panels import PourPanels
from explorer.viewer.pour.readout import not_later, readout_html
from explorer.viewer.pour.run_panel import RunPanel
from explorer.viewer.pour.second_pile import SecondPile
from explorer.viewer.scene_nodes import SceneNodes
from explorer.viewer.study.diagnosis_panel import DiagnosisPanel
from explorer.viewer.study.study_panel import StudyPanel
from explorer.viewer.theme import DARK, ThemeSwitch, apply_theme
from explorer.viewer.tour import Tour
from explorer.viewer.view import light, look_at_height
from solver.assets import shipped_measurements
from solver.scene import Scene

EVENTS_REMEMBERED = 1000

FRAME_INTERVAL = 1.0 / 36.0
"""Seconds between two looks at the newest frame: 30 a second are promised, and some come late or bring nothing new."""
PANEL_INTERVAL = 0.2
BACKGROUND_INTERVAL = 0.5
"""Seconds between two looks at studies and diagnoses."""


class Page:
    """What a browser sees of ``session``, which must have been started."""

    def __init__(
        self,
        server: viser.ViserServer,
        session: Session,
        study: StudyProcess | None,
        study_name: str,
        diagnosis: DiagnosisProcess,
        recorder: Recorder | None = None,
    ) -> None:
        self._server, self._session, self._recorder = server, session, recorder
        self._events: deque[Event] = deque(maxlen=EVENTS_REMEMBERED)
        self._actions, self._people = Actions(), People(server)
        self._orders = Orders({"diagnosis": diagnosis} | ({} if study is None else {"study": study}))
        self._notice = ""
        status = session.status()
        self._nodes, self._drawn = SceneNodes(server, status.scene), status.scene
        self._frame_number, self._time = 0, status.time
        self._generation = status.generation
        light(server)
        look_at_height(server, scene_height(status.scene))
        self._build_panels(study, study_name, diagnosis)

    def _build_panels(self, study: StudyProcess | None, study_name: str, diagnosis: DiagnosisProcess) -> None:
        server, session, post = self._server, self._session, self._actions.post
        apply_theme(server, DARK)
        server.gui.main_panel.dock_right()
        Tour(server)
        colour_bar = server.gui.add_html("", visible=False)
        tabs = server.gui.add_tab_group()
        with tabs.add_tab("Pour", viser.Icon.PLAYER_PLAY):
            RunPanel(server, session, post)
            self._readout = server.gui.add_html("")
            self._chart = Chart(server)
            self._panels = PourPanels(server, session, post)
            self._second = SecondPile(server, session, post)
        with tabs.add_tab("Look", viser.Icon.EYE):
            self._look = LookTab(server, session, colour_bar, post)
        with tabs.add_tab("Take along", viser.Icon.DOWNLOAD):
            self._panels.add_output()
        self._study: StudyPanel | None = None
        if study is not None:
            with tabs.add_tab("Calibrate", viser.Icon.TARGET):
                self._study = StudyPanel(server, study, study_name, post, session)
        with tabs.add_tab("Diagnose", viser.Icon.STETHOSCOPE):
            self._diagnosis = DiagnosisPanel(server, diagnosis, shipped_measurements(), uploads_folder(), post)
        with tabs.add_tab("Laboratory", viser.Icon.FLASK):
            self._laboratory = LaboratoryTab(server, session, uploads_folder(), post)
        ThemeSwitch(server, post, self._follow_theme)

    def _follow_theme(self, dark: bool) -> None:
        for panel in (self._study, self._diagnosis):
            if panel is not None:
                panel.dark = dark
        self._laboratory.set_dark(dark)

    def close(self) -> None:
        """End what the page itself has started: a second pour, and a recording, with its file whole."""
        self._second.close()
        self._panels.close()

    def run(self, stop: threading.Event) -> None:
        """Keep the page up to date until ``stop`` is set."""
        panels_due = background_due = 0.0
        frames = FrameClock(FRAME_INTERVAL)
        while not stop.is_set():
            began = time.monotonic()
            notice = self._actions.carry_out()
            self._notice = self._notice if notice is None else notice
            frame = self._session.frame()
            status = self._session.status()
            happened = (*self._session.new_events(), *self._orders.of_the_pour(status))
            self._events.extend(map(self._people.signed, happened))
            self._forget_what_comes_later(status)
            self._panels.take(status, frame)
            with self._server.atomic():
                self._show_bodies(status, frame)
                self._second.show_bodies()
                # A change that the solver has taken over is told at once: somebody's hand is on the slider.
                if began >= panels_due or notice is not None or happened:
                    panels_due = began + PANEL_INTERVAL
                    self._show_panels(status)
                if began >= background_due:
                    background_due = began + BACKGROUND_INTERVAL
                    self._events.extend(map(self._people.signed, self._orders.in_the_background(status)))
                    self._show_background()
            frames.wait(stop)

    def _forget_what_comes_later(self, status: Status) -> None:
        if status.time < self._time:  # brought back, or another pour
            self._events = deque(not_later(self._events, status), maxlen=EVENTS_REMEMBERED)
        self._time = status.time

    def _show_bodies(self, status: Status, frame: Frame | None) -> None:
        if status.generation != self._generation:
            self._generation = status.generation
            self._redraw(status.scene)
            self._nodes.clear()
        if frame is not None and self._recorder is not None:
            self._recorder.take(frame, status)
        if frame is None:
            return
        self._look.show(self._nodes, frame, status.scene)
        if frame.number != self._frame_number:
            self._frame_number = frame.number
            self._nodes.show_gate(status.gate_shut)

    def _redraw(self, scene: Scene) -> None:
        if (scene.bodies, scene.rig) != (self._drawn.bodies, self._drawn.rig):
            self._nodes.remove()
            self._nodes, self._drawn = SceneNodes(self._server, scene), scene
            look_at_height(self._server, scene_height(scene))

    def _show_panels(self, status: Status) -> None:
        readout = readout_html(status, self._events, self._notice, self._look.by_component)
        if self._readout.content != readout:
            self._readout.content = readout
        self._chart.show(status, self._events)
        self._panels.show(status, self._events, self._notice)
        self._second.show(status)
        self._laboratory.show(self._notice)

    def _show_background(self) -> None:
        if self._study is not None:
            self._study.show(self._notice)
        self._diagnosis.show(self._notice)
