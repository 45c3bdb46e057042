"""Exports of what is on the screen: the command line that repeats it, files, pictures."""

from __future__ import annotations

import re
from collections.abc import Callable
from html import escape
from typing import Any

import viser

from explorer.errors import CommandError
from explorer.files.exports import bodies_csv, bodies_stl
from explorer.live.frames import Frame
from explorer.scene.source import SceneSource, command_line
from explorer.scene.text import material_toml
from explorer.viewer.look.colour_by import QUANTITIES, colour_key
from explorer.viewer.look.force_chains import MN, strongest_drawn
from explorer.viewer.output.picture import Legend, PicturePanel
from explorer.viewer.output.send_file import send_file
from explorer.viewer.palette import component_colour
from explorer.viewer.panel import EXPORT, Now, PageContext, Panel
from explorer.viewer.view import small_html
from solver.scenes.scene import Scene


class OutputPanel(Panel):
    """Command line, and exports."""

    name, tab = "output", EXPORT

    def __init__(self, page: PageContext) -> None:
        self._session, self._background, self._post = page.session, page.background, page.post
        self._compared: tuple[SceneSource, Scene, int] | None = None
        gui = page.server.gui
        gui.add_markdown("**This pour on the command line**, from the start with the parameters now in force:")
        self._command = gui.add_html("")
        gui.add_markdown("**Files of what is on the screen**")
        hints = {
            "Scene (TOML)": ("A material file that every command takes, with rig and parameters.", self._scene),
            "Bodies (CSV)": ("Component, mass, place and orientation of every body, SI.", self._bodies),
            "Bodies (STL)": ("True shapes of all bodies where they are, in millimetres.", self._mesh),
        }
        self._exports = {}
        for label, (hint, act) in hints.items():
            self._exports[label] = gui.add_button(label, hint=hint)
            self._listen(self._exports[label], act)
        self._look = page.look
        self._picture = PicturePanel(gui, page.post, page.background, self._picture_name, self._legend)

    def show(self, now: Now) -> None:
        """Show the command line of what is on the screen."""
        present = (self._session.source, now.status.scene, now.status.seed)
        if self._compared is None or present != self._compared:
            self._compared = present
            self._command.content = command_html(*present)

    def _listen(self, button: Any, act: Callable[[Any], None]) -> None:
        def pressed(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:
                client = event.client
                self._post(lambda: act(client))

        button.on_click(pressed)

    def _scene(self, client: Any) -> None:
        status = self._session.status()
        heading = (
            f"{status.scene.title}, as on the page at {status.time:.3f} s of the pour with seed {status.seed}. SI."
        )
        send_file(client, "scene.toml", material_toml(status.scene, heading).encode())

    def _bodies(self, client: Any) -> None:
        frame, scene = self._drawn()
        send_file(client, f"bodies_{frame.time:.3f}s.csv", bodies_csv(frame, scene).encode())

    def _mesh(self, client: Any) -> None:
        frame, scene = self._drawn()
        name = f"bodies_{frame.time:.3f}s_mm.stl"
        self._background.start(
            "making the mesh", lambda: bodies_stl(frame, scene), lambda made: send_file(client, name, made)
        )

    def _picture_name(self) -> str:
        return f"picture_{self._session.status().time:.3f}s.png"

    def _legend(self) -> Legend:
        """What the picture shows at present."""
        look, details = self._look.look, self._session.details()
        strongest = MN * strongest_drawn(details, look.threshold) if look.chains and details is not None else None
        if look.colour_by in QUANTITIES:
            return Legend(colours=colour_key(look, QUANTITIES[look.colour_by], details), strongest=strongest)
        frame, scene = self._session.frame(), self._session.status().scene
        there = set() if frame is None else set(frame.component[frame.inside].tolist())
        names = [(body.name, component_colour(k)) for k, body in enumerate(scene.bodies) if k in there]
        return Legend(names, strongest=strongest)

    def _drawn(self) -> tuple[Frame, Scene]:
        frame = self._session.frame()
        if frame is None:
            raise CommandError("no body has entered yet")
        return frame, self._session.status().scene


def command_html(source: SceneSource, scene: Scene, seed: int) -> str:
    """The command line in a box that one click selects as a whole; in words if there is none."""
    try:
        line, select = command_line(source, scene, seed), "all"
    except CommandError as error:
        line, select = f"None: {error}", "auto"
    style = f"display:block; user-select:{select}; white-space:pre-wrap; padding:0.4em; margin-bottom:0.6em"
    # Each option stays with its value, and no line breaks at a hyphen inside an option.
    whole = "<span style='display:inline-block; max-width:100%'>{}</span>"
    words = " ".join(whole.format(escape(part)) for part in re.split(r" (?=--)", line))
    return small_html(f"<code style='{style}; background:rgba(128,150,170,0.14)'>{words}</code>")
