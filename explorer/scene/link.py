"""A pour as text in an address: the scene by its shipped name, the changed parameters, the seed and a moment.

    pour=sunflower_extract&set=pair.seed.seed.static_friction%3D0.4&seed=1&time=1.25
    pour=funnel&material=glass_beads&seed=3&time=0.5

The text names no file: a scene is shipped, or is the one that the program was started with, which a checksum then
identifies. A parameter whose value is a file is refused, in writing and in reading.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from urllib.parse import parse_qsl, urlencode

from explorer.errors import CommandError
from explorer.scene.file import SHIPPED, SOURCES
from explorer.scene.source import SceneSource, prepared_source, rig_source, settings
from explorer.scene.text import material_toml
from explorer.units import checked
from solver.assets import shipped_assets
from solver.scenes.material_file import with_settings
from solver.scenes.scene import Scene, canonical, check, parameters

LONGEST = 2000
"""Most characters of an address that every browser, mail and chat program leaves intact."""
LARGEST_SEED = 2**31 - 1
LONGEST_POUR = 1000.0
"""Latest moment that a link may ask for [s]."""
INSTEAD = "take the command line or Scene (TOML) under Export"


@dataclass(frozen=True)
class LinkedPour:
    """What a link asks for."""

    source: SceneSource
    scene: Scene
    seed: int
    moment: float
    """Simulated time [s] up to which to pour."""


def pour_text(source: SceneSource, scene: Scene, seed: int, begun: SceneSource) -> str:
    """The text of a pour, without a moment. ``begun``: the source that the program was started with.

    Raises CommandError if no such text leads to ``scene``.
    """
    fields, changed = _named(source, begun), settings(source, scene)
    _refuse_files(source.scene, changed)
    return urlencode([*fields, *(("set", text) for text in changed), ("seed", str(seed))])


def read_pour(text: str, begun: SceneSource) -> LinkedPour:
    """The pour that ``text``, which may be anything, asks for. ValueError in one line if it is not allowed."""
    if len(text) > LONGEST:
        raise CommandError(f"link: {len(text)} characters; allowed: up to {LONGEST}")
    fields = parse_qsl(text)
    given, changed = dict(fields), [value for key, value in fields if key == "set"]
    source = _source(given.get("pour", ""), given.get("material"), begun)
    _refuse_files(source.scene, changed)
    scene = with_settings(source.scene, _table(changed))
    check(scene)
    seed, moment = (_number(given, key, high) for key, high in (("seed", LARGEST_SEED), ("time", LONGEST_POUR)))
    return LinkedPour(source, scene, int(seed), moment)


def _named(source: SceneSource, begun: SceneSource) -> list[tuple[str, str]]:
    """The fields that name ``source``."""
    match source.arguments:
        case (name,) if name in _shipped():
            return [("pour", name)]
        case (rig, "--material", material) if material in shipped_assets("materials"):
            return [("pour", rig), ("material", material)]
    if source == begun:
        return [("pour", _checksum(begun))]
    raise CommandError(f"link: this scene comes from a file on this machine, which a link cannot hold; {INSTEAD}")


def _source(name: str, material: str | None, begun: SceneSource) -> SceneSource:
    """The source that the fields name; never a file."""
    if material is not None:
        if name in SOURCES and material in shipped_assets("materials"):
            return rig_source(name, material)
    elif name in _shipped():
        return begun if begun.arguments == (name,) else prepared_source(name)
    elif name == _checksum(begun):
        return begun
    named = " ".join([name, material or ""]).strip()[:60]
    raise CommandError(f"link: {named!r} is neither a shipped scene nor the one that this page started with")


def _shipped() -> frozenset[str]:
    return frozenset((*SOURCES, *(name for kind in SHIPPED for name in shipped_assets(kind))))


def _checksum(source: SceneSource) -> str:
    return "own-" + sha256(material_toml(source.scene).encode()).hexdigest()[:12]


def _table(texts: Sequence[str]) -> dict[str, str]:
    """Settings ``path=value`` by path."""
    return {path: value for path, _, value in (text.partition("=") for text in texts)}


def _refuse_files(scene: Scene, texts: Sequence[str]) -> None:
    """Raise CommandError if a setting names a file; called before any of them is read."""
    table = _table(texts)
    if (rig := table.pop("rig.name", None)) is not None:
        scene = with_settings(scene, {"rig.name": rig})
    known = parameters(scene)
    for path in table:
        if known[canonical(scene, path)].files:
            raise CommandError(f"link: {path} is a file, which a link cannot hold; {INSTEAD}")


def _number(given: Mapping[str, str], key: str, high: float) -> float:
    """A number from 0 to ``high``; 0 if there is none."""
    try:
        number: object = float(given.get(key, "0"))
    except ValueError:
        number = given[key]
    return checked(number, 0.0, high, f"link, {key}")
