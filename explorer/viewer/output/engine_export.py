"""The pour for another program."""

from __future__ import annotations

from itertools import groupby
from pathlib import Path
from typing import Any

import viser

from explorer.errors import CommandError
from explorer.export import OWN, names
from explorer.export.packed import packed_export
from explorer.files.kept_scene import kept_scene
from explorer.session import Session
from explorer.viewer.actions import Post
from explorer.viewer.background_work import BackgroundWork
from explorer.viewer.output.send_file import send_file
from solver.plugins import origin


class EngineExport:
    """List of programs and a button; ``folder`` keeps the scene."""

    def __init__(
        self, server: viser.ViserServer, session: Session, folder: Path, post: Post, background: BackgroundWork
    ) -> None:
        self._session, self._folder, self._background = session, folder, background
        self._program = server.gui.add_dropdown(
            "For another program",
            names(),
            hint=f"{programs_text()} The conventions of all coefficients are in it.",
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
        if program not in names():
            raise CommandError(f"program {program[:40]!r}: allowed are {', '.join(names())}")
        self._background.start(
            f"exporting for {program}",
            lambda: packed_export(kept_scene(status.scene, folder), program, status.seed),
            lambda made: send_file(client, f"pour_{program}.zip", made),
        )


def programs_text() -> str:
    """What each program gets; of plug-ins, which are not loaded for it, where they come from."""
    own = groupby(OWN, key=lambda target: target.what)
    lines = [f"{', '.join(target.name for target in alike)}: {what}." for what, alike in own]
    return " ".join([*lines, *(f"{name}: of {origin('export', name)}." for name in names()[len(OWN) :])])
