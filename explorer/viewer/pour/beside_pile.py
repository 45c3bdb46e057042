"""A second pour beside the first, in a solver process of its own, and a measured pile on the other side.

All are drawn in one scene, so every camera sees all. The second pour plays and keeps speed with the first; where the
first one stands still, the second comes to the same moment, back or on.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import viser

from explorer.diagnosis.piles import HeightSurface
from explorer.live.messages import SessionState, Status
from explorer.scene.meshes import scene_height
from explorer.session import Session
from explorer.viewer.look.camera import aspect_of, go_to_place
from explorer.viewer.palette import MEASURED, RIM
from explorer.viewer.scene_nodes import LINE, PLATE_RADIUS, SceneNodes, another_set_up, circle
from explorer.viewer.view import MIDDLE, CameraView
from solver.scenes.scene import Scene

ROOT = "/second"
BESIDE = 2.15 * PLATE_RADIUS
"""Distance of two rigs' axes [m]."""


class BesidePile:
    """A second pour beside the first, drawn and kept at the first one's moment, and a measured surface beside both.

    ``open_session`` makes the session that it runs in.
    """

    def __init__(
        self, server: viser.ViserServer, first: Session, open_session: Callable[[], Session] = Session
    ) -> None:
        self._server, self._first, self._open = server, first, open_session
        self._second: Session | None = None
        self._nodes: SceneNodes | None = None
        self._drawn: Scene | None = None
        self._frame_number = 0
        self._kept_for: object = None
        self._signs: list[Any] = []
        server.scene.add_frame(ROOT, show_axes=False, position=(BESIDE, 0.0, 0.0))

    def pour(self, scene: Scene, seed: int) -> None:
        """Begin the second pour, in place of one before it."""
        self._take_signs_away()
        if self._second is None:
            self._second = self._open()
            step_aside(self._server, scene)
        self._second.start(scene, seed)

    def show_measured(self, surface: HeightSurface | None, names: tuple[str, str, str], scene: Scene) -> None:
        """Draw the measured pile left of the first one, and the three names above them."""
        self._take_signs_away()
        height = scene_height(scene)
        places = ((-BESIDE, names[0]), (0.0, names[1]), (BESIDE, names[2]))
        for x, name in places if surface is not None else places[1:]:
            label = self._server.scene.add_label(f"/names/{name}", name, position=(x, 0.0, 1.08 * height))
            self._signs.append(label)
        if surface is not None:
            plate = circle(PLATE_RADIUS, LINE)  # below the surface's node, and so beside the first pile with it
            self._signs += [
                self._server.scene.add_mesh_simple(
                    "/measured",
                    surface.vertices,
                    surface.faces,
                    color=MEASURED,
                    side="double",
                    position=(-BESIDE, 0, 0),
                ),
                self._server.scene.add_line_segments("/measured/plate", plate, RIM, thickness=LINE),
            ]
        step_aside(self._server, scene, 0.0 if surface is not None else 0.5 * BESIDE)

    def close(self) -> None:
        """End the second pour and take all of it off the page."""
        self._take_signs_away()
        if self._second is not None:
            self._second.close()
            self._second = None
            self._remove_nodes()

    def draw(self) -> None:
        """Draw its newest frame."""
        if self._second is None:
            return
        status, frame = self._second.status(), self._second.frame()
        if self._drawn is None or another_set_up(status.scene, self._drawn):
            self._remove_nodes()
            self._nodes, self._drawn = SceneNodes(self._server, status.scene, ROOT), status.scene
        if self._nodes is not None and frame is not None and frame.number != self._frame_number:
            self._frame_number = frame.number
            self._nodes.show(frame)
            self._nodes.show_gate(status.gate_shut)

    def follow(self, first: Status) -> Status | None:
        """Let time go or stand as in the first pour; the second one's status, None without one."""
        second = None if self._second is None else self._second.status()
        moments = None if second is None else (second.state, second.time, first.state, first.time, first.speed)
        if self._second is not None and second is not None and moments != self._kept_for:
            # Once per moment: what was asked shows in a later status only.
            self._kept_for = moments
            keep_time(self._second, second, first)
        return second

    def _take_signs_away(self) -> None:
        for sign in self._signs:
            sign.remove()
        self._signs = []

    def _remove_nodes(self) -> None:
        if self._nodes is not None:
            self._nodes.remove()
        self._nodes = self._drawn = None
        self._frame_number = 0


def keep_time(session: Session, second: Status, first: Status) -> None:
    """Play and pace ``session`` as the first pour does; bring it to the first one's moment where that stands still."""
    if first.state == SessionState.PAUSED:
        _come_to(session, second, first.time)
    elif second.state == SessionState.PAUSED and first.state in (SessionState.RUNNING, SessionState.ENDED):
        session.play()
    if not math.isclose(second.speed, first.speed):
        session.set_speed(first.speed)


def _come_to(session: Session, second: Status, time: float) -> None:
    ahead, hair = second.time - time, 0.5 * second.scene.numerics.sample_interval
    if ahead < -hair:
        if second.state == SessionState.PAUSED:
            session.play()
    elif second.state == SessionState.RUNNING:
        session.pause()
    elif ahead > hair and second.earliest <= time:
        session.step_back(ahead)


def step_aside(server: viser.ViserServer, scene: Scene, middle: float = 0.5 * BESIDE) -> None:
    """Move every camera away until all plates, about ``middle`` [m] along x, are in the picture across.

    With a = unit vector from the piles to the camera, e = x axis, ℓ = distance of the outermost axis from the middle,
    and R = radius of a plate: the plate nearest to the camera is a·e ℓ nearer than the middle and reaches
    √(1 − (a·e)²) ℓ + R to the side, which half the width of the picture has to hold: depth · tan(fov/2) · aspect.
    """
    aim = np.array([middle, 0.0, MIDDLE * scene_height(scene)])
    for client in server.get_clients().values():
        away = np.array(client.camera.position) - np.array(client.camera.look_at)
        now = max(float(np.linalg.norm(away)), 1e-6)
        along, outermost = abs(float(away[0])) / now, BESIDE - middle
        half_width = math.tan(0.5 * client.camera.fov) * aspect_of(client.camera)
        least = along * outermost + (math.sqrt(1.0 - along**2) * outermost + PLATE_RADIUS) / half_width
        away *= max(1.0, least / now)
        go_to_place(client, CameraView(aim + away, aim))
