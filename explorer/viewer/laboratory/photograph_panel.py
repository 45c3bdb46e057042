"""The angle of repose on a photograph, with what was read drawn over it."""

from __future__ import annotations

import math
from pathlib import Path

import viser

from explorer.files.measured_file import PICTURES
from explorer.laboratory.answers import photograph_answer
from explorer.viewer.actions import Post
from explorer.viewer.background_work import BackgroundWork
from explorer.viewer.laboratory.answer_view import AnswerView
from explorer.viewer.laboratory.upload_slot import UploadSlot
from solver.assets import shipped_assets

WAITING = "Camera level, the plate's edge in view. Choose a shipped picture or upload one, then: Read the angle."


class PhotographPanel:
    """Picture, scale, answer; ``folder`` keeps uploads."""

    def __init__(self, server: viser.ViserServer, folder: Path, post: Post, background: BackgroundWork) -> None:
        self._background, gui = background, server.gui
        with gui.add_folder("Photograph → angle of repose", expand_by_default=False):
            self._photo = UploadSlot(
                server, "Photograph", shipped_assets("photographs"), PICTURES, folder, post, "One pile, from the side."
            )
            self._scale = gui.add_number(
                "Scale [mm per pixel]", 0.0, min=0.0, max=10.0, step=0.001, hint="0: lengths stay in pixels."
            )
            read = gui.add_button("Read the angle", hint="By the estimator of the simulated piles.")
            self.view = AnswerView(server, WAITING, post)
        read.on_click(lambda _: post(self._read))

    def _read(self) -> None:
        photo, scale = self._photo.chosen, float(self._scale.value)
        given = scale if math.isfinite(scale) and scale > 0.0 else None
        self._background.start("reading the photograph", lambda: photograph_answer(photo, given), self.view.show)
