"""A place for one file: a shipped example by name, or what a browser sent in its stead."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import viser

from explorer.files.uploads import kept_file
from explorer.viewer.actions import Post
from explorer.viewer.buttons import on_upload


class UploadSlot:
    """A list of examples, to which every upload is added and chosen. ``folder`` keeps what was sent."""

    def __init__(
        self,
        server: viser.ViserServer,
        label: str,
        examples: Sequence[str],
        suffixes: Sequence[str],
        folder: Path,
        post: Post,
        hint: str,
    ) -> None:
        self._suffixes, self._folder = tuple(suffixes), folder
        self._sent: dict[str, Path] = {}
        self._examples = tuple(examples)
        self._choice = server.gui.add_dropdown(label, self._examples, hint=hint)
        self.upload = server.gui.add_upload_button(
            f"Upload: {label.lower()}", mime_type=",".join(suffixes), hint=f"A file ending in {', '.join(suffixes)}."
        )

        on_upload(self.upload, self._take, post)

    @property
    def chosen(self) -> str:
        """The name of an example, or the path of a file that was sent."""
        value = str(self._choice.value)
        return str(self._sent.get(value, value))

    def offer(self, examples: Sequence[str]) -> None:
        """Other examples than before; the first is chosen unless a file that was sent is."""
        self._examples = tuple(examples)
        self._list(str(self._choice.value) if self._choice.value in self._sent else self._examples[0])

    def _take(self, name: str, content: bytes) -> None:
        path = kept_file(name, content, self._folder, self._suffixes)
        self._sent[path.name] = path
        self._list(path.name)

    def _list(self, chosen: str) -> None:
        self._choice.options = (*self._examples, *self._sent)
        self._choice.value = chosen  # type: ignore[misc]
