"""What a change does to a pile that stands: told by how far its bodies moved, with *Pour again* where it did nothing.

Friction, restitution and stiffness act on what moves. The former pile then stays as a ghost, to compare with the new.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from html import escape

import numpy as np
import numpy.typing as npt

from explorer.live.frames import Frame
from explorer.live.messages import SessionState, Status
from explorer.scene.meshes import body_triangles
from explorer.scene.source import change_lines, differences
from explorer.viewer.palette import Colour
from explorer.viewer.panel import CONTROLS, Now, PageContext, Panel
from explorer.viewer.pour.readout import angle_of_repose_deg
from explorer.viewer.scene_nodes import BodyNodes, DrawnComponent, another_set_up
from explorer.viewer.view import small_html
from solver import Scene, body_counts

STOOD, FEW = 5e-4, 0.1
"""A pile is said to stand where at most this share of its bodies moved by more than this [m], a tenth of a seed."""
WATCHED = 0.3
"""Simulated time [s] after a change before that is said."""
GHOST: Colour = (170, 178, 186)
GHOST_OPACITY = 0.28
ROOT = "/ghost"
WHEN = {
    "static_friction": "friction acts when something moves",
    "restitution": "restitution acts when bodies hit each other",
    "shear_modulus": "stiffness changes overlaps by micrometres, and impacts",
    "poisson_ratio": "stiffness changes overlaps by micrometres, and impacts",
}
"""By the last word of a path."""
OTHERWISE = "it acts when something moves"


@dataclass(frozen=True)
class Rest:
    """A pile as it came to rest."""

    scene: Scene
    generation: int
    time: float
    frame: Frame
    angle: float
    """[°]; NaN where there is none."""


class StandingPanel(Panel):
    """The line, *Pour again*, and the ghost."""

    name, tab = "standing", CONTROLS

    def __init__(self, page: PageContext) -> None:
        gui = page.server.gui
        self._server, self._session = page.server, page.session
        self._rest: Rest | None = None
        self._frame: Frame | None = None
        self._ghost: BodyNodes | None = None
        self._former: Rest | None = None
        self._text = gui.add_html("", visible=False)
        self._again = gui.add_button(
            "Pour again with this", visible=False, hint="The same seed; the pile as it is stays as a ghost."
        )
        self._dismiss = gui.add_button("Dismiss the ghost", visible=False)
        self._again.on_click(lambda _: page.post(self._pour_again))
        self._dismiss.on_click(lambda _: page.post(self._take_ghost_away))

    def show(self, now: Now) -> None:
        """Keep the pile while it rests; after a change say whether it stood."""
        status = now.status
        self._frame = now.frame
        if self._former is not None and another_set_up(self._former.scene, status.scene):
            self._take_ghost_away()
        self._follow(status, now.frame)
        changed = self._rest is not None and self._rest.scene != status.scene
        lines = []
        if changed and self._rest is not None and now.frame is not None and watched(self._rest, status):
            moved = shifts(self._rest.frame, now.frame)
            lines += [standing_text(self._rest.scene, status.scene, moved)] if moved.size else []
        if self._former is not None:
            lines.append(ghost_text(self._former, status))
        html = small_html("".join(f"<div>{line}</div>" for line in lines))
        offered = bool(lines) and changed
        for handle, seen in ((self._text, bool(lines)), (self._again, offered), (self._dismiss, bool(self._ghost))):
            if handle.visible != seen:
                handle.visible = seen
        if self._text.content != html:
            self._text.content = html

    def close(self) -> None:
        """Take the ghost off the page."""
        self._take_ghost_away()

    def _follow(self, status: Status, frame: Frame | None) -> None:
        rest = self._rest
        if rest is not None and (status.generation != rest.generation or status.time < rest.time):
            rest = None
        at_rest = status.state == SessionState.ENDED and frame is not None and len(frame.position) > 0
        if at_rest and frame is not None and (rest is None or rest.scene == status.scene):
            rest = Rest(status.scene, status.generation, status.time, frame, angle_of_repose_deg(status))
        self._rest = rest

    def _pour_again(self) -> None:
        status = self._session.status()
        if self._rest is not None:
            frame = self._frame if self._frame is not None else self._rest.frame
            self._take_ghost_away()
            kinds = zip(self._rest.scene.bodies, body_counts(self._rest.scene), strict=True)
            drawn = [DrawnComponent(body_triangles(body), GHOST, most) for body, most in kinds]
            with self._server.atomic():
                self._ghost = BodyNodes(self._server, drawn, ROOT)
                self._ghost.fade(GHOST_OPACITY)
                self._ghost.show(frame)
            self._former = self._rest
        self._session.restart(status.scene)

    def _take_ghost_away(self) -> None:
        if self._ghost is not None:
            self._ghost.remove()
        self._ghost = self._former = None


def watched(rest: Rest, status: Status) -> bool:
    """Whether the pile had the time to move since it was changed: ``WATCHED``, or until it came to rest again."""
    return status.state == SessionState.ENDED or status.time >= rest.time + WATCHED


def shifts(before: Frame, now: Frame) -> npt.NDArray[np.float32]:
    """How far each body moved [m] that is in the domain in both; none where they are not of one pour."""
    if len(before.position) != len(now.position):
        return np.zeros(0, dtype=np.float32)
    both = before.inside & now.inside
    found: npt.NDArray[np.float32] = np.linalg.norm(now.position[both] - before.position[both], axis=1)
    return found


def standing_text(before: Scene, now: Scene, moved: npt.NDArray[np.float32]) -> str:
    """One line (HTML): whether the pile stood while its bodies ``moved`` [m], and when what was changed acts."""
    found = list(differences(before, now))
    loose, furthest = int((moved > STOOD).sum()), millimetres(float(moved.max()))
    many = f"{loose} of {len(moved)} bodies by more than {1e3 * STOOD:g} mm, up to {furthest}"
    names = escape("; ".join(change_lines(found)))
    if loose > FEW * len(moved):
        return f"{names}: the pile moved, {many}. It was not poured with these values."
    acts = dict.fromkeys(WHEN.get(one.path.rpartition(".")[2], OTHERWISE) for one in found)
    little = many if loose else f"no body moved by more than {furthest}"
    return f"{names}: <b>the pile stands; {', '.join(acts)}</b> ({little}). Shake it, tap it, or pour again."


def millimetres(length: float) -> str:
    """``length`` [m] to a tenth of a millimetre, or to the first digit below."""
    return f"{1e3 * length:.1f} mm" if length >= 1e-4 else f"{1e3 * length:.1g} mm"


def ghost_text(former: Rest, status: Status) -> str:
    """What the ghost is, in HTML."""
    angle = f"{former.angle:.1f}°" if math.isfinite(former.angle) else "no angle"
    found = "; ".join(change_lines(differences(former.scene, status.scene)))
    since = f"; since then {escape(found)}" if found else ""
    return f"Grey: the former pile, {angle} in one pour{since}."
