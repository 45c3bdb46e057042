"""The pour for another program: what `explorer export` writes, in one file for download."""

from __future__ import annotations

import tempfile
from itertools import groupby
from pathlib import Path
from typing import Any

import viser

from explorer.background.command_output import command_output, kept_scene
from explorer.errors import CommandError
from explorer.export import EXPORTS, OWN, names
from explorer.files.exports import zipped
from explorer.viewer.output.send_file import send_file
from explorer.viewer.panel import EXPORT, PageContext, Panel
from solver.plugins import origin


class EngineExport(Panel):
    """List of programs and a button."""

    name, tab = "engine", EXPORT

    def __init__(self, page: PageContext) -> None:
        self._session, self._folder, self._background = page.session, page.uploads, page.background
        self._program = page.server.gui.add_dropdown(
            "For another program",
            names(),
            hint=f"{programs_text()} The conventions of all coefficients are in it.",
        )
        self._button = page.server.gui.add_button(
            "Export (ZIP)", hint="Pours what is on the screen anew, in the background: up to some minutes."
        )

        @self._button.on_click
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:
                client = event.client
                page.post(lambda: self._export(client))

    def _export(self, client: Any) -> None:
        program, status, folder = str(self._program.value), self._session.status(), self._folder
        if program not in names():
            raise CommandError(f"program {program[:40]!r}; allowed: {', '.join(names())}")
        self._background.start(
            f"exporting for {program}",
            lambda: packed_export(kept_scene(status.scene, folder), program, status.seed),
            lambda made: send_file(client, f"pour_{program}.zip", made),
        )


def programs_text() -> str:
    """What each program gets; for plug-ins, which are not loaded for this, where they come from."""
    own = groupby(OWN, key=lambda target: target.what)
    lines = [f"{', '.join(target.name for target in alike)}: {what}." for what, alike in own]
    return " ".join([*lines, *(f"{name}: of {origin('export', name)}." for name in names()[len(OWN) :])])


def packed_export(scene: Path, program: str, seed: int) -> bytes:
    """A .zip of the folder that ``explorer export scene DIR --to program`` makes, in a process of its own.

    ``seed`` is that of the pour, for programs that take one. Raises CommandError if that command refuses.
    """
    with tempfile.TemporaryDirectory() as apart:
        folder = Path(apart) / f"{scene.stem}_{program}"
        of_pour = ["--seed", str(seed)]
        if program in EXPORTS and EXPORTS[program].of_material:
            of_pour = []
        command_output(["export", str(scene), str(folder), "--to", program, *of_pour])
        written = sorted(one for one in folder.rglob("*") if one.is_file())
        return zipped({str(path.relative_to(apart)): path for path in written})
