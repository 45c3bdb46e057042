"""A material of one's own from another one and the parts that a laboratory measured."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from explorer.errors import CommandError
from explorer.laboratory.part import measured_text, merged, read_part, with_part
from explorer.scene.starter_files import material_text, new_path
from explorer.scene.text import material_toml
from solver import ParameterError, Scene, asset_path, load_material, read_toml
from solver.scenes.material_file import scene_from

STARTER = "the starter material"


def write_measured_material(folder: Path, name: str, like: str | None, parts: Sequence[Path]) -> Path:
    """Write ``NAME.toml``: ``like`` (name or file; None: the starter material) with ``parts``, of two the later.

    Raises CommandError where it exists already or a part does not fit.
    """
    path = new_path(folder, name)
    scene, measured = _base(path, like)
    for part in parts:
        table = read_part(part)
        try:
            scene = with_part(scene, table)
        except ParameterError as error:
            raise CommandError(f"{part}: does not fit {like or STARTER}: {error}") from None
        measured = merged(measured, table.get("measured", {}))
    names = ", ".join(part.name for part in parts) or "nothing"
    heading = f"{path.stem}: {like or STARTER}, with measured: {names}. SI; where numbers come from: [measured] below."
    text = material_toml(scene, heading) + measured_text(measured)
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("x", encoding="utf-8") as file:
        file.write(text)
    return path


def _base(path: Path, like: str | None) -> tuple[Scene, dict[str, Any]]:
    """The scene to start from, and what its file says was measured."""
    if like is None:
        return scene_from(tomllib.loads(material_text(path)), path), {}
    return load_material(like), read_toml(asset_path("materials", like)).get("measured", {})
