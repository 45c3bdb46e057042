"""A list of the results in a folder, the present one first, and a text field for a folder elsewhere."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import viser

from explorer.background.output_folder import checked_folder
from explorer.viewer.actions import Post

MOST = 40
"""Most results in the list."""


class ResultChooser:
    """``first``: the choice at the top, which is not a folder. ``name``: the file that a result's folder holds."""

    def __init__(
        self, server: viser.ViserServer, label: str, first: str, name: str, post: Post, chosen: Callable[[], None]
    ) -> None:
        gui = server.gui
        self._first, self._name = first, name
        self._added: list[Path] = []
        self._folders: dict[str, Path] = {}
        self._list: Any = gui.add_dropdown(label, (first,), hint="Finished ones, newest first.")
        self._text = gui.add_text(
            "From a folder", "", hint=f"Folder with {name}, on the machine that serves this page."
        )
        button = gui.add_button("Add to the list")
        self._list.on_update(lambda event: post(chosen) if event.client_id is not None else None)

        def add() -> None:
            self._add()
            chosen()

        button.on_click(lambda _: post(add))

    @property
    def folder(self) -> Path | None:
        """The chosen folder; None for the first choice."""
        return self._folders.get(str(self._list.value))

    def offer(self, folders: Sequence[Path]) -> None:
        """Update the list with the results that are finished now."""
        shown = list(dict.fromkeys(folder.absolute() for folder in (*reversed(self._added), *folders)))[:MOST]
        self._folders = dict(zip(titles(shown), shown, strict=True))
        options = (self._first, *self._folders)
        if tuple(self._list.options) != options:
            self._list.options = options

    def _add(self) -> None:
        folder = checked_folder(str(self._text.value), self._name)
        if folder not in self._added:
            self._added.append(folder)
        self.offer([one for one in self._folders.values() if one not in self._added])
        self._list.value = next(name for name, one in self._folders.items() if one == folder)


def titles(folders: Sequence[Path]) -> list[str]:
    """A unique title for each of ``folders``: with the parent folder, or as a path, if the short one is not unique."""
    ways = (title, lambda folder: f"{folder.parent.name}/{folder.name}", str)
    used = [(way, Counter(map(way, folders))) for way in ways]
    return [next(way(folder) for way, count in used if count[way(folder)] == 1) for folder in folders]


def title(folder: Path) -> str:
    """Title of a result: the name of its folder, with the parent folder's in front if the name alone says little."""
    return folder.name if any(c.isdigit() for c in folder.name) else f"{folder.parent.name}/{folder.name}"
