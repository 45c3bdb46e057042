"""A published calibration recomputed from its own tables."""

from __future__ import annotations

from pathlib import Path

import viser

from explorer.audit.entries import FILE
from explorer.audit.read_study import read_study
from explorer.files.uploads import unpacked_folder
from explorer.laboratory.answers import audit_answer
from explorer.viewer.actions import Post
from explorer.viewer.background_work import BackgroundWork
from explorer.viewer.buttons import on_upload
from explorer.viewer.laboratory.answer_view import AnswerView

WAITING = "Every figure of a published study that can be recomputed: reproduced, differs, or cannot be checked."


class AuditPanel:
    """The shipped article, or tables that a browser sent; ``folder`` keeps them."""

    def __init__(self, server: viser.ViserServer, folder: Path, post: Post, background: BackgroundWork) -> None:
        self._background, self._folder, gui = background, folder, server.gui
        with gui.add_folder("Audit of a published study", expand_by_default=False):
            audit = gui.add_button("Audit the shipped article", hint="Processes 2022, 10, 185, from its ten tables.")
            upload = gui.add_upload_button(
                "Upload tables and audit", mime_type=".zip", hint=f"A folder with {FILE} and its tables, as .zip."
            )
            self.view = AnswerView(server, WAITING, post)
        audit.on_click(
            lambda _: post(lambda: self._background.start("auditing", lambda: audit_answer(None), self.view.show))
        )

        on_upload(upload, self._audit, post)

    def _audit(self, name: str, content: bytes) -> None:
        folder = self._folder
        self._background.start(
            "auditing",
            lambda: audit_answer(unpacked_folder(name, content, folder, FILE, read_study)),
            self.view.show,
        )
