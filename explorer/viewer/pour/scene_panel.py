"""Another rig, material, shape or funnel: each starts a new pour, and becomes the default that changes refer to."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import viser

from explorer.errors import CommandError
from explorer.files.uploads import funnel_source, shaped_source, uploaded_material
from explorer.scene.source import SceneSource, prepared_source, rig_source
from explorer.viewer.actions import on_upload
from explorer.viewer.panel import SET_UP, Now, PageContext, Panel
from explorer.viewer.view import small_html
from solver.assets import shipped_assets
from solver.rigs import RIGS
from solver.scenes.scene import Scene, check
from solver.shapes.mesh_file import LENGTH_UNITS, SUFFIXES

OWN = "file below"
"""Entry of the list that stands for the file in the text field."""
NO_SCENE = "choose …"
UNIT_OF_FILE = "as usual"
"""Unit choice for a mesh that means the unit of its format, or else millimetres."""

WORKING = "Reading what was asked for; the pour goes on until that is done."


class ScenePanel(Panel):
    """Choices of rig and material with a button, and uploads of a material, a body's shape or a funnel."""

    name, tab, title = "scene", SET_UP, "Rig and material"

    def __init__(self, page: PageContext) -> None:
        gui, post = page.server.gui, page.post
        self._session, self._folder, self._background = page.session, page.uploads, page.background
        scene = page.session.status().scene
        self._generation = 0
        self._shipped = shipped_assets("materials")
        self._rig = gui.add_dropdown("Rig", tuple(RIGS), hint="What the bodies are poured into.")
        self._material = gui.add_dropdown(
            "Material", (*self._shipped, OWN), hint="Materials that come with the program, or a file of your own."
        )
        self._prepared = gui.add_dropdown(
            "Prepared scene",
            (NO_SCENE, *shipped_assets("scenes")),
            hint="A small scene each in which friction, restitution or stiffness is seen at once: move its slider.",
        )
        self._file = gui.add_text("File", "", hint="Material file (TOML), on the machine that serves this page.")
        self._sent = gui.add_upload_button(
            "Upload a material and pour",
            mime_type=".toml",
            hint="A material file (TOML) of yours, in the rig that it says itself; without one in the funnel.",
        )
        pour = gui.add_button("Pour this", hint="A new pour; changes are then counted from this material and rig.")
        with gui.add_folder("Shape or funnel from a mesh", expand_by_default=False):
            self._unit = gui.add_dropdown(
                "Unit",
                (UNIT_OF_FILE, *LENGTH_UNITS),
                hint="Unit of the coordinates in the file; as usual: metres in .glb, millimetres in the others.",
            )
            self._body = gui.add_dropdown("Body", _names(scene), hint="The component that gets the shape.")
            self._upload = gui.add_upload_button(
                "Upload a body and pour",
                mime_type=",".join(SUFFIXES),
                hint="A closed surface (STL, OBJ, PLY, GLB). Its member spheres are fitted first.",
            )
            self._funnel = gui.add_upload_button(
                "Upload a funnel and pour",
                mime_type=",".join(SUFFIXES),
                hint="A surface, z up, open at both ends, thin or with walls; its outlet is put over the plate.",
            )
        self._doing = gui.add_html("")
        pour.on_click(lambda _: post(self._pour))

        @self._prepared.on_update
        def _(event: viser.GuiEvent[Any]) -> None:
            chosen = str(event.target.value)
            if event.client_id is not None and chosen != NO_SCENE:
                post(lambda: self._pour_prepared(chosen))

        on_upload(self._sent, self._take_material, post)
        on_upload(self._upload, self._take_shape, post)
        on_upload(self._funnel, self._take_funnel, post)

    def show(self, now: Now) -> None:
        """Follow a pour that was started elsewhere."""
        status = now.status
        if status.generation != self._generation:
            self._generation = status.generation
            if status.scene.rig.name in RIGS:
                self._rig.value = status.scene.rig.name  # type: ignore[misc]
            if self._body.options != _names(status.scene):
                self._body.options = _names(status.scene)
            self._show_material(self._session.source.material)
        doing = small_html(WORKING if self._background.busy_with else "")
        if self._doing.content != doing:
            self._doing.content = doing

    def _show_material(self, material: str) -> None:
        """Select the material that is being poured, if its source names one."""
        if material in self._shipped:
            self._material.value = material  # type: ignore[misc]
        elif material:
            self._material.value, self._file.value = OWN, material  # type: ignore[misc]

    def _pour(self) -> None:
        rig = str(self._rig.value)
        material = str(self._file.value).strip() if self._material.value == OWN else str(self._material.value)
        if rig not in RIGS:
            raise CommandError(f"rig {rig[:60]!r}; allowed: {', '.join(RIGS)}")
        if not material:
            raise CommandError("material: name a file, or choose one from the list")
        self._begin("reading the material", lambda: _checked(rig_source(rig, material)))

    def _pour_prepared(self, name: str) -> None:
        self._prepared.value = NO_SCENE  # type: ignore[misc]
        if name not in shipped_assets("scenes"):
            raise CommandError(f"scene {name[:60]!r}: no such scene")
        self._begin("reading the scene", lambda: _checked(prepared_source(name)))

    def _take_material(self, name: str, content: bytes) -> None:
        folder = self._folder
        self._begin("reading the material", lambda: uploaded_material(name, content, folder))

    def _take_shape(self, name: str, content: bytes) -> None:
        present, body, unit = self._session.status().scene, str(self._body.value), self._given_unit()
        self._begin("fitting member spheres", lambda: shaped_source(present, body, name, content, unit, self._folder))

    def _take_funnel(self, name: str, content: bytes) -> None:
        present, unit = self._session.status().scene, self._given_unit()
        self._begin("reading the funnel", lambda: funnel_source(present, name, content, unit, self._folder))

    def _given_unit(self) -> str | None:
        """Unit of a mesh's coordinates; None for that of its format."""
        unit = str(self._unit.value)
        if unit not in (UNIT_OF_FILE, *LENGTH_UNITS):
            raise CommandError(f"unit {unit[:60]!r}; allowed: {', '.join(LENGTH_UNITS)}")
        return None if unit == UNIT_OF_FILE else unit

    def _begin(self, what: str, find: Callable[[], SceneSource]) -> None:
        self._background.start(what, find, self._start)

    def _start(self, source: SceneSource) -> None:
        self._session.start(source.scene, self._session.status().seed, source)


def _names(scene: Scene) -> tuple[str, ...]:
    return tuple(body.name for body in scene.bodies)


def _checked(source: SceneSource) -> SceneSource:
    """``source``. Raises ParameterError if its bodies do not fit into the rig."""
    check(source.scene)
    return source
