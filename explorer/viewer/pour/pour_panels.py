"""The panels below the first chart: what the pour does, what can be changed of it, and what can be taken along."""

from __future__ import annotations

from collections.abc import Sequence

import viser

from explorer.files.user_data import data_folder, uploads_folder
from explorer.live.frames import Frame
from explorer.live.messages import Event, Status
from explorer.session import Session
from explorer.viewer.actions import Post
from explorer.viewer.background_work import BackgroundWork
from explorer.viewer.output.output_panel import OutputPanel
from explorer.viewer.output.recording_switch import RecordingSwitch
from explorer.viewer.pour.changes_panel import ChangesPanel
from explorer.viewer.pour.live_panel import LivePanel
from explorer.viewer.pour.motion_chart import MotionChart
from explorer.viewer.pour.outline_panel import OutlinePanel
from explorer.viewer.pour.restart_panel import RestartPanel
from explorer.viewer.pour.scene_bound import SceneBound
from explorer.viewer.pour.scene_panel import ScenePanel
from solver.assets import shipped_measurements


class PourPanels:
    """Made inside the tab of the pour; :meth:`add_output` makes the rest in a tab of its own."""

    def __init__(self, server: viser.ViserServer, session: Session, post: Post) -> None:
        self._server, self._session, self._post = server, session, post
        self._background = BackgroundWork(post)
        scene, uploads = session.status().scene, uploads_folder()
        self.motion = MotionChart(server)
        self.outline = OutlinePanel(server, shipped_measurements(), uploads, post, self._background)
        self.live = SceneBound(server, lambda scene: LivePanel(server, session, scene, post), scene)
        self.changes = ChangesPanel(server, session, data_folder() / "presets", post)
        self.scene = ScenePanel(server, session, uploads, post, self._background)
        self.set_up = SceneBound(
            server, lambda scene: RestartPanel(server, session, scene, session.status().seed, post), scene
        )
        self.recording = RecordingSwitch(server, data_folder() / "recordings", self._background)
        self.output: OutputPanel | None = None

    def add_output(self) -> None:
        """Make what is taken along: command line, files, recordings."""
        self.output = OutputPanel(
            self._server, self._session, self.recording, uploads_folder(), self._post, self._background
        )

    def take(self, status: Status, frame: Frame | None) -> None:
        """Take note of what is new; call it as often as there may be something."""
        self.changes.take(status)
        if frame is not None:
            self.recording.take(frame, status)

    def show(self, status: Status, events: Sequence[Event], notice: str) -> None:
        """Show it; ``notice`` is the page's own last message. Call it inside ``server.atomic()``."""
        self.motion.show(status, events)
        self.outline.show(status)
        self.live.panel(status.scene).show(status)
        self.changes.show(status)
        self.scene.show(status)
        self.set_up.panel(status.scene).show(status)
        if self.output is not None:
            self.output.show(status, notice)

    def close(self) -> None:
        """End a recording that was begun on the page, with its file whole."""
        self.recording.close()
