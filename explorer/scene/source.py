"""Where a scene came from, what it has become since, and the command line that repeats it."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from explorer.errors import CommandError
from explorer.scene.file import load_scene, material_scene, study_scene
from explorer.units import entry_unit, quantity
from solver.assets import own_path
from solver.params import ParameterError, parse_quantity
from solver.scenes.material_file import with_settings
from solver.scenes.scene import Scene, parameters, values, with_rig
from solver.toml_file import read_toml

PROGRAM = ("explorer", "simulate")
PLURALS = {"body": "bodies"}
"""Plurals of the first word of a parameter's path, if they need more than an s."""


@dataclass(frozen=True)
class SceneSource:
    """The arguments with which ``explorer simulate`` loads a scene."""

    arguments: tuple[str, ...]
    """Arguments before any setting; empty if the scene came from no file."""
    scene: Scene
    """The scene as loaded: the default that changes refer to."""
    material: str = ""
    """Its material, by shipped name or path; empty if none was named."""


def rig_source(rig: str, material: str) -> SceneSource:
    """The source "``material`` in ``rig``"; raises as :func:`explorer.scene.file.load_scene`."""
    named = _named(material)
    return SceneSource((rig, "--material", named), load_scene(rig, named), named)


def material_source(material: str) -> SceneSource:
    """The source of a material in the rig of its own file; raises as :func:`explorer.scene.file.material_scene`."""
    named = _named(material)
    return SceneSource((named,), material_scene(named), named)


def prepared_source(name: str) -> SceneSource:
    """The source of a shipped prepared scene; raises as :func:`explorer.scene.file.load_scene`."""
    return SceneSource((name,), load_scene(name))


def study_source(file: Path) -> SceneSource:
    """The source of a study: its shipped name if that means the same, otherwise its path."""
    scene = study_scene(file)
    material = str(read_toml(file).get("material", ""))
    # As the study file resolves it: a file beside it takes precedence over a shipped one.
    material = _named(str(file.parent / material)) if (file.parent / material).is_file() else material
    for name in (file.stem, str(file.absolute())):
        try:
            if load_scene(name) == scene:
                return SceneSource((name,), scene, material)
        except ValueError:  # nothing has the short name, or a file that is not a scene
            continue
    return SceneSource((), scene, material)


def _named(material: str) -> str:
    """A file by its full path, a shipped material by its name."""
    own = own_path(material)
    return str(own.absolute()) if own.is_file() else material.removesuffix(".toml")


def command_line(source: SceneSource, scene: Scene, seed: int) -> str:
    """``explorer simulate …`` that pours ``scene`` with ``seed``, quoted for a shell.

    Raises CommandError if no settings lead from the source to ``scene``, for example if bodies or materials differ.
    """
    words = [*PROGRAM, *source.arguments]
    for setting in settings(source, scene):
        words += ["--set", setting]
    return shlex.join([*words, "--seed", str(seed)])


def settings(source: SceneSource, scene: Scene) -> tuple[str, ...]:
    """Texts ``path=value`` that turn the source's scene into exactly ``scene``; CommandError if there are none."""
    if not source.arguments:
        raise CommandError(
            "this scene does not come from a file that a command line can name; save the scene file instead"
        )
    base = source.scene
    first: list[str] = []
    if scene.rig.name != base.rig.name:
        first, base = [f"rig.name={scene.rig.name}"], with_rig(base, scene.rig.name)
    found = list(differences(base, scene))
    for chosen in _selections(found):
        texts = [*first, *(setting_text(one) for one in chosen)]
        if _applied(source.scene, texts) == scene:
            return tuple(texts)
    raise CommandError("this scene differs from its source in bodies, materials or titles; save the scene file instead")


def setting_text(change: Difference) -> str:
    """``path=value``, in the unit on the screen if that reproduces every bit, otherwise in SI with all digits."""
    if isinstance(change.now, str):
        return f"{change.path}={change.now}"
    number, unit = float(change.now), entry_unit(change.unit)
    short = f"{unit.of(number):.6g}{unit.symbol}"
    exact = parse_quantity(short, change.unit, change.path) == number
    return f"{change.path}={short if exact else repr(number)}"


def _selections(found: Sequence[Difference]) -> list[list[Difference]]:
    """All differences; or, as setting one mass share scales the others, all except shares plus a single share each."""
    shares = [one for one in found if one.path.endswith(".mass_fraction")]
    rest = [one for one in found if one not in shares]
    return [list(found), *([*rest, share] for share in shares)]


def _applied(base: Scene, texts: Sequence[str]) -> Scene | None:
    """``base`` with settings; None if they are not allowed."""
    try:
        return with_settings(base, dict(text.split("=", 1) for text in texts))
    except ParameterError:
        return None


@dataclass(frozen=True)
class Difference:
    """A parameter that has two values, SI or the names of choices."""

    path: str
    before: float | str
    now: float | str
    unit: str
    live: bool
    """Whether a running pour takes a new value at once."""

    def __str__(self) -> str:
        return f"{self.path}: {self.change}"

    @property
    def change(self) -> str:
        """``before → now`` in the units on the screen; with all digits if the rounded values look alike."""
        before, now = shown(self.before, self.unit), shown(self.now, self.unit)
        if before == now:
            before, now = str(self.before), f"{self.now} {'' if self.unit == '1' else self.unit}".strip()
        return f"{before} → {now}"


def differences(before: Scene, now: Scene) -> Iterator[Difference]:
    """Parameters that both scenes have and that differ, in the order of ``now``."""
    old = values(before)
    declared = parameters(now)
    for path, new in values(now).items():
        if path in old and old[path] != new:
            yield Difference(path, old[path], new, declared[path].unit, declared[path].live)


def same_bodies(one: Scene, other: Scene) -> bool:
    """Whether both scenes pour bodies of the same names, so that their parameters can be compared."""
    return [body.name for body in one.bodies] == [body.name for body in other.bodies]


def change_lines(found: Iterable[Difference]) -> list[str]:
    """A line per quantity, such as "friction seed–seed 0.57 → 0.4" and "restitution of 9 pairs 0.4 → 0.2"."""
    by_name: dict[str, list[Difference]] = {}
    for one in found:
        by_name.setdefault(one.path.rpartition(".")[2], []).append(one)
    lines = []
    for name, mine in by_name.items():
        words = name.replace("_", " ")
        if len(mine) == 1:
            lines.append(f"{' '.join([words, '–'.join(mine[0].path.split('.')[1:-1])]).strip()} {mine[0].change}")
        else:
            before, now = span(mine, [one.before for one in mine]), span(mine, [one.now for one in mine])
            kind = mine[0].path.partition(".")[0]
            lines.append(f"{words} of {len(mine)} {PLURALS.get(kind, f'{kind}s')} {before} → {now}")
    return lines


def span(found: Sequence[Difference], values: Sequence[float | str]) -> str:
    """``values`` of one parameter of many objects: the value, or the smallest and the largest, with their unit."""
    numbers: list[float | str] = [*sorted(one for one in values if not isinstance(one, str))] or list(values)
    return " … ".join(dict.fromkeys(shown(one, found[0].unit) for one in (numbers[0], numbers[-1])))


def shown(number: float | str, unit: str) -> str:
    """A value with its unit on the screen, or the name of a choice."""
    return number if isinstance(number, str) else quantity(number, unit)
