"""``explorer serve --replay``: a recording on the page, with a time slider, keys, curves, the event log and the look.

A replay plays at an adjustable speed, stops at the end, and can step from frame to frame. The live page's nodes draw it
for the scene that the file holds; an older file holds no scene, so its bodies and surfaces are drawn in the meshes and
colours of the file. Colours, cut, rig and cameras have the same controls as on the live page.
"""

from __future__ import annotations

import math
import threading
import time as clock
from collections.abc import Sequence
from functools import partial
from html import escape
from typing import Any

import numpy as np
import numpy.typing as npt
import viser
import viser.uplot

from explorer.live.frames import Frame
from explorer.recordings.recording import SAME_TIME, RecordedSurface, Recording
from explorer.scene.meshes import GATE_NAME, PLATE_NAME, outlet_height, scene_height
from explorer.units import checked
from explorer.viewer.actions import Action, Actions, FrameClock, OwnAction, Post, add_keys, button_group
from explorer.viewer.guarded_server import GuardedServer
from explorer.viewer.look.camera import CameraPanel, pile_points
from explorer.viewer.look.colour_by import ColourPanel
from explorer.viewer.look.drawn_look import DrawnLook, DrawnNodes
from explorer.viewer.look.look import in_sight
from explorer.viewer.look.look_settings import CutPanel, LookSettings
from explorer.viewer.palette import ANGLE_LINE, CONTACTS_LINE, ENERGY_LINE, MASS_LINE
from explorer.viewer.pour.chart import LEAST_TOP_DEG, axis
from explorer.viewer.replay.recorded_frames import RecordedFrames, RecordedMotion
from explorer.viewer.scene_nodes import (
    BodyNodes,
    DrawnComponent,
    DrawnPlate,
    SceneNodes,
    drawn,
    plate_radius,
    seen_through,
)
from explorer.viewer.shell.timeline import FASTEST, SLOWEST
from explorer.viewer.view import DARK, ThemeSwitch, apply_theme, light, look_at_height, small_html
from solver.scenes.scene import Scene

Array = npt.NDArray[np.float64]

FRAME_INTERVAL = 1.0 / 30.0
"""Wall time [s] between two updates of the replay."""
EVENTS_SHOWN = 6
NO_SCENE = "This recording is older and does not hold its scene: the rig is drawn as the file has it, without rims."
PLAY_PAUSE, TO_START, BACK, STEP = "Play / pause (space)", "To start (R)", "◀ frame (←)", "frame ▶ (→)"
HAIR = 1e-6
"""Time [s] by which the end of a chart alternates."""
SLIDER_STEP = 1e-3
"""Step of the time slider [s]; finer than the spacing of frames."""
LEAST_AXIS = 0.1
"""A chart's time axis extends to at least this time [s]: the labels of a shorter axis would not fit."""
CURVES = (
    ("angle_of_repose_deg", "angle [°]", ANGLE_LINE),
    ("discharged_mass_g", "mass [g]", MASS_LINE),
    ("kinetic_energy_mJ", "energy [mJ]", ENERGY_LINE),
    ("contacts", "contacts", CONTACTS_LINE),
)
"""Recorded curve, label, colour."""


class ReplayPage:
    """What a browser sees of ``recording``."""

    def __init__(self, server: GuardedServer, recording: Recording, name: str) -> None:
        zero = recording.zero
        recording = recording.counted_from(zero)
        self._server, self._recording = server, recording
        self._timeline, self._actions = Timeline(np.union1d(0.0, recording.times)), Actions()
        self._notice = ""
        light(server)
        look_at_height(server, drawn_height(recording))
        self._shown, self._turn = math.nan, 0
        apply_theme(server, DARK)
        server.gui.main_panel.dock_right()
        server.gui.add_markdown(f"**Replay** of `{name.replace('`', '')}`")
        notes = [f"It begins {zero:.3f} s after the pour did; times count from there."] * (zero > 0.0)
        notes += [NO_SCENE] * (recording.scene is None)
        self._notes = server.gui.add_html(small_html("<br>".join(notes)) if notes else "", visible=bool(notes))
        colour_bar = server.gui.add_html("", visible=False)
        tabs = server.gui.add_tab_group()
        with tabs.add_tab("Replay", viser.Icon.PLAYER_PLAY):
            self._controls()
            self._text = server.gui.add_html("")
            self._plots = [_plot(server, recording, *curve) for curve in CURVES if curve[0] in recording.curves]
            with server.gui.add_folder("Parameters", expand_by_default=False):
                server.gui.add_markdown(inert(recording.parameters))
            if recording.outcome:
                with server.gui.add_folder("Outcome", expand_by_default=False):
                    server.gui.add_markdown(inert(recording.outcome))
        with tabs.add_tab("Look", viser.Icon.EYE):
            self._look = ReplayLook(server, recording, colour_bar, self._actions.post)
        self._seen = False
        server.on_client_connect(lambda _: self._actions.post(OwnAction(self._begin)))
        # viser's charts look right on dark and on light.
        ThemeSwitch(server, self._actions.post, lambda dark: None)

    def _controls(self) -> None:
        gui, timeline = self._server.gui, self._timeline
        acts: dict[str, Action] = {
            PLAY_PAUSE: timeline.toggle,
            TO_START: partial(timeline.go_to, timeline.first),
            BACK: partial(timeline.step, -1),
            STEP: partial(timeline.step, 1),
        }
        post = self._actions.post
        button_group(gui, "Time", acts, post, hint="Arrows on a slider move the slider only.")
        add_keys(gui, acts, {PLAY_PAUSE: "space", TO_START: "R", BACK: "arrowleft", STEP: "arrowright"}, post)
        # A whole number of steps: viser shows the ends, and the value in the box, with all the digits that they have.
        last = round(SLIDER_STEP * max(1, math.ceil((timeline.last - SAME_TIME) / SLIDER_STEP)), 3)
        self._slider = gui.add_slider("Time [s]", 0.0, last, SLIDER_STEP, 0.0)

        @self._slider.on_update
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                value = event.target.value
                self._actions.post(lambda: timeline.go_to(checked(value, 0.0, last, "time")))

        speed = gui.add_slider("Speed", SLOWEST, FASTEST, SLOWEST, 1.0, hint="Recorded seconds per second.")

        @speed.on_update
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                value = event.target.value
                self._actions.post(lambda: setattr(timeline, "speed", checked(value, SLOWEST, FASTEST, "speed")))

    def run(self, stop: threading.Event) -> None:
        """Keep the page up to date until ``stop`` is set."""
        before, frames = clock.monotonic(), FrameClock(FRAME_INTERVAL)
        while not stop.is_set():
            now = clock.monotonic()
            notice = self._actions.carry_out()
            self._notice = self._notice if notice is None else notice
            self._timeline.pass_by(now - before)
            before = now
            self.show()
            frames.wait(stop)

    def _begin(self) -> None:
        """Play from the beginning when the first browser connects: until then nobody has seen anything."""
        if not self._seen:
            self._seen, self._timeline.time = True, self._timeline.first
            self._timeline.playing = True

    def show(self) -> None:
        """Draw the present moment, unless it is drawn already."""
        time = self._timeline.time
        with self._server.atomic():
            self._look.show(time)
            if time != self._shown:
                self._shown = time
                self._slider.value = round(time, 3)  # type: ignore[misc]
                self._turn += 1
                for name, plot in self._plots:
                    plot.data = columns(*self._recording.curves[name], time, self._timeline.last, self._turn)
        text = moment_html(self._recording, time, self._timeline.playing, self._notice)
        if self._text.content != text:
            self._text.content = text


def _plot(server: viser.ViserServer, recording: Recording, name: str, label: str, colour: str) -> tuple[str, Any]:
    data = columns(*recording.curves[name], 0.0, float(recording.times[-1]))
    top = LEAST_TOP_DEG if name == "angle_of_repose_deg" else float(np.nanmax(data[1], initial=1.0))
    plot = server.gui.add_uplot(
        data,
        (
            viser.uplot.Series(label="time [s]"),
            viser.uplot.Series(label=label, stroke=colour, width=2, points={"show": False}),
            viser.uplot.Series(label="now", stroke=colour, width=0, points={"show": True, "size": 9, "fill": colour}),
        ),
        scales={"x": viser.uplot.Scale(time=False), "y": viser.uplot.Scale(range=(0.0, 1.05 * top))},
        axes=(axis("x", 2), axis("y", 3, label)),
        aspect=3.0,
        padding=(8, 8, 0, 0),
    )
    return name, plot


def columns(times: Array, values: Array, now: float, last: float, turn: int = 0) -> tuple[Array, Array, Array]:
    """Times, values, and the value at ``now`` [s] with NaN elsewhere; the first and the last row are not data points.

    Those two rows stretch all charts over the same times, from 0 to ``last`` [s].
    A chart lays out its axes again only when the range of its times changes. The first data may arrive before the chart
    knows its size, which would leave its axes without numbers; so the end moves slightly at every ``turn``.
    """
    marked = np.full(len(times) + 2, np.nan)
    k = int(np.searchsorted(times, now, side="right")) - 1
    if k >= 0:
        marked[k + 1] = values[k]
    end = max(last, LEAST_AXIS) + HAIR * (1 + turn % 2)
    return np.array([0.0, *times, end]), np.array([np.nan, *values, np.nan]), marked


def moment_html(recording: Recording, time: float, playing: bool, notice: str = "") -> str:
    """State, time and bodies, the last refusal, and the events so far. Texts from the file are escaped."""
    bodies = sum(len(component.at(time).scale) for component in recording.components)
    lines = [f"{'playing' if playing else 'paused'} · {time:.3f} of {recording.times[-1]:.3f} s · {bodies} bodies"]
    happened = [f"{when:.3f} s  {text}" for when, text in recording.events if when <= time + 1e-9]
    lines += [notice] * bool(notice) + happened[: -EVENTS_SHOWN - 1 : -1]
    return small_html("<br>".join(map(escape, lines)))


class Timeline:
    """A moment within ``times`` [s], which are ascending and at least one."""

    def __init__(self, times: npt.NDArray[np.float64]) -> None:
        self.times = times
        self.time = float(times[0])
        self.playing = len(times) > 1
        self.speed = 1.0

    @property
    def first(self) -> float:
        """Time of the first frame [s]."""
        return float(self.times[0])

    @property
    def last(self) -> float:
        """Time of the last frame [s]."""
        return float(self.times[-1])

    def pass_by(self, wall: float) -> None:
        """While playing, advance by ``wall`` seconds of wall time; stop at the end."""
        if self.playing:
            self.go_to(self.time + self.speed * wall)
            self.playing = self.time < self.last

    def go_to(self, time: float) -> None:
        """Move to ``time`` [s], or to the nearer end if it lies outside."""
        self.time = min(max(time, self.first), self.last)

    def toggle(self) -> None:
        """Play or pause; at the end, play from the beginning."""
        if not self.playing and self.time >= self.last:
            self.time = self.first
        self.playing = not self.playing

    def step(self, frames: int) -> None:
        """Pause, and move by so many frames (back if negative)."""
        self.playing = False
        here = int(np.searchsorted(self.times, self.time + 1e-9, side="right")) - 1
        between = self.times[here] < self.time - 1e-9
        target = here + frames + (1 if frames < 0 and between else 0)
        self.time = float(self.times[min(max(target, 0), len(self.times) - 1)])


class ReplayLook:
    """Draws the frames of ``recording`` as the Look settings ask; ``bar`` explains the colours."""

    def __init__(self, server: viser.ViserServer, recording: Recording, bar: viser.GuiHtmlHandle, post: Post) -> None:
        self._frames, self._nodes = RecordedFrames(recording), replay_nodes(server, recording)
        self._settings, self._on_page = LookSettings(post), DrawnLook(server)
        self._colours = ColourPanel(server, bar, self._settings, self._frames.quantities, post, self._frames.note)
        CutPanel(server, self._settings, post)
        height = drawn_height(recording)
        outlet = math.inf if recording.scene is None else outlet_height(recording.scene.rig)
        CameraPanel(server, post, lambda: height, lambda: pile_points(self._frame, outlet))
        self._frame = self._frames.frame(1)
        self._motion: RecordedMotion | None = None
        self._told_for: object = None

    def show(self, time: float) -> None:
        """Draw the moment ``time`` [s]; call it inside ``server.atomic()`` at every update of the page."""
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


def replay_nodes(server: viser.ViserServer, recording: Recording) -> DrawnNodes:
    """The live page's nodes if ``recording`` holds its scene, else nodes for the meshes in the file."""
    if recording.scene is None:
        return MeshNodes(server, recording)
    return RecordedSceneNodes(server, recording.scene, recording.surfaces)


class RecordedSceneNodes(SceneNodes):
    """Nodes of ``scene``; the gate is visible as long as it was among the recorded ``surfaces``."""

    def __init__(self, server: viser.ViserServer, scene: Scene, surfaces: Sequence[RecordedSurface]) -> None:
        super().__init__(server, scene)
        self._gates = [surface for surface in surfaces if surface.shape.name == GATE_NAME]

    def show(self, frame: Frame, seen: npt.NDArray[np.bool_] | None = None) -> None:
        """Draw the state of ``frame``, gate included. Call it inside ``server.atomic()``."""
        super().show(frame, seen)
        self.show_gate(any(gate.seen_at(frame.time) for gate in self._gates))


class MeshNodes:
    """Nodes of a recording that does not hold its scene."""

    def __init__(self, server: viser.ViserServer, recording: Recording) -> None:
        self.bodies = BodyNodes(server, [DrawnComponent(c.shape, c.shape.colour, c.most) for c in recording.components])
        self._surfaces = [
            (
                surface,
                server.scene.add_mesh_simple(
                    f"/rig/{surface.shape.name}",
                    surface.shape.vertices,
                    surface.shape.faces,
                    color=surface.shape.colour,
                    opacity=surface.shape.opacity if surface.shape.opacity < 1.0 else None,
                    **drawn(surface.shape.name),
                ),
            )
            for surface in recording.surfaces
        ]
        plates = [node for surface, node in self._surfaces if surface.shape.name == PLATE_NAME]
        self._plate = DrawnPlate(server, plates[0]) if plates else None

    def show(self, frame: Frame, seen: npt.NDArray[np.bool_] | None = None) -> None:
        """Draw the state of ``frame``; ``seen`` says which bodies are drawn. Call it inside ``server.atomic()``."""
        self.bodies.show(frame, seen)
        if self._plate is not None:
            self._plate.reach(plate_radius(frame))
        for surface, node in self._surfaces:
            node.visible = surface.seen_at(frame.time)
            pose = surface.pose_at(frame.time)
            if pose is not None:
                node.position, node.wxyz = pose[:3], pose[3:]

    def fade(self, opacity: float) -> None:
        """Set the opacity of the surfaces that a viewer has to look through."""
        for surface, node in self._surfaces:
            if seen_through(surface.shape.name):
                node.opacity = opacity


def drawn_height(recording: Recording) -> float:
    """Height [m] that a picture of everything has to show; without a scene, the top of the rig or of the bodies."""
    if recording.scene is not None:
        return scene_height(recording.scene)
    tops = [float(s.shape.vertices[:, 2].max()) for s in recording.surfaces]
    tops += [float(f.position[:, 2].max()) for c in recording.components for f in c.frames if len(f.scale)]
    return max(float(np.max(tops)), 1e-3)


def inert(document: str) -> str:
    """Make the Markdown of a recording, which may be a stranger's, safe: HTML becomes text, no picture is fetched."""
    return document.replace("<", "&lt;").replace("![", "!\\[")
