"""Part of a material (:class:`PartFile`): measured parameters with their origin, as `explorer lab --out` writes it.

`explorer new material NAME --like MATERIAL --part FILE` lays parts over a material; the page lays the part of a bench
test over the material of the pour. The tables can also be copied by hand into a material file as they are,
``[measured]`` included.
"""

from __future__ import annotations

import dataclasses
import hashlib
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from doe.laboratory import Derived, Estimate, LabResult
from doe.laboratory.result import CONDITIONS
from explorer.errors import CommandError
from explorer.files.uploads import kept_file
from explorer.scene.source import SceneSource, material_source
from explorer.scene.starter_files import new_path, starter_scene, write_new
from explorer.scene.text import material_toml, toml_key, toml_value
from solver import ParameterError, Scene, asset_path, load_material, parse_quantity, read_toml, with_values
from solver.toml_file import Number, Scalar, TomlTable, checked

Table = dict[str, Any]

SIZES = ("size_distribution", "size_spread")
SCATTER = "log_normal"
"""Distribution of a measured spread, which has no effect without one; as for measured diameters in a material file."""
MODULI = ("youngs_modulus", "shear_modulus")
ELASTIC = (*MODULI, "poisson_ratio")
IN_FORCE = 1e-6
"""Relative difference up to which a modulus of the scene is the one that was measured."""
STARTER = "the starter material"


class PartBody(TomlTable):
    """What is measured of a body."""

    name: str
    mass_fraction: Annotated[float, Number(least=0.0)] | None = None
    size_distribution: str | None = None
    size_spread: Annotated[float | str, Scalar()] | None = None


class PartFile(TomlTable):
    """A part: tables as in a material file, with only what was measured."""

    format: Literal[1]
    materials: dict[str, dict[str, Any]] = Field(default_factory=dict)
    pair: dict[str, dict[str, dict[str, Any]]] = Field(default_factory=dict)
    body: list[PartBody] = Field(default_factory=list)
    """Names, each with a mass_fraction, or with size_distribution and size_spread."""
    effect: dict[str, dict[str, Any]] = Field(default_factory=dict)
    measured: dict[str, Any] = Field(default_factory=dict)
    """The origin of the same numbers: value, unit, n, sd, low_95, high_95, formula, notes, source, sha256.

    Where the readings declare their errors also u_readings and u_combined, standard uncertainties of the mean.
    """


def part_table(result: LabResult) -> Table:
    """The part as plain tables: parameters, and under ``measured`` their origin and whatever is not a parameter."""
    found: Table = {"format": 1}
    for one in result.derived:
        if one.parameter:
            _put(found, one.parameter, one.summary.mean)
            _keep(found, one.parameter.split("."), _of_derived(one))
        elif one.name not in CONDITIONS:
            _keep(found, [*(["pair"] if len(one.of) == 2 else []), *one.of, one.name], _of_derived(one))
    for other in result.estimates:
        _put(found, other.parameter, other.value)
        _keep(found, other.parameter.split("."), _of_estimate(other))
    return found


def part_text(table: Table, heading: str) -> str:
    """TOML of :func:`part_table`; ``heading`` becomes comment lines at its top."""
    lines = [f"# {line}".rstrip() for line in heading.splitlines()]
    lines += ["", f"format = {table['format']}"]
    for body in table.get("body", []):
        lines += ["", "[[body]]", *_entries(body)]
    for kind in ("materials", "pair", "effect", "measured"):
        lines += _tables((kind,), table.get(kind, {}))
    return "\n".join(lines) + "\n"


def read_part(path: Path) -> Table:
    """The tables of a part. Raises ParameterError, in one line, for a bad part."""
    table = read_toml(path)
    try:
        checked(PartFile, table)
    except ParameterError as error:
        raise ParameterError(f"{path}: {error}") from None
    return table


def write_measured_material(folder: Path, name: str, like: str | None, parts: Sequence[Path]) -> Path:
    """Write ``NAME.toml``: ``like`` (name or file; None: the starter material) with ``parts``; later parts win.

    Raises CommandError if the file exists already or a part does not fit.
    """
    path = new_path(folder, name)
    scene, measured = _base(path, like)
    for part in parts:
        table = read_part(part)
        try:
            scene = with_part(scene, table, measured)
        except ParameterError as error:
            raise CommandError(f"{part}: does not fit {like or STARTER}: {error}") from None
        measured = merged(measured, table.get("measured", {}))
    names = ", ".join(part.name for part in parts) or "nothing"
    heading = f"{path.stem}: {like or STARTER}, with measured: {names}. SI; where numbers come from: [measured] below."
    return write_new(path, material_toml(scene, heading) + measured_text(measured))


def _base(path: Path, like: str | None) -> tuple[Scene, dict[str, Any]]:
    """The scene to start from, and the ``measured`` tables of its file."""
    if like is None:
        return starter_scene(path), {}
    return load_material(like), measured_of(like)


def measured_of(material: str) -> Table:
    """The tables ``[measured.…]`` of a material, by name or file."""
    found: Table = read_toml(asset_path("materials", material)).get("measured", {})
    return found


def measured_source(present: Scene, result: LabResult, folder: Path, material: str = "") -> SceneSource:
    """``present`` with the parameters of ``result``, kept in ``folder`` as a file that also states their origins.

    ``material``: the file or shipped material that ``present`` came from, whose origins are kept; empty: there is none.
    Raises CommandError if ``result`` has no parameter, and ParameterError if one does not fit the material.
    """
    part = part_table(result)
    if not set(part) - {"format", "measured"}:
        raise CommandError(f"{result.test}: the test gives no material parameter")
    before = measured_of(material) if material else {}
    scene = with_part(present, part, before)
    text = material_toml(scene, f"{present.title}, with {result.test} measured. SI; origins: [measured] below.")
    text += measured_text(merged(before, part.get("measured", {})))
    path = kept_file(f"{present.title[:20]}-{result.test}.toml", text.encode(), folder, (".toml",))
    return material_source(str(path))


def with_part(scene: Scene, table: Table, measured: Mapping[str, Any] | None = None) -> Scene:
    """``scene`` with the parameters of a part, no longer marked as assumed. ParameterError if they do not fit.

    ``measured``: tables ``[measured.…]`` of ``scene``; a modulus in them that is in force still holds beside another.
    """
    part = checked(PartFile, table)
    settings: dict[str, Any] = {}
    struck: set[str] = set()
    for name, entry in part.materials.items():
        elastic = _measured_before(scene, name, entry, measured or {}) | entry
        settings |= _of_material(scene, name, elastic)
        struck |= {f"materials.{name}.{key}" for key in (*entry, *_determined(elastic))}
    for a, partners in part.pair.items():
        for b, entry in partners.items():
            for key, value in entry.items():
                settings[f"pair.{a}.{b}.{key}"] = value
                struck |= {f"pair.{a}.{b}.{key}", f"pair.{b}.{a}.{key}"}
    settings |= {f"effect.{name}.{key}": value for name, entry in part.effect.items() for key, value in entry.items()}
    of_bodies = _of_bodies(part.body)
    fractions = [path.split(".")[1] for path in of_bodies if path.endswith(".mass_fraction")]
    names = [body.name for body in scene.bodies]
    if fractions and set(names) != set(fractions):
        raise ParameterError(
            f"body.*.mass_fraction: measured are {', '.join(fractions)}; the material has {', '.join(names)}"
        )
    settings |= of_bodies
    struck |= set(of_bodies)
    scene = with_values(scene, settings)
    return dataclasses.replace(scene, assumed=tuple(path for path in scene.assumed if path not in struck))


def _measured_before(scene: Scene, name: str, entry: Table, measured: Mapping[str, Any]) -> dict[str, float]:
    """The modulus that was measured before the one elastic constant of ``entry``, and is in force; empty: none."""
    given = [key for key in ELASTIC if key in entry]
    if len(given) != 1:
        return {}
    kept, now = measured.get("materials", {}).get(name, {}), scene.material(name)
    for key, in_force in zip(MODULI, (now.youngs_modulus, now.shear_modulus), strict=True):
        before = kept[key].get("value") if isinstance(kept.get(key), dict) else None
        if key not in given and isinstance(before, float) and math.isclose(before, in_force, rel_tol=IN_FORCE):
            return {key: before}
    return {}


def _determined(entry: Table) -> tuple[str, ...]:
    """Elastic constants that no longer rest on an assumption alone: two fix the third, and a modulus sets the other."""
    given = [key for key in ELASTIC if key in entry]
    if len(given) > 1:
        return ELASTIC
    return MODULI if set(given) & set(MODULI) else ()


def _of_material(scene: Scene, name: str, entry: Table) -> dict[str, Any]:
    """Settings of a material. Two elastic constants fix the third; with a modulus alone, ν stays as it was."""
    settings = {f"material.{name}.{key}": value for key, value in entry.items() if key != "youngs_modulus"}
    if "youngs_modulus" not in entry:
        return settings
    young = _number(entry["youngs_modulus"], f"materials.{name}.youngs_modulus")
    if all(key in entry for key in ELASTIC):
        return settings
    if "shear_modulus" in entry:
        shear = _number(entry["shear_modulus"], f"materials.{name}.shear_modulus")
        return settings | {f"material.{name}.poisson_ratio": young / (2.0 * shear) - 1.0}
    ratio = parse_quantity(
        entry.get("poisson_ratio", scene.material(name).poisson_ratio), "1", f"materials.{name}.poisson_ratio"
    )
    return settings | {f"material.{name}.shear_modulus": young / (2.0 * (1.0 + ratio))}


def _number(value: Any, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not value > 0.0 or not math.isfinite(value):
        raise ParameterError(f"{where}: {value!r}; allowed: a number above 0 in Pa")
    return float(value)


def _of_bodies(bodies: Sequence[PartBody]) -> dict[str, Any]:
    """Parameter path → value of everything that is said of bodies."""
    found: dict[str, Any] = {}
    for body in bodies:
        said = body.model_dump(exclude={"name"}, exclude_unset=True)
        if not said:
            raise ParameterError(
                f"body: {body.name}; allowed: a name with a mass_fraction, or with {' and '.join(SIZES)}"
            )
        if body.mass_fraction is not None and body.mass_fraction > 1.0:
            raise ParameterError(f"body: {body.name}: mass_fraction {body.mass_fraction:g}; allowed: 0 … 1")
        found |= {f"body.{body.name}.{key}": value for key, value in said.items()}
    return found


def merged(one: Mapping[str, Any], other: Mapping[str, Any]) -> Table:
    """The entries of both tables; if both have a value, that of ``other``."""
    both = dict(one)
    for key, value in other.items():
        old = both.get(key)
        both[key] = merged(old, value) if isinstance(old, dict) and isinstance(value, dict) else value
    return both


def measured_text(measured: Mapping[str, Any]) -> str:
    """The tables ``[measured.…]`` alone."""
    return "\n".join(_tables(("measured",), measured)) + "\n" if measured else ""


def _put(table: Table, parameter: str, value: float) -> None:
    kind, *names, key = parameter.split(".")
    if kind == "body":
        scatter = {"size_distribution": SCATTER} if key == "size_spread" else {}
        table.setdefault("body", []).append({"name": names[0], **scatter, key: value})
    else:
        _keep(table, [kind, *names], {key: value}, root="")


def _keep(table: Table, keys: Sequence[str], entries: Mapping[str, Any], root: str = "measured") -> None:
    here = table
    for key in (*([root] if root else []), *keys):
        here = here.setdefault(key, {})
    here.update(entries)


def _of_derived(one: Derived) -> Table:
    s = one.summary
    numbers = {"value": s.mean, "unit": one.unit, "n": s.n, "sd": s.sd, "low_95": s.low, "high_95": s.high}
    errors = {"u_readings": one.reading.standard, "u_combined": one.reading.combined} if one.reading else {}
    return _finite(numbers | errors) | _said(one) | _origin((one.file,))


def _of_estimate(one: Estimate) -> Table:
    numbers = {"value": one.value, "unit": one.unit, "low_95": one.low, "high_95": one.high}
    return _finite(numbers) | _said(one) | _origin(one.files)


def _said(one: Derived | Estimate) -> Table:
    """The formula, and notes on what speaks against its value."""
    return {"formula": one.formula} | ({"notes": list(one.notes)} if one.notes else {})


def _origin(files: Sequence[str]) -> Table:
    """The files by name and by the hash of their content."""
    paths = [Path(file) for file in files]
    return {"source": ", ".join(path.name for path in paths), "sha256": ", ".join(map(_digest, paths))}


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _finite(numbers: Mapping[str, Any]) -> Table:
    """The entries without those that a single replicate does not have."""
    return {key: value for key, value in numbers.items() if isinstance(value, str) or math.isfinite(value)}


def _tables(keys: tuple[str, ...], table: Mapping[str, Any]) -> list[str]:
    """A table and those below it, each under its own heading."""
    own = {key: value for key, value in table.items() if not isinstance(value, dict)}
    lines = ["", f"[{'.'.join(map(toml_key, keys))}]", *_entries(own)] if own else []
    for key, value in table.items():
        if isinstance(value, dict):
            lines += _tables((*keys, key), value)
    return lines


def _entries(entries: Mapping[str, Any]) -> list[str]:
    return [f"{toml_key(key)} = {toml_value(value)}" for key, value in entries.items()]
