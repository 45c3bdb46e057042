"""A second pile beside the first, in a solver process of its own: it stays as it was poured while the first is changed.

Both are drawn in one scene, so every camera sees both. The second one plays and keeps speed with the first; where the
first one stands still, the second comes to the same moment, back or on.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from html import escape

import numpy as np
import viser

from explorer.live.messages import SessionState, Status
from explorer.outcomes import OUTCOME_SENTENCES
from explorer.scene.meshes import scene_height
from explorer.scene.source import changes
from explorer.session import Session
from explorer.viewer.actions import button_group
from explorer.viewer.panel import POUR, Now, PageContext, Panel
from explorer.viewer.pour.readout import STATE_WORDS, angle_of_repose_deg
from explorer.viewer.scene_nodes import PLATE_RADIUS, SceneNodes
from explorer.viewer.view import MIDDLE
from solver.pours.record import Outcome
from solver.scenes.scene import Scene

ROOT = "/second"
BESIDE = 2.15 * PLATE_RADIUS
"""Distance of the two rigs' axes [m]."""
DIFFERENCES_SHOWN = 6
NONE = "None yet. *Pour beside* keeps a pile as it is now, to compare with what you change."


class SecondPile(Panel):
    """Controls and nodes of the second pile. ``open_session`` makes the session that it runs in."""

    name, tab, title = "second_pile", POUR, "Second pile"

    def __init__(self, page: PageContext, open_session: Callable[[], Session] = Session) -> None:
        server, gui = page.server, page.server.gui
        self._server, self._first, self._open = server, page.session, open_session
        self._second: Session | None = None
        self._nodes: SceneNodes | None = None
        self._drawn: Scene | None = None
        self._frame_number = 0
        self._kept_for: object = None
        server.scene.add_frame(ROOT, show_axes=False, position=(BESIDE, 0.0, 0.0))
        acts = {"Pour beside": self._pour, "Take away": self.close}
        button_group(
            gui,
            "Second pile",
            acts,
            page.post,
            hint="The same seed, with the parameters as they are now; it stays so while you change the first pile.",
        )
        self._text = gui.add_markdown(NONE)

    def _pour(self) -> None:
        status = self._first.status()
        if self._second is None:
            self._second = self._open()
            step_aside(self._server, status.scene)
        self._second.start(status.scene, status.seed)

    def close(self) -> None:
        """End the second pour and take it off the page."""
        if self._second is not None:
            self._second.close()
            self._second = None
            self._remove_nodes()

    def draw(self, now: Now) -> None:
        """Draw its newest frame."""
        if self._second is None:
            return
        status, frame = self._second.status(), self._second.frame()
        if self._drawn is None or (status.scene.bodies, status.scene.rig) != (self._drawn.bodies, self._drawn.rig):
            self._remove_nodes()
            self._nodes, self._drawn = SceneNodes(self._server, status.scene, ROOT), status.scene
        if self._nodes is not None and frame is not None and frame.number != self._frame_number:
            self._frame_number = frame.number
            self._nodes.show(frame)
            self._nodes.show_gate(status.gate_shut)

    def show(self, now: Now) -> None:
        """Tell both results, and let time go or stand as in the first."""
        first = now.status
        second = None if self._second is None else self._second.status()
        moments = None if second is None else (second.state, second.time, first.state, first.time, first.speed)
        if self._second is not None and second is not None and moments != self._kept_for:
            # Once per moment: what was asked shows in a later status only.
            self._kept_for = moments
            keep_time(self._second, second, first)
        text = NONE if second is None else comparison_markdown(first, second)
        if self._text.content != text:
            self._text.content = text

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


def comparison_markdown(first: Status, second: Status) -> str:
    """Both piles side by side: what they do, their angles with the spread over flanks, and what differs."""
    rows = [
        ("", "first", "second"),
        (":--", "--:", "--:"),
        ("state", *(_state(status) for status in (first, second))),
        ("angle of repose", *(_angle(status) for status in (first, second))),
        ("mass below the outlet", *(f"{1e3 * status.discharged_mass:.1f} g" for status in (first, second))),
        ("simulated time", *(f"{status.time:.2f} s" for status in (first, second))),
    ]
    difference = angle_of_repose_deg(first) - angle_of_repose_deg(second)
    lines = ["\n".join(f"| {' | '.join(row)} |" for row in rows)]
    if math.isfinite(difference):
        lines.append(f"First − second: **{difference:+.1f}°**. One pour each: seeds alone scatter by degrees.")
    if second.state in (SessionState.FAILED, SessionState.DIED):
        lines.append(escape(second.message))
    if tuple(b.name for b in first.scene.bodies) == tuple(b.name for b in second.scene.bodies):
        found = list(changes(second.scene, first.scene))
        shown = [f"- `{line.replace('`', '')}`" for line in found[:DIFFERENCES_SHOWN]]
        more = [f"- and {len(found) - len(shown)} more"] if len(found) > len(shown) else []
        lines.append("Second → first:\n\n" + "\n".join(shown + more) if found else "Same parameters.")
    else:
        lines.append("Another material.")
    return "\n\n".join(lines)


def step_aside(server: viser.ViserServer, scene: Scene) -> None:
    """Move every camera so that both piles are in the picture."""
    aim = np.array([0.5 * BESIDE, 0.0, MIDDLE * scene_height(scene)])
    for client in server.get_clients().values():
        away = np.array(client.camera.position) - np.array(client.camera.look_at)
        least = 2.2 * BESIDE
        away *= max(1.0, least / max(float(np.linalg.norm(away)), 1e-6))
        client.camera.look_at = aim
        client.camera.position = aim + away


def _state(status: Status) -> str:
    return STATE_WORDS[status.state] if status.outcome == Outcome.RUNNING else OUTCOME_SENTENCES[status.outcome]


def _angle(status: Status) -> str:
    found = status.observables.get("angle_of_repose_deg")
    if found is None or not math.isfinite(found.value):
        return "–"
    return f"{found.value:.1f}°" + ("" if found.spread is None else f" ± {found.spread:.1f}°")
