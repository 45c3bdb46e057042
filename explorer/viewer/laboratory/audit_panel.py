"""A published calibration recomputed from its own tables."""

from __future__ import annotations

from explorer.audit.entries import FILE
from explorer.audit.read_study import read_study
from explorer.files.uploads import unpacked_folder
from explorer.laboratory.command_results import audit_result
from explorer.viewer.actions import on_upload
from explorer.viewer.laboratory.answer_view import AnswerView
from explorer.viewer.panel import LABORATORY, PageContext, Panel

WAITING = (
    "Every figure of a published study that can be recomputed: reproduced exactly, only if its inputs were rounded, "
    "differs, or cannot be checked."
)


class AuditPanel(Panel):
    """The shipped article, or tables that a browser sent."""

    name, tab, title = "audit", LABORATORY, "Audit of a published study"

    def __init__(self, page: PageContext) -> None:
        server, gui, folder, post = page.server, page.server.gui, page.uploads, page.post
        self._background, self._folder = page.bench_work, folder
        audit = gui.add_button("Audit the shipped article", hint="Processes 2022, 10, 185, from its ten tables.")
        upload = gui.add_upload_button(
            "Upload tables and audit", mime_type=".zip", hint=f"A folder with {FILE} and its tables, as .zip."
        )
        self.view = AnswerView(server, WAITING, post, reports=page.project.laboratory)
        audit.on_click(
            lambda _: post(lambda: self._background.start("auditing", lambda: audit_result(None), self.view.show))
        )

        on_upload(upload, self._audit, post)

    def _audit(self, name: str, content: bytes) -> None:
        folder = self._folder
        self._background.start(
            "auditing",
            lambda: audit_result(unpacked_folder(name, content, folder, FILE, read_study)),
            self.view.show,
        )
