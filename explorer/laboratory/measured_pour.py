"""A pour's material with what a bench test gave, as a material file of its own."""

from __future__ import annotations

from pathlib import Path

from doe.laboratory import LabResult
from explorer.errors import CommandError
from explorer.files.uploads import kept_file
from explorer.laboratory.part import measured_text, part_table, with_part
from explorer.scene.source import SceneSource, material_source
from explorer.scene.text import material_toml
from solver import Scene


def measured_source(present: Scene, result: LabResult, folder: Path) -> SceneSource:
    """``present`` with the parameters of ``result``, kept in ``folder``; where each comes from stands in the file.

    Raises CommandError where nothing in it is a parameter, and ParameterError where one does not fit the material.
    """
    part = part_table(result)
    if not set(part) - {"format", "measured"}:
        raise CommandError(f"{result.test}: gives no parameter of a material")
    scene = with_part(present, part)
    text = material_toml(scene, f"{present.title}, with {result.test} measured. SI; origins: [measured] below.")
    text += measured_text(part.get("measured", {}))
    path = kept_file(f"{present.title[:20]}-{result.test}.toml", text.encode(), folder, (".toml",))
    return material_source(str(path))
