"""The tab "Look" of a recording: the live page's controls of colours, cut, rig and cameras."""

from __future__ import annotations

import viser

from explorer.logs.recording import Recording
from explorer.viewer.actions import Post
from explorer.viewer.look.camera_panel import CameraPanel
from explorer.viewer.look.colour_panel import ColourPanel
from explorer.viewer.look.cut_panel import CutPanel
from explorer.viewer.look.drawn_look import DrawnLook
from explorer.viewer.look.look import in_sight
from explorer.viewer.look.look_settings import LookSettings
from explorer.viewer.replay.recorded_frames import Motion, RecordedFrames
from explorer.viewer.replay.replay_nodes import ReplayNodes, highest


class ReplayLook:
    """Draws the frames of ``recording`` as a person wants to see them; ``bar`` explains the colours."""

    def __init__(self, server: viser.ViserServer, recording: Recording, bar: viser.GuiHtmlHandle, post: Post) -> None:
        self._frames, self._nodes = RecordedFrames(recording), ReplayNodes(server, recording)
        self._settings, self._on_page = LookSettings(post), DrawnLook(server)
        self._colours = ColourPanel(server, bar, self._settings, self._frames.quantities, post, self._frames.note)
        CutPanel(server, self._settings, post)
        height = highest(recording)
        CameraPanel(server, post, lambda: height)
        self._frame = self._frames.frame(1)
        self._motion: Motion | None = None
        self._told_for: object = None

    def show(self, time: float) -> None:
        """Draw the moment ``time`` [s]; call it inside ``server.atomic()``, as often as the page is looked at."""
        number = self._frames.number_at(time)
        if number != self._frame.number:
            self._frame = self._frames.frame(number)
        if self._colours.quantity is None:
            self._motion = None
        elif self._motion is None or self._motion.number != number:
            self._motion = self._frames.motion(number)
        look = self._settings.look
        self._on_page.move(self._nodes, self._frame, look, in_sight(self._frame, look))
        self._on_page.paint(self._nodes, self._frame, look, self._colours.quantity, self._motion)
        told = (look, number)
        if told != self._told_for:
            self._told_for = told
            self._colours.show(self._motion)
