"""The angle of repose on a photograph, with what was read drawn over it."""

from __future__ import annotations

from collections.abc import Callable

from explorer.files.measured_curves import PICTURES
from explorer.laboratory.command_results import CommandResult, Ruler, compared_result, photograph_result
from explorer.viewer.laboratory.answer_view import AnswerView
from explorer.viewer.laboratory.inputs import UploadSlot, positive
from explorer.viewer.panel import LABORATORY, PageContext, Panel
from solver.assets import shipped_assets

WAITING = "Camera level, the plate's edge in view. Choose a shipped picture or upload one, then: Read the angle."


class PhotographPanel(Panel):
    """Picture, scale, answer; uploads are kept, and the pours that pictures are compared with."""

    name, tab, title = "photograph", LABORATORY, "Photograph → angle of repose"

    def __init__(self, page: PageContext) -> None:
        server, gui, folder, post = page.server, page.server.gui, page.uploads, page.post
        self._session, self._folder, self._background = page.session, folder, page.bench_work
        self._photo = UploadSlot(
            server, "Photograph", shipped_assets("photographs"), PICTURES, folder, post, "One pile, from the side."
        )
        self._scale = gui.add_number(
            "Scale [mm per pixel]", 0.0, min=0.0, max=10.0, step=0.001, hint="0: lengths stay in pixels."
        )
        self._bar = gui.add_number(
            "Reference bar [mm]",
            0.0,
            min=0.0,
            max=10_000.0,
            step=0.1,
            hint="Length of the one straight bar in the picture, in place of the scale; 0: there is none.",
        )
        read = gui.add_button("Read the angle", hint="By the estimator of the simulated piles.")
        beside = gui.add_button(
            "Read it beside a pour",
            hint="Pours what is on the screen once more, in the background, and reads both piles by the same fit.",
        )
        self.view = AnswerView(server, WAITING, post)
        read.on_click(lambda _: post(self._read))
        beside.on_click(lambda _: post(self._compare))

    def _read(self) -> None:
        photo, ruler = self._photo.chosen, self._ruler()
        self._answer("reading the photograph", lambda: photograph_result(photo, ruler))

    def _compare(self) -> None:
        photo, ruler, scene, folder = self._photo.chosen, self._ruler(), self._session.status().scene, self._folder
        self._answer("pouring beside the photograph", lambda: compared_result(photo, ruler, scene, folder))

    def _answer(self, what: str, find: Callable[[], CommandResult]) -> None:
        self._background.start(what, find, self.view.show)

    def _ruler(self) -> Ruler:
        return Ruler(positive(self._scale.value), positive(self._bar.value))
