"""The pour for another program: LIGGGHTS, YADE, ParaView, EDEM."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import viser

from explorer.errors import CommandError
from explorer.export import PROGRAMS
from explorer.export.packed import packed_export
from explorer.files.kept_scene import kept_scene
from explorer.session import Session
from explorer.viewer.actions import Post
from explorer.viewer.background_work import BackgroundWork
from explorer.viewer.output.send_file import send_file


class EngineExport:
    """List of programs and a button; ``folder`` keeps the scene."""

    def __init__(
        self, server: viser.ViserServer, session: Session, folder: Path, post: Post, background: BackgroundWork
    ) -> None:
        self._session, self._folder, self._background = session, folder, background
        self._program = server.gui.add_dropdown(
            "For another program",
            PROGRAMS,
            hint="liggghts, yade: a deck that runs as it is. paraview: shapes and contacts as VTK. edem: tables of the "
            "material. The conventions of all coefficients are in it.",
        )
        self._button = server.gui.add_button(
            "Export (ZIP)", hint="Pours what is on the screen anew, in the background: up to some minutes."
        )

        @self._button.on_click
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:
                client = event.client
                post(lambda: self._export(client))

    def _export(self, client: Any) -> None:
        program, status, folder = str(self._program.value), self._session.status(), self._folder
        if program not in PROGRAMS:
            raise CommandError(f"program {program[:40]!r}: allowed are {', '.join(PROGRAMS)}")
        self._background.start(
            f"exporting for {program}",
            lambda: packed_export(kept_scene(status.scene, folder), program, status.seed),
            lambda made: send_file(client, f"pour_{program}.zip", made),
        )
