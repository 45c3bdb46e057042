"""The pile from the side with its flank fit, in the panel and in 3-D, overlaid with measured data."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import viser

from explorer.files.measured_curves import SUFFIXES, MeasuredCurve, measured_curves, measured_file
from explorer.files.uploads import unpacked_measurement
from explorer.viewer.actions import on_upload
from explorer.viewer.panel import POUR, Now, PageContext, Panel
from explorer.viewer.pour.outline_drawing import OutlineNodes, outline_html
from solver.assets import shipped_measurements
from solver.observables.repose import Outline

NONE, OWN = "none", "folder below"


class OutlinePanel(Panel):
    """The drawing, and the choice of its overlay: shipped data sets, and others."""

    name, tab, title, folded = "outline", POUR, "Silhouette and flank fit", False

    def __init__(self, page: PageContext) -> None:
        gui, post = page.server.gui, page.post
        self._background, self._uploads, self._nodes = page.background, page.uploads, OutlineNodes(page.server)
        self._drawn: tuple[Outline | None, MeasuredCurve | None, bool] = (None, None, False)
        self._curves: Mapping[str, MeasuredCurve] = {}
        self._measured: MeasuredCurve | None = None
        self._chosen = NONE
        self._reading: str | None = None
        self._html = gui.add_html(outline_html(None, None))
        self._in_scene = gui.add_checkbox(
            "Lines in 3-D", True, hint="Draw the lines of the flanks, and what was measured, in the scene too."
        )
        with gui.add_folder("Measured data over it", expand_by_default=False):
            self._data = gui.add_dropdown(
                "Measured",
                (NONE, *shipped_measurements(), OWN),
                hint="Lay a measured silhouette or profile over the pile.",
            )
            self._folder = gui.add_text(
                "Folder", "", hint="Folder with measurement.toml, on the machine that serves this page."
            )
            self._pixel = gui.add_number(
                "Photograph [mm per pixel]", 0.0, min=0.0, max=10.0, step=0.001, hint="Scale of a picture to come."
            )
            self._upload = gui.add_upload_button(
                "Upload measured data",
                mime_type=",".join((".zip", *SUFFIXES)),
                hint="A folder with measurement.toml as .zip, which is kept and can be diagnosed too; a scanned "
                "pile (.npz: xyz, radius), the points of an outline (.csv: u_m,z_m) or a photograph (.jpg, .png), "
                "which are drawn only.",
            )
            self._curve = gui.add_dropdown("Curve", (NONE,), disabled=True, hint="Which of its curves.")

        @self._data.on_update
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                chosen = str(event.target.value)
                post(lambda: self._choose_data(chosen))

        @self._folder.on_update
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                post(lambda: self._choose_data(OWN))

        @self._curve.on_update
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                chosen = str(event.target.value)
                post(lambda: self._choose_curve(chosen))

        on_upload(self._upload, self._take, post)

    def show(self, now: Now) -> None:
        """Draw what is new; a refused choice goes back to what is drawn."""
        if self._data.value != self._chosen and self._background.busy_with != self._reading:
            self._data.value = self._chosen  # type: ignore[misc]
        drawn = (now.status.outline, self._measured, bool(self._in_scene.value))
        if all(new is old for new, old in zip(drawn, self._drawn, strict=True)):
            return
        self._drawn = drawn
        self._nodes.show(*drawn)
        html = outline_html(now.status.outline, self._measured)
        if self._html.content != html:
            self._html.content = html

    def _take(self, name: str, content: bytes) -> None:
        """Overlay the pile with what was sent: a data set, which is kept, or a single curve."""
        if Path(name).suffix.lower() in SUFFIXES:
            scale = float(self._pixel.value)
            pixel = 1e-3 * scale if math.isfinite(scale) and scale > 0.0 else None
            self._background.start("reading the file", lambda: measured_file(name, content, pixel), self._offer_one)
        else:
            self._background.start("reading the measured data", lambda: self._kept(name, content), self._offer_kept)

    def _kept(self, name: str, content: bytes) -> tuple[Path, Mapping[str, MeasuredCurve]]:
        folder = unpacked_measurement(name, content, self._uploads)
        return folder, measured_curves(str(folder))

    def _offer_kept(self, found: tuple[Path, Mapping[str, MeasuredCurve]]) -> None:
        folder, curves = found
        self._folder.value = str(folder)  # type: ignore[misc]
        self._offer(OWN, curves)

    def _offer_one(self, curve: MeasuredCurve) -> None:
        self._offer(NONE, {curve.name: curve})

    def _choose_data(self, chosen: str) -> None:
        name = str(self._folder.value).strip() if chosen == OWN else chosen
        if chosen == NONE or not name:
            self._offer(chosen, {})
            return
        what = f"reading {name}"
        self._background.start(what, lambda: measured_curves(name), partial(self._offer, chosen))
        self._reading = what

    def _offer(self, chosen: str, curves: Mapping[str, MeasuredCurve]) -> None:
        self._chosen, self._curves = chosen, curves
        self._data.value = chosen  # type: ignore[misc]
        names = tuple(curves) or (NONE,)
        self._curve.options = names
        self._curve.value = names[0]  # type: ignore[misc]
        self._curve.disabled = not curves
        self._measured = curves.get(names[0])

    def _choose_curve(self, chosen: str) -> None:
        self._measured = self._curves.get(chosen)
