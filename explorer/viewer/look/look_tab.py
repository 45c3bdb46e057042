"""The tab "Look": how the pour is drawn, where the camera stands, and one body under inspection."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import viser

from explorer.live.details import Details
from explorer.live.frames import Frame
from explorer.screen_units import InputError
from explorer.session import Session
from explorer.viewer.actions import Post
from explorer.viewer.look.camera import DIRECTIONS, go_along, go_to, link_to, view_of
from explorer.viewer.look.colouring import body_colours
from explorer.viewer.look.force_chains import ForceChains
from explorer.viewer.look.inspector import body_html
from explorer.viewer.look.look import COMPONENT, in_sight
from explorer.viewer.look.look_panel import LookPanel
from explorer.viewer.look.picking import nearest_hit
from explorer.viewer.scene_nodes import SceneNodes
from explorer.viewer.view import light
from solver.scene import Scene

GHOST = 0.22
"""Opacity of bodies while force chains are drawn through them."""
FOLLOW, RELEASE, LINK = "Follow", "Release", "Link to this view"
BEFORE, AFTER = "Previous", "Next"
FOLLOW_KEY: Any = "F"
RELEASE_KEY: Any = "escape"
BEFORE_KEY: Any = "P"
AFTER_KEY: Any = "N"
VIEW_KEYS: dict[str, Any] = dict(zip(DIRECTIONS, ("1", "2", "3", "4"), strict=True))


class LookTab:
    """Draws the newest frame as the person wants to see it. Call :meth:`show` in the page's loop.

    ``bar`` explains the colours; it stands where it is seen beside every tab.
    """

    def __init__(self, server: viser.ViserServer, session: Session, bar: viser.GuiHtmlHandle, post: Post) -> None:
        self._server, self._session = server, session
        self._panel, self._chains = LookPanel(server, bar, post), ForceChains(server)
        self._selected: int | None = None
        self._followers: set[int] = set()
        self._drawn: tuple[SceneNodes, Frame] | None = None
        self._moved_for: object = None
        self._painted_for: object = None
        self._faded_for: object = None
        self._shadows = True
        self._chained_for: object = None
        self._told_for: object = None
        self._build(post)

    @property
    def by_component(self) -> bool:
        """Whether a body's colour says what it is."""
        return self._panel.look.colour_by == COMPONENT

    def _build(self, post: Post) -> None:
        gui = self._server.gui
        with gui.add_folder("Camera"):
            views = gui.add_button_group("View", tuple(DIRECTIONS), hint="Keys 1, 2, 3, 4.")
            link = gui.add_button(LINK, hint="Puts the address of what you see into the field below.")
            self._link: Any = gui.add_text("Address", "", hint="Opens the page with this view.")
        with gui.add_folder("Body"):
            self._text = gui.add_html("")
            acts = {
                FOLLOW: self._follow,
                RELEASE: lambda client: self._release(),
                BEFORE: lambda client: self._step(-1),
                AFTER: lambda client: self._step(1),
            }
            body = gui.add_button_group(
                "Camera and body",
                tuple(acts),
                hint="F: the camera of this browser goes along with the body, or stays. Escape, or a click beside all "
                "bodies: lets it go. P, N: the body in sight that entered before or after it; at first the topmost.",
            )

        @views.on_click
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None and event.target.value in DIRECTIONS:
                post(partial(self._look_from, event.client, event.target.value))

        @link.on_click
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:
                post(partial(self._show_link, event.client))

        @body.on_click
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None and event.target.value in acts:
                post(partial(acts[event.target.value], event.client))

        for name, key in VIEW_KEYS.items():
            self._key(post, f"View: {name.lower()}", key, partial(self._look_from, name=name))
        self._key(post, "Follow the body that was clicked", FOLLOW_KEY, self._follow)
        self._key(post, "Let the body go", RELEASE_KEY, acts[RELEASE])
        self._key(post, "Inspect the body that entered before", BEFORE_KEY, acts[BEFORE])
        self._key(post, "Inspect the next body", AFTER_KEY, acts[AFTER])

        @self._server.scene.on_click()
        def _(event: viser.SceneClickEvent) -> None:
            origin, direction = event.ray_origin, event.ray_direction
            post(lambda: self.click(np.array(origin, dtype=float), np.array(direction, dtype=float)))

    def _key(self, post: Post, label: str, key: Any, act: Any) -> None:
        def pressed(event: Any) -> None:
            if event.client is not None:
                post(partial(act, event.client))

        self._server.gui.add_command(label, hotkey=key).on_trigger(pressed)

    def show(self, nodes: SceneNodes, frame: Frame, scene: Scene) -> None:
        """Draw ``frame``; call it inside ``server.atomic()``, as often as the page looks for frames."""
        look, details = self._panel.look, self._session.details()
        if self._drawn is None or self._drawn[1].generation != frame.generation:
            self._release()
        if self._selected is not None and self._selected >= len(frame.component):
            self._release()  # the pour was brought back to before it entered
        self._session.watch(look.needs_details or self._selected is not None, self._selected)
        self._drawn = nodes, frame
        seen = in_sight(frame, look)
        moved = (id(nodes), frame.number, look.cut_away, look.cut_at)
        if moved != self._moved_for:
            self._moved_for = moved
            nodes.show(frame, seen)
            self._go_along(frame)
        self._paint(nodes, frame, details)
        self._show_chains(frame, seen, details)
        self._tell(scene, frame, details)

    def _paint(self, nodes: SceneNodes, frame: Frame, details: Details | None) -> None:
        look = self._panel.look
        values = details.number if details is not None and look.colour_by != COMPONENT else 0
        colours = (look.colour_by, look.automatic, look.low, look.high)
        painted = (id(nodes), frame.generation, len(frame.component), colours, values, self._selected)
        if painted != self._painted_for:
            self._painted_for = painted
            nodes.paint(frame, body_colours(frame, details, look, self._selected))
        faded = (id(nodes), look.chains, look.rig_opacity)
        if faded != self._faded_for:
            self._faded_for = faded
            nodes.fade(GHOST if look.chains else None, look.rig_opacity)
        if look.shadows != self._shadows:
            self._shadows = look.shadows
            light(self._server, look.shadows)

    def _show_chains(self, frame: Frame, seen: Any, details: Details | None) -> None:
        look = self._panel.look
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

    def _tell(self, scene: Scene, frame: Frame, details: Details | None) -> None:
        told = (self._panel.look, self._selected, frame.generation, details.number if details is not None else 0)
        if told == self._told_for:
            return
        self._told_for = told
        self._panel.show(details)
        self._text.content = body_html(scene, frame, details, self._selected)

    def click(self, origin: Any, direction: Any) -> None:
        """A click into the scene: its ray [m] meets a body, which is inspected from now on, or none."""
        if self._drawn is None:
            return
        nodes, frame = self._drawn
        hit = nearest_hit(nodes.meshes, frame, in_sight(frame, self._panel.look), origin, direction)
        if hit != self._selected:
            self._release()
            self._selected = hit

    def _step(self, by: int) -> None:
        """Inspect the body in sight that entered next (by = 1) or before (-1), around; without one the topmost."""
        if self._drawn is None:
            return
        _, frame = self._drawn
        seen = np.flatnonzero(in_sight(frame, self._panel.look))
        if len(seen) == 0:
            raise InputError("no body is in sight")
        if self._selected is None:
            self._selected = int(seen[np.argmax(frame.position[seen, 2])])
            return
        place = (
            np.searchsorted(seen, self._selected, side="right") if by > 0 else np.searchsorted(seen, self._selected) - 1
        )
        self._selected = int(seen[place % len(seen)])

    def _release(self) -> None:
        self._selected = None
        self._followers.clear()

    def _follow(self, client: Any) -> None:
        """Let the camera of ``client`` go along with the body, or no longer."""
        if self._selected is None:
            raise InputError("click a body first: there is none to follow")
        self._followers ^= {client.client_id}
        if self._drawn is not None:
            self._go_along(self._drawn[1])

    def _go_along(self, frame: Frame) -> None:
        if self._selected is None or not self._followers:
            return
        clients = self._server.get_clients()
        self._followers &= set(clients)
        go_along((clients[number] for number in self._followers), frame.position[self._selected].astype(float))

    def _look_from(self, client: Any, name: str) -> None:
        self._followers.discard(client.client_id)
        go_to(client, view_of(self._session.status().scene, name))

    def _show_link(self, client: Any) -> None:
        self._link.value = link_to(self._server, client.camera)
