"""The page: one loop that takes actions, asks the session, and moves nodes and panels. Everything else only helps."""

from __future__ import annotations

import math
import threading
import time
from collections import deque
from typing import Protocol

import numpy as np
import viser

from explorer.diagnosis_process import DiagnosisProcess
from explorer.live.frames import Frame
from explorer.live.messages import Event, Status
from explorer.scene_meshes import scene_height
from explorer.session import Session
from explorer.study_process import StudyProcess
from explorer.viewer.actions import Actions
from explorer.viewer.chart import Chart
from explorer.viewer.diagnosis_panel import DiagnosisPanel
from explorer.viewer.live_panel import LivePanel
from explorer.viewer.readout import readout_html
from explorer.viewer.restart_panel import RestartPanel
from explorer.viewer.run_panel import RunPanel
from explorer.viewer.scene_nodes import SceneNodes
from explorer.viewer.study_panel import StudyPanel
from explorer.viewer.theme import DARK, ThemeSwitch, apply_theme
from solver.assets import shipped_measurements
from solver.scene import Scene


class Recorder(Protocol):
    """Something that keeps what the page shows."""

    def take(self, frame: Frame, status: Status) -> None:
        """Called about 30 times a second with the newest frame and the newest status."""


EVENTS_REMEMBERED = 50

FRAME_INTERVAL = 1.0 / 30.0
PANEL_INTERVAL = 0.2
BACKGROUND_INTERVAL = 0.5
"""Seconds between two looks at studies and diagnoses."""

VIEW_DIRECTION = (0.62, -0.75, 0.24)
"""From the pile to the camera."""
VIEW_FIELD = 0.6
"""Vertical field of view [rad]."""
FILL = 0.68
"""Share of the height of the window that rig and feed take."""


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
        self._actions = Actions()
        self._notice = ""
        status = session.status()
        self._nodes, self._drawn = SceneNodes(server, status.scene), status.scene
        self._frame_number = 0
        self._generation = status.generation
        light(server)
        look(server, status.scene)
        self._build_panels(status, study, study_name, diagnosis)

    def _build_panels(
        self, status: Status, study: StudyProcess | None, study_name: str, diagnosis: DiagnosisProcess
    ) -> None:
        server, session, post = self._server, self._session, self._actions.post
        apply_theme(server, DARK)
        server.gui.main_panel.dock_right()
        tabs = server.gui.add_tab_group()
        with tabs.add_tab("Pour", viser.Icon.PLAYER_PLAY):
            RunPanel(server, session, post)
            self._readout = server.gui.add_html("")
            self._chart = Chart(server)
            self._live = LivePanel(server, session, status.scene, post)
            self._restart = RestartPanel(server, session, status.scene, status.seed, post)
        self._study: StudyPanel | None = None
        if study is not None:
            with tabs.add_tab("Calibrate", viser.Icon.TARGET):
                self._study = StudyPanel(server, study, study_name, post, session)
        with tabs.add_tab("Diagnose", viser.Icon.STETHOSCOPE):
            self._diagnosis = DiagnosisPanel(server, diagnosis, shipped_measurements(), post)
        ThemeSwitch(server, post, self._follow_theme)

    def _follow_theme(self, dark: bool) -> None:
        for panel in (self._study, self._diagnosis):
            if panel is not None:
                panel.dark = dark

    def run(self, stop: threading.Event) -> None:
        """Keep the page up to date until ``stop`` is set."""
        panels_due = background_due = 0.0
        while not stop.is_set():
            began = time.monotonic()
            notice = self._actions.carry_out()
            self._notice = self._notice if notice is None else notice
            frame = self._session.frame()
            status = self._session.status()
            self._take_events()
            with self._server.atomic():
                self._show_bodies(status, frame)
                if began >= panels_due or notice is not None:
                    panels_due = began + PANEL_INTERVAL
                    self._show_panels(status)
                if began >= background_due:
                    background_due = began + BACKGROUND_INTERVAL
                    self._show_background()
            stop.wait(max(0.0, FRAME_INTERVAL - (time.monotonic() - began)))

    def _take_events(self) -> None:
        self._events.extend(self._session.new_events())

    def _show_bodies(self, status: Status, frame: Frame | None) -> None:
        if status.generation != self._generation:
            self._generation = status.generation
            self._redraw(status.scene)
            self._nodes.clear()
        if frame is not None and self._recorder is not None:
            self._recorder.take(frame, status)
        if frame is None or frame.number == self._frame_number:
            return
        self._frame_number = frame.number
        self._nodes.show(frame)
        self._nodes.show_gate(status.gate_shut)

    def _redraw(self, scene: Scene) -> None:
        if (scene.bodies, scene.rig) != (self._drawn.bodies, self._drawn.rig):
            self._nodes.remove()
            self._nodes, self._drawn = SceneNodes(self._server, scene), scene
            look(self._server, scene)

    def _show_panels(self, status: Status) -> None:
        readout = readout_html(status, self._events, self._notice)
        if self._readout.content != readout:
            self._readout.content = readout
        self._chart.show(status)
        self._live.show(status)
        self._restart.show(status)

    def _show_background(self) -> None:
        if self._study is not None:
            self._study.show(self._notice)
        self._diagnosis.show(self._notice)


def light(server: viser.ViserServer) -> None:
    """viser's lamps with shadows, and a sky so weak that the colours of the components stay what they are."""
    server.scene.configure_default_lights(enabled=True, cast_shadow=True)
    server.scene.configure_environment_map("studio", environment_intensity=0.15)


def look(server: viser.ViserServer, scene: Scene) -> None:
    """Camera that new clients start with: pile, funnel and feed in one picture."""
    height = scene_height(scene)
    distance = height / FILL / (2.0 * math.tan(VIEW_FIELD / 2.0))
    middle = (0.0, 0.0, 0.42 * height)
    camera = server.initial_camera
    camera.position = np.array(middle) + distance * np.array(VIEW_DIRECTION)
    camera.look_at = middle
    camera.fov = VIEW_FIELD
    camera.near = 0.01
