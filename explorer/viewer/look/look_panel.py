"""The tab "Look": how the pour is drawn, the camera, and one body under inspection."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import viser

from explorer.live.details import Details
from explorer.live.frames import Frame
from explorer.scene.meshes import outlet_height, scene_height
from explorer.units import InputError
from explorer.viewer.actions import ClientAction, Post, add_client_key, client_buttons
from explorer.viewer.look.camera import CameraPanel, go_along, pile_points
from explorer.viewer.look.colour_by import QUANTITIES, ColourPanel
from explorer.viewer.look.drawn_look import DrawnLook
from explorer.viewer.look.force_chains import ForceChains, ForcePanel, chain_key
from explorer.viewer.look.inspector import body_html, nearest_hit
from explorer.viewer.look.look import in_sight
from explorer.viewer.look.look_settings import CutPanel
from explorer.viewer.panel import LOOK, Now, PageContext, Panel
from explorer.viewer.scene_nodes import SceneNodes, another_set_up
from explorer.viewer.view import look_at_height
from solver.scenes.scene import Scene

FOLLOW, RELEASE = "Follow", "Release"
BEFORE, AFTER = "Previous", "Next"
FOLLOW_KEY: Any = "F"
RELEASE_KEY: Any = "escape"
BEFORE_KEY: Any = "P"
AFTER_KEY: Any = "N"


class LookPanel(Panel):
    """Draws the newest frame as the user wants to see it, and holds the settings for that."""

    name, tab = "look", LOOK

    def __init__(self, page: PageContext) -> None:
        server, session, post = page.server, page.session, page.post
        self._server, self._session, self._settings = server, session, page.look
        self._beside = page.beside
        self._status = session.status()
        self._scene = self._status.scene
        self._nodes = SceneNodes(server, self._scene)
        look_at_height(server, scene_height(self._scene))
        self._colours = ColourPanel(server, page.colour_bar, self._settings, QUANTITIES, post)
        self._forces, self._chains = ForcePanel(server, self._settings, post), ForceChains(server)
        CutPanel(server, self._settings, post)
        self._on_page = DrawnLook(server)
        self._selected: int | None = None
        self._followers: set[int] = set()
        self._drawn: Frame | None = None
        self._chained_for: object = None
        self._told_for: object = None
        CameraPanel(server, post, lambda: scene_height(session.status().scene), self._pile, self._stay, page.pour_text)
        self._add_inspector(post)

    def _add_inspector(self, post: Post) -> None:
        gui = self._server.gui
        acts: dict[str, ClientAction] = {
            FOLLOW: self._follow,
            RELEASE: lambda client: self._release(),
            BEFORE: lambda client: self._step(-1),
            AFTER: lambda client: self._step(1),
        }
        with gui.add_folder("Body"):
            self._text = gui.add_html("")
            client_buttons(
                gui,
                "Camera and body",
                acts,
                post,
                hint="F: the camera of this browser goes along with the body, or stays. Escape, or a click beside all "
                "bodies: lets it go. P, N: the body in sight that entered before or after it; at first the topmost.",
            )
        add_client_key(gui, "Follow the body that was clicked", FOLLOW_KEY, acts[FOLLOW], post)
        add_client_key(gui, "Let the body go", RELEASE_KEY, acts[RELEASE], post)
        add_client_key(gui, "Inspect the body that entered before", BEFORE_KEY, acts[BEFORE], post)
        add_client_key(gui, "Inspect the next body", AFTER_KEY, acts[AFTER], post)

        @self._server.scene.on_click()
        def _(event: viser.SceneClickEvent) -> None:
            origin, direction = event.ray_origin, event.ray_direction
            post(lambda: self.click(np.array(origin, dtype=float), np.array(direction, dtype=float)))

    def draw(self, now: Now) -> None:
        """Draw the newest frame; of a new pour, nothing until there is one."""
        generation, self._status = self._status.generation, now.status
        if now.status.generation != generation:
            self._clear(now.status.scene)
        self._nodes.widest = self._beside.widest_plate
        if now.frame is not None:
            fresh = self._drawn is None or now.frame.number != self._drawn.number
            self._show_frame(now.frame)
            if fresh:
                self._nodes.show_gate(now.status.gate_shut)

    def _clear(self, scene: Scene) -> None:
        """Another pour: no bodies yet, and another rig if it has one."""
        if another_set_up(scene, self._scene):
            self._nodes.remove()
            self._nodes, self._scene, self._drawn = SceneNodes(self._server, scene), scene, None
            look_at_height(self._server, scene_height(scene))
        self._nodes.clear()

    def _show_frame(self, frame: Frame) -> None:
        look, details, nodes = self._settings.look, self._session.details(), self._nodes
        if self._drawn is None or self._drawn.generation != frame.generation:
            self._release()
        if self._selected is not None and self._selected >= len(frame.component):
            self._release()  # the pour was brought back to before it entered
        self._session.watch(look.needs_details or self._selected is not None, self._selected)
        self._drawn = frame
        seen = in_sight(frame, look)
        if self._on_page.move(nodes, frame, look, seen):
            self._go_along(frame)
        self._on_page.paint(nodes, frame, look, self._colours.quantity, details, self._selected)
        self._show_chains(frame, seen, details)
        self._tell(frame, details)

    def _show_chains(self, frame: Frame, seen: Any, details: Details | None) -> None:
        look = self._settings.look
        cut = (look.cut_away, look.cut_at)
        number = details.number if look.chains and details is not None else 0
        chained = (frame.generation, number, look.threshold, cut)
        if chained == self._chained_for:
            return
        self._chained_for = chained
        if number and details is not None:
            self._chains.show(frame, seen, details, look.threshold)
        else:
            self._chains.hide()

    def _tell(self, frame: Frame, details: Details | None) -> None:
        told = (self._settings.look, self._selected, frame.generation, details.number if details is not None else 0)
        if told == self._told_for:
            return
        self._told_for = told
        self._colours.show(details, chain_key(details, self._settings.look))
        self._forces.show(details)
        self._text.content = body_html(self._status.scene, frame, details, self._selected)

    def click(self, origin: Any, direction: Any) -> None:
        """A click into the scene: its ray [m] hits a body, which is inspected from now on, or none."""
        if self._drawn is None:
            return
        seen = in_sight(self._drawn, self._settings.look)
        hit = nearest_hit(self._nodes.meshes, self._drawn, seen, origin, direction)
        if hit != self._selected:
            self._release()
            self._selected = hit

    def _step(self, by: int) -> None:
        """Inspect the body in sight that entered next (by = 1) or before (-1), around; without one the topmost."""
        if self._drawn is None:
            return
        seen = np.flatnonzero(in_sight(self._drawn, self._settings.look))
        if len(seen) == 0:
            raise InputError("no body is in sight")
        if self._selected is None:
            self._selected = int(seen[np.argmax(self._drawn.position[seen, 2])])
            return
        place = (
            np.searchsorted(seen, self._selected, side="right") if by > 0 else np.searchsorted(seen, self._selected) - 1
        )
        self._selected = int(seen[place % len(seen)])

    def _release(self) -> None:
        self._selected = None
        self._followers.clear()

    def _follow(self, client: Any) -> None:
        """Let the camera of ``client`` follow the body, or stop following it."""
        if self._selected is None:
            raise InputError("click a body first: there is none to follow")
        self._followers ^= {client.client_id}
        if self._drawn is not None:
            self._go_along(self._drawn)

    def _go_along(self, frame: Frame) -> None:
        if self._selected is None or not self._followers:
            return
        clients = self._server.get_clients()
        self._followers &= set(clients)
        go_along((clients[number] for number in self._followers), frame.position[self._selected].astype(float))

    def _pile(self) -> npt.NDArray[np.float64]:
        return pile_points(self._drawn, outlet_height(self._scene.rig))

    def _stay(self, client: Any) -> None:
        """The camera of ``client`` no longer follows a body."""
        self._followers.discard(client.client_id)
