"""A second pour beside the first, in a solver process of its own, and a measured pile on the other side.

All are drawn in one scene, so every camera sees all. The second pour plays and keeps pace with the first; when the
first stands still, the second moves to the same moment, backward or forward.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
import viser

from explorer.diagnosis.piles import HeightSurface
from explorer.live.messages import SessionState, Status
from explorer.live.session import Session
from explorer.scene.meshes import scene_height
from explorer.viewer.look.camera import aspect_of, go_to_place
from explorer.viewer.palette import MEASURED, RIM
from explorer.viewer.scene_nodes import LINE, PLATE_RADIUS, SceneNodes, another_set_up, circle
from explorer.viewer.view import MIDDLE, CameraView
from solver.scenes.scene import Scene

ROOT = "/second"
BESIDE = 2.15 * PLATE_RADIUS
"""Distance of two rigs' axes [m]."""


Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Aside:
    """Position to which a camera was moved so that all piles are in its picture."""

    away: Array
    """Vector from pile to camera before the move [m]."""
    aspect: float
    """Width of the picture over its height."""
    position: Array
    """[m]."""
    scene: Scene
    middle: float
    """Middle of all piles along x [m]."""

    def holds(self, position: Array) -> bool:
        """Whether the camera is still there, within a small tolerance: browsers send single precision."""
        return bool(np.allclose(position, self.position, atol=1e-4))


class BesidePile:
    """A second pour beside the first, drawn and kept at the first one's moment, and a measured surface beside both.

    ``open_session`` makes the session in which the second pour runs.
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
        self._names: dict[str, viser.LabelHandle] = {}
        self._aside: dict[int, Aside] = {}
        server.scene.add_frame(ROOT, show_axes=False, position=(BESIDE, 0.0, 0.0))

    def pour_present(self) -> None:
        """Begin the second pour with the scene and the seed of the first as they are now."""
        status = self._first.status()
        self.pour(status.scene, status.seed)

    def pour(self, scene: Scene, seed: int, names: tuple[str, str] = ("first pour", "second pour")) -> None:
        """Begin the second pour, in place of an earlier one; ``names`` appear above both, with their results."""
        second = self._second or self._open()
        second.start(scene, seed)  # if that is refused, everything stays as it was
        self._take_signs_away()
        if self._second is None:
            self._second = second
            self._step_aside(scene, 0.5 * BESIDE)
        self._names = {name: self._sign(name, x, scene) for name, x in zip(names, (0.0, BESIDE), strict=True)}

    def show_measured(self, surface: HeightSurface | None, text: str, scene: Scene) -> None:
        """Draw the measured pile left of the first one, and ``text`` above it; once the second is poured."""
        if surface is not None:
            self._sign(text, -BESIDE, scene)
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
        self._step_aside(scene, 0.0 if surface is not None else 0.5 * BESIDE)

    def close(self) -> None:
        """End the second pour and remove everything of it from the page."""
        self._take_signs_away()
        self._step_back()
        if self._second is not None:
            self._second.close()
            self._second = None
            self._remove_nodes()

    @property
    def widest_plate(self) -> float:
        """Largest radius of the first pile's plate [m] that does not overlap those beside it."""
        return math.inf if self._second is None else PLATE_RADIUS

    def draw(self) -> None:
        """Draw the second pour's newest frame."""
        if self._second is None:
            return
        self._follow_windows()
        status, frame = self._second.status(), self._second.frame()
        if self._drawn is None or another_set_up(status.scene, self._drawn):
            self._remove_nodes()
            self._nodes, self._drawn = SceneNodes(self._server, status.scene, ROOT), status.scene
            self._nodes.widest = PLATE_RADIUS
        if self._nodes is not None and frame is not None and frame.number != self._frame_number:
            self._frame_number = frame.number
            self._nodes.show(frame)
            self._nodes.show_gate(status.gate_shut)

    def follow(self, first: Status) -> Status | None:
        """Let time run or stand still as in the first pour; returns the second pour's status, None without one."""
        second = None if self._second is None else self._second.status()
        moments = None if second is None else (second.state, second.time, first.state, first.time, first.speed)
        if self._second is not None and second is not None and moments != self._kept_for:
            # Once per moment: the effect of the request shows only in a later status.
            self._kept_for = moments
            keep_time(self._second, second, first)
        return second

    def say(self, first: str, second: str) -> None:
        """Show the results of both pours below their names."""
        for (name, sign), said in zip(self._names.items(), (first, second), strict=False):
            text = f"{name}\n{said}"
            if sign.text != text:
                sign.text = text

    def _step_aside(self, scene: Scene, middle: float) -> None:
        """Move every camera back, from where the user had it, until all plates are in its picture."""
        self._aside, former = {}, self._aside
        for number, client in self._server.get_clients().items():
            camera, before = client.camera, former.get(number)
            at = np.array(camera.position)
            away = before.away if before and before.holds(at) else at - np.array(camera.look_at)
            view = stand_aside(camera, away, scene, middle)
            go_to_place(client, view)
            self._aside[number] = Aside(away, aspect_of(camera), np.array(view.position), scene, middle)

    def _step_back(self) -> None:
        """Return every camera that nobody has moved since to the first pile, at its former distance."""
        clients = self._server.get_clients()
        for number, aside in self._aside.items():
            client = clients.get(number)
            if client is not None and aside.holds(client.camera.position):
                aim = np.array([0.0, 0.0, MIDDLE * scene_height(aside.scene)])
                go_to_place(client, CameraView(aim + aside.away, aim))
        self._aside = {}

    def _follow_windows(self) -> None:
        """Adapt cameras that nobody has moved since, so that pictures of a new shape hold all plates again."""
        clients = self._server.get_clients()
        for number, aside in self._aside.items():
            client = clients.get(number)
            if client is None or aspect_of(client.camera) == aside.aspect or not aside.holds(client.camera.position):
                continue
            view = stand_aside(client.camera, aside.away, aside.scene, aside.middle)
            go_to_place(client, view)
            self._aside[number] = replace(aside, aspect=aspect_of(client.camera), position=np.array(view.position))

    def _sign(self, text: str, x: float, scene: Scene) -> viser.LabelHandle:
        """``text`` above a pile."""
        at = (x, 0.0, 1.08 * scene_height(scene))
        sign = self._server.scene.add_label(f"/names/{len(self._signs)}", text, position=at, anchor="bottom-center")
        self._signs.append(sign)
        return sign

    def _take_signs_away(self) -> None:
        for sign in reversed(self._signs):  # nodes below another node are removed with it
            sign.remove()
        self._signs, self._names = [], {}

    def _remove_nodes(self) -> None:
        if self._nodes is not None:
            self._nodes.remove()
        self._nodes = self._drawn = None
        self._frame_number = 0


def keep_time(session: Session, second: Status, first: Status) -> None:
    """Play and pace ``session`` as the first pour does; bring it to the first one's moment when that stands still."""
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
        session.back_to(time)


def stand_aside(camera: Any, away: Array, scene: Scene, middle: float) -> CameraView:
    """The view along ``away`` (pile to camera [m]) with all plates, about ``middle`` [m] along x, in the picture.

    With a = unit vector from the piles to the camera, e = x axis, ℓ = distance of the outermost axis from the middle,
    and R = radius of a plate: the plate nearest to the camera is a·e ℓ nearer than the middle and reaches
    √(1 − (a·e)²) ℓ + R to the side, which half the width of the picture has to hold: depth · tan(fov/2) · aspect.
    The camera comes no nearer than ``away``.
    """
    aim = np.array([middle, 0.0, MIDDLE * scene_height(scene)])
    now = max(float(np.linalg.norm(away)), 1e-6)
    along, outermost = abs(float(away[0])) / now, BESIDE - middle
    half_width = math.tan(0.5 * camera.fov) * aspect_of(camera)
    least = along * outermost + (math.sqrt(1.0 - along**2) * outermost + PLATE_RADIUS) / half_width
    return CameraView(aim + away * max(1.0, least / now), aim)
