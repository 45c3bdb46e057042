"""A material from another program's input file: uploaded, read, kept as a file, poured."""

from __future__ import annotations

from html import escape
from pathlib import Path

from explorer.errors import CommandError
from explorer.files.uploads import label, read_once, unpacked_folder
from explorer.imported import write_imported
from explorer.imported.edem import OWN_TABLES, read_edem
from explorer.scene.source import SceneSource, material_source
from explorer.viewer.actions import on_upload
from explorer.viewer.panel import SET_UP, PageContext, Panel
from explorer.viewer.view import small_html
from solver.scenes.scene import check

PROGRAMS = {
    "LIGGGHTS input script": "liggghts",
    "YADE script": "yade",
    "EDEM table (CSV), or a folder of our export as .zip": "edem",
}
"""Choice → name for `write_imported`."""
WAITING = "A script is read, never run. What was converted, what was not taken and what is not said there stands here."


class ImportPanel(Panel):
    """Program, name, upload; the result, and a button that pours it."""

    name, tab, title = "import", SET_UP, "From LIGGGHTS, YADE, EDEM"

    def __init__(self, page: PageContext) -> None:
        gui, post = page.server.gui, page.post
        self._session, self._uploads, self._background = page.session, page.uploads, page.background
        self._folder = page.project.folder or page.data / "materials"
        self._kept: Path | None = None
        self._program = gui.add_dropdown("File of", tuple(PROGRAMS), hint="Whose words and conventions it is read by.")
        self._name = gui.add_text(
            "Name of the material", "", hint=f"NAME.toml in {self._folder}; empty: as the file is called."
        )
        upload = gui.add_upload_button("Upload it and read", hint="Up to 30 MB; of EDEM also .zip.")
        self._told = gui.add_html(small_html(escape(WAITING)))
        self._pour_it = gui.add_button(
            "Pour this material", visible=False, hint="A new pour; changes are then counted from this material."
        )
        on_upload(upload, self._take, post)
        self._pour_it.on_click(lambda _: post(self._pour))

    def _take(self, sent: str, content: bytes) -> None:
        chosen = str(self._program.value)
        if chosen not in PROGRAMS:
            raise CommandError(f"file of {chosen[:60]!r}; allowed: {', '.join(PROGRAMS)}")
        program, folder, uploads = PROGRAMS[chosen], self._folder, self._uploads
        name = str(self._name.value).strip() or label(Path(sent).stem)

        def find() -> tuple[Path, list[str]]:
            if program == "edem" and sent.lower().endswith(".zip"):
                return write_imported(
                    folder, name, program, unpacked_folder(sent, content, uploads, OWN_TABLES[1], read_edem)
                )
            with read_once(sent, content) as file:
                return write_imported(folder, name, program, file)

        self._background.start(f"reading {label(sent)}", find, lambda found: self._show(sent, *found))

    def _show(self, sent: str, path: Path, notes: list[str]) -> None:
        """Show what was converted, left out and assumed, and the file that was written."""
        self._kept, self._pour_it.visible = path, True
        lines = "".join(f"<li>{escape(note)}</li>" for note in notes)
        self._told.content = small_html(
            f"<b>{escape(sent[:80])}</b> is kept as {escape(str(path))}. On the way:"
            f"<ul style='margin:0.3em 0; padding-left:1.2em; overflow-wrap:anywhere'>{lines}</ul>"
            f"<code>explorer serve --material {escape(str(path))}</code> opens it with a study of its own."
        )

    def _pour(self) -> None:
        path = self._kept
        if path is None:
            raise CommandError("upload a file first")

        def find() -> SceneSource:
            source = material_source(str(path))
            check(source.scene)
            return source

        self._background.start("reading the material", find, self._start)

    def _start(self, source: SceneSource) -> None:
        self._session.start(source.scene, self._session.status().seed, source)
