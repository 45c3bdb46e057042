"""Tables of a file that lie over a material: ``[rig]``, ``[insertion]``, ``[numerics]``, ``[contact]``, ``[effect.…]``.

Keys are the last parts of parameter paths (``outlet_height`` in ``[rig]`` is ``rig.outlet_height``); ``name`` in
``[rig]`` chooses the rig.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from solver.params import ParameterError
from solver.scenes.scene import Scene, with_rig, with_values

TABLES = ("rig", "insertion", "numerics", "contact", "effect")

MESH = "rig.mesh"

"""Path of the parameter that names a file."""


def with_set_up(scene: Scene, table: Mapping[str, Any], folder: Path | None = None) -> Scene:
    """``scene`` with the set-up tables in ``table``, a parsed file whose other keys are of no concern here.

    A relative path in it, such as the mesh of a rig, starts in ``folder``; None: the working directory.
    """
    values: dict[str, Any] = {}
    for kind in TABLES:
        entries = table.get(kind, {})
        if not isinstance(entries, dict):
            raise ParameterError(f"{kind}: a table is needed, not {entries!r}")
        values |= dict(_by_path(kind, entries))
    if folder is not None and (own := folder / Path(str(values.get(MESH, ""))).expanduser()).is_file():
        values[MESH] = str(own)
    return with_settings(scene, values)


def _by_path(prefix: str, entries: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    for key, value in entries.items():
        if isinstance(value, dict):
            yield from _by_path(f"{prefix}.{key}", value)
        else:
            yield f"{prefix}.{key}", value


def with_settings(scene: Scene, values: Mapping[str, Any]) -> Scene:
    """``scene`` with parameters replaced by path (:func:`solver.scenes.scene.with_values`), ``rig.name`` before them."""
    settings = dict(values)
    name = settings.pop("rig.name", scene.rig.name)
    if name != scene.rig.name:
        scene = with_rig(scene, name if isinstance(name, str) else repr(name))
    return with_values(scene, settings)
