"""A scene of the page as a file that commands in other processes take."""

from __future__ import annotations

from pathlib import Path

from explorer.files.uploads import kept_file
from explorer.scene.text import material_toml
from solver import Scene

TITLE_LETTERS = 20


def kept_scene(scene: Scene, folder: Path) -> Path:
    """``scene`` as a material file in ``folder``, under a name of its contents."""
    text = material_toml(scene, f"{scene.title}, as it was poured on the page. SI.")
    return kept_file(f"{scene.title[:TITLE_LETTERS]}.toml", text.encode(), folder, (".toml",))
