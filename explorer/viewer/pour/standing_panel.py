"""What happened last, in a box beside the controls; after a change to a standing pile, whether its bodies moved.

Friction, restitution and stiffness act on moving bodies. When a pile is poured again with other parameters, the former
pile stays as a ghost, for comparison with the new one.
"""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np
import numpy.typing as npt

from explorer.live.frames import Frame
from explorer.live.messages import Event, SessionState, Status
from explorer.scene.source import change_lines, differences
from explorer.viewer.panel import CONTROLS, Now, PageContext, Panel
from explorer.viewer.pour.ghost import Rest
from explorer.viewer.pour.readout import angle_of_repose_deg
from explorer.viewer.scene_nodes import another_set_up
from explorer.viewer.view import small_html
from solver import Scene

STOOD, FEW = 5e-4, 0.1
"""A pile counts as standing if at most the share ``FEW`` of its bodies moved by more than ``STOOD`` [m], a tenth of a
seed."""
WATCHED = 0.3
"""Simulated time [s] after a change before this is reported."""
AT_THE_END = 1e9
"""Order among the controls of the room."""
BOX = (
    "height:4.5em; overflow-y:auto; margin:0.2em 0; padding:0.25em 0.5em; border-radius:0.3em; line-height:1.35; "
    "background:rgba(128,150,170,0.14)"
)
"""Style: three lines high."""
WHEN = {
    "static_friction": "friction acts when something moves",
    "restitution": "restitution acts when bodies hit each other",
    "shear_modulus": "stiffness changes overlaps by micrometres, and impacts",
    "poisson_ratio": "stiffness changes overlaps by micrometres, and impacts",
}
"""When a parameter acts, by the last word of its path."""
OTHERWISE = "it acts when something moves"


class StandingPanel(Panel):
    """The box; at the end of the room *Dismiss the ghost*."""

    name, tab = "standing", CONTROLS

    def __init__(self, page: PageContext) -> None:
        gui = page.server.gui
        self._ghost = page.ghost
        self._rest: Rest | None = None
        self._frame: Frame | None = None
        self._box = gui.add_html("")
        self._dismiss = gui.add_button("Dismiss the ghost", visible=False, order=AT_THE_END)
        self._dismiss.on_click(lambda _: page.post(self._ghost.take_away))

    def show(self, now: Now) -> None:
        """Keep the pile while it rests; after a change say whether it stood, otherwise what happened last."""
        status = now.status
        if self._rest is not None and status.generation != self._rest.generation:
            self._leave_a_ghost(self._rest, status.scene)
        former = self._ghost.former
        if former is not None and another_set_up(former.scene, status.scene):
            self._ghost.take_away()
            former = None
        self._frame = now.frame
        self._follow(status, now.frame)
        did = self._what_the_change_did(status, now.frame)
        # It names the change and replaces it.
        told = map(escape, notes(status, () if did else now.events, now.notice))
        ghost = "" if former is None else ghost_text(former, status)
        box = box_html([line for line in (ghost, *told, did) if line])
        if self._box.content != box:
            self._box.content = box
        if self._dismiss.visible != (former is not None):
            self._dismiss.visible = former is not None

    def close(self) -> None:
        """Take the ghost off the page."""
        self._ghost.take_away()

    def _follow(self, status: Status, frame: Frame | None) -> None:
        rest = self._rest
        if rest is not None and (status.generation != rest.generation or status.time < rest.time):
            rest = None
        at_rest = status.state == SessionState.ENDED and frame is not None and len(frame.position) > 0
        if at_rest and frame is not None and (rest is None or rest.scene == status.scene):
            rest = Rest(status.scene, status.generation, status.time, frame, angle_of_repose_deg(status))
        self._rest = rest

    def _what_the_change_did(self, status: Status, frame: Frame | None) -> str:
        rest = self._rest
        if rest is None or frame is None or rest.scene == status.scene or not watched(rest, status):
            return ""
        moved = shifts(rest.frame, frame)
        return standing_text(rest.scene, status.scene, moved) if moved.size else ""

    def _leave_a_ghost(self, rest: Rest, scene: Scene) -> None:
        """Leave a ghost of a pile that stood, before it is poured again with other parameters."""
        if rest.scene == scene or another_set_up(rest.scene, scene):
            return
        self._ghost.leave(rest, self._frame if self._frame is not None else rest.frame)


def box_html(lines: Sequence[str]) -> str:
    """``lines`` (HTML) in a box of always the same height, so that the controls below it stay where they are."""
    said = "".join(f"<div>{line}</div>" for line in lines)
    return small_html(f"<div class='note' tabindex='0' style='{BOX}' role='status'>{said}</div>")


def notes(status: Status, events: Sequence[Event], notice: str) -> list[str]:
    """What was refused, what the solver says, what happened last; each only once."""
    happened = recent(events, status.generation)
    said = "" if status.message in happened else status.message
    return [text for text in dict.fromkeys((notice, said, happened)) if text]


def recent(events: Sequence[Event], generation: int) -> str:
    """The last moment at which something happened, in one line; empty if nothing did."""
    mine = [event for event in events if event.generation == generation]
    if not mine:
        return ""
    last = mine[-1]
    others = sum(event.time == last.time for event in mine) - 1
    return f"{last.time:.3f} s  {last.text}" + (f" (and {others} more)" if others else "")


def watched(rest: Rest, status: Status) -> bool:
    """Whether the pile had the time to move since it was changed: ``WATCHED``, or until it came to rest again."""
    return status.state == SessionState.ENDED or status.time >= rest.time + WATCHED


def shifts(before: Frame, now: Frame) -> npt.NDArray[np.float32]:
    """How far each body that is in the domain in both frames moved [m]; empty if they are not of one pour."""
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
        return f"<b>The change itself moved the pile</b>; it was not poured with these values: {many}. {names}."
    acts = dict.fromkeys(WHEN.get(one.path.rpartition(".")[2], OTHERWISE) for one in found)
    little = many if loose else f"no body moved by more than {furthest}"
    return f"{names}: <b>the pile stands</b> ({little}); {', '.join(acts)}: shake it, tap it, or pour again."


def millimetres(length: float) -> str:
    """``length`` [m] to a tenth of a millimetre, or to the first digit below."""
    return f"{1e3 * length:.1f} mm" if length >= 1e-4 else f"{1e3 * length:.1g} mm"


def ghost_text(former: Rest, status: Status) -> str:
    """What the ghost is, in HTML; its angle stands beside that of the pour."""
    found = "; ".join(change_lines(differences(former.scene, status.scene)))
    return "Grey: the former pile" + (f"; since then {escape(found)}" if found else "") + "."
