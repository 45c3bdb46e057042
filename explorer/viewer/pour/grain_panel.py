"""A user's own grain without a file: its shape, sizes, density and friction are poured and kept as a material."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import Any

import viser

from explorer.background.command_output import kept_scene
from explorer.errors import CommandError
from explorer.scene.grain import DENSITY, FRICTION, SHAPES, WALL_FRICTION, Grain, grain_scene, write_grain
from explorer.scene.source import SceneSource, material_source
from explorer.scene.starter_files import check_name, starter_scene
from explorer.shape import LARGEST_EXTENT, LEAST_EXTENT
from explorer.units import checked, screen_unit
from explorer.viewer.number_box import with_decimals
from explorer.viewer.panel import SET_UP, PageContext, Panel
from explorer.viewer.view import small_html
from solver import parameters, value

STARTER = Path("my_grain.toml")
ALONE = (
    "What is not asked for is that of the starter material. A scan goes in above, under Shape or funnel from a mesh; "
    "mixtures take a material file."
)
FEWEST, MOST, USUAL = 10, 3000, 150
"""Number of grains that are poured: least, most, and by default."""


class GrainPanel(Panel):
    """The form, a button that pours, and one that keeps."""

    name, tab, title = "grain", SET_UP, "A grain of your own"

    def __init__(self, page: PageContext) -> None:
        gui, post = page.server.gui, page.post
        self._session, self._uploads, self._background = page.session, page.uploads, page.background
        self._folder = page.project.folder or page.data / "materials"
        starter = starter_scene(STARTER)
        self._declared = parameters(starter)
        length, width, thickness = (1e3 * extent for extent in starter.bodies[0].extents)
        self._name = gui.add_text("Name of the grain", STARTER.stem, hint="Letters, digits, - and _; of the file, too.")
        self._shape = gui.add_dropdown("Shape", tuple(SHAPES), hint="Its sizes are full lengths.")
        usual = {"Diameter": width, "Length": length, "Width": width, "Thickness": thickness}
        self._sizes = {
            name: gui.add_number(
                f"{name} [mm]", size, min=1e3 * LEAST_EXTENT, max=1e3 * LARGEST_EXTENT, step=0.01, hint="Of one grain."
            )
            for name, size in usual.items()
        }
        self._numbers = {
            path: with_decimals(
                gui.add_number(
                    title, value(starter, path), min=self._declared[path].low, max=self._declared[path].high, hint=hint
                )
            )
            for path, title, hint in (
                (DENSITY, f"Density [{screen_unit(self._declared[DENSITY]).symbol}]", "Of one grain, not of the bulk."),
                (FRICTION, "Friction between grains", "Static: tangent of the angle at which one slides off another."),
                (WALL_FRICTION, "Friction on funnel and plate", "Static: tangent of the angle at which one slides."),
            )
        }
        self._number = gui.add_number("Grains", USUAL, min=FEWEST, max=MOST, step=1, hint="How many are poured.")
        pour = gui.add_button("Pour this grain", hint="A new pour; changes are then counted from this material.")
        keep = gui.add_button("Keep as a file", hint=f"NAME.toml in {self._folder}.")
        self._told = gui.add_html(small_html(escape(ALONE)))
        self._follow()

        @self._shape.on_update
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                post(self._follow)

        pour.on_click(lambda _: post(self._pour))
        keep.on_click(lambda _: post(self._keep))

    def _follow(self) -> None:
        """Show the inputs for the sizes of the shape."""
        for name, box in self._sizes.items():
            box.visible = name in SHAPES[self._chosen][1]

    @property
    def _chosen(self) -> str:
        shape = str(self._shape.value)
        if shape not in SHAPES:
            raise CommandError(f"shape {shape[:60]!r}; allowed: {', '.join(SHAPES)}")
        return shape

    def _grain(self) -> Grain:
        """The grain from the form; raises a ValueError in one line."""
        name, shape = check_name(str(self._name.value).strip()), self._chosen
        low, high = 1e3 * LEAST_EXTENT, 1e3 * LARGEST_EXTENT
        lengths = tuple(1e-3 * checked(self._sizes[one].value, low, high, one) for one in SHAPES[shape][1])
        density, friction, wall_friction = (
            checked(box.value, self._declared[path].low, self._declared[path].high, path)
            for path, box in self._numbers.items()
        )
        number = int(checked(self._number.value, FEWEST, MOST, "grains"))
        return Grain(name, shape, lengths, density, friction, wall_friction, number)

    def _pour(self) -> None:
        grain, folder = self._grain(), self._uploads

        def find() -> SceneSource:
            scene = grain_scene(grain)
            _ = scene.bodies[0].clump  # fitted here, which takes seconds
            return material_source(str(kept_scene(scene, folder)))

        self._background.start("fitting member spheres", find, self._start)

    def _start(self, source: SceneSource) -> None:
        self._session.start(source.scene, self._session.status().seed, source)

    def _keep(self) -> None:
        path = write_grain(self._folder, self._grain())
        self._told.content = small_html(
            f"Kept as {escape(str(path))}. <code>explorer serve --material {escape(str(path))}</code> opens it with a "
            "study of its own."
        )
