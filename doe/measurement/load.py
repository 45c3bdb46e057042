"""``measurement.toml`` and the files beside it → :class:`Measurement`; each mistake is reported in one clear line."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from doe.errors import MeasurementError, StudyFileError
from doe.measurement.bodies import MeasuredBody, read_bodies
from doe.measurement.condition_table import ConditionTable, condition_scene, in_rig
from doe.measurement.measurement import Condition, CrossCheck, MeasuredParameter, Measurement
from doe.measurement.observations import read_observations
from doe.measurement.parameter_table import ParameterTable, narrowed, read_parameters
from doe.measurement.photographs import photograph_values
from doe.measurement.piles import pile_files, pile_surfaces
from doe.measurement.scans import UpperSurface, read_scans, scan_files
from solver import (
    AssetNotFoundError,
    Like,
    ParameterError,
    Scalar,
    Scene,
    Settings,
    TomlTable,
    all_names,
    checked,
    files_named_in,
    load_material,
    named,
    naming_file,
    own_path,
    parse_quantity,
    read_toml,
)  # fmt: skip

FILE = "measurement.toml"
WRONG = (ParameterError, StudyFileError, MeasurementError, AssetNotFoundError)
"""Exceptions that the contents of a file can raise."""


class MeasurementFile(TomlTable):
    """measurement.toml of a measured data set; piles/ and scans/ lie beside it."""

    format: Literal[1]
    title: str = ""
    source: Any = None
    """Free text, never interpreted."""
    material: str
    """The declared base model: a material file or a shipped material."""
    parameters: dict[str, ParameterTable] = Field(default_factory=dict)
    """Parameters that calibration may change."""
    uncertainty: dict[str, Annotated[float | str, Scalar()]] = Field(default_factory=dict)
    """Observable → standard deviation of one reading, where replicates cannot give it."""
    bodies: str | None = None
    """File beside this one, what was measured of single bodies (``doe/measurement/bodies.py``)."""
    condition: list[Annotated[Settings, Like(ConditionTable)]] = Field(default_factory=list)


def load_measurement(folder: Path, follow_up: bool = False) -> Measurement:
    """Read the measured data set in ``folder``. With ``follow_up`` it may hold only single bodies and no condition.

    Raises:
        MeasurementError: one line naming file, key, value and what is allowed.
    """
    if not folder.is_dir():
        raise MeasurementError(f"{folder}: no such folder")
    path = folder / FILE
    with naming_file(path, *WRONG, raised=MeasurementError, within=path.parent):
        table = read_toml(path)
        outside = [f"{key}: {file} is outside the folder" for key, file in outside_files(folder, table)]
        return _read(folder, table, outside, follow_up)


def outside_files(folder: Path, table: Mapping[str, Any]) -> Iterator[tuple[str, Path]]:
    """Yield the files outside ``folder``, except shipped ones, that reading the data set would open by path or link.

    Args:
        folder: where ``measurement.toml`` is.
        table: its contents, well-formed or not.

    Each file comes with the key of ``measurement.toml``, or the name of the link in the folder, that leads to it.
    """
    root = folder.resolve()
    # Lazily: a file outside need not be opened to be reported.
    for key, file in _named_files(folder, table):
        # Not Path.resolve, which raises for circular links.
        if "\0" not in str(file) and not (found := Path(os.path.realpath(file))).is_relative_to(root):
            yield key, found


def _named_files(folder: Path, table: Mapping[str, Any]) -> Iterator[tuple[str, Path]]:
    """Every file except shipped ones that is read along with ``measurement.toml``, and the key that leads to it."""
    if isinstance(bodies := table.get("bodies"), str):
        yield "bodies", folder / bodies
    conditions = table.get("condition")
    tables = [entry for entry in (conditions if isinstance(conditions, list) else []) if isinstance(entry, dict)]
    yield from (("material", file) for file in _of_material(folder, table.get("material")))
    for entry in tables:
        yield from (("condition.material", file) for file in _of_material(folder, entry.get("material")))
        images = entry.get("images")
        pictures = (
            [one.get("file") if isinstance(one, dict) else one for one in images] if isinstance(images, list) else []
        )
        named = [("condition.data", entry.get("data")), *(("condition.images", picture) for picture in pictures)]
        yield from ((key, folder / name) for key, name in named if isinstance(name, str))
        rig = entry.get("rig_parameters")
        if isinstance(rig, dict) and isinstance(mesh := rig.get("mesh"), str):
            yield "condition.rig_parameters.mesh", folder / own_path(mesh)
    for kind in ("piles", "scans"):
        yield from ((f"{kind}/{file.name}", file) for file in sorted((folder / kind).glob("*")))


def _of_material(folder: Path, name: object) -> Iterator[Path]:
    """The file of a material that is not shipped, and the files that it names: meshes, and bodies with their meshes."""
    path = folder / own_path(name) if isinstance(name, str) and "\0" not in name else None
    if path is not None and path.is_file():
        yield path
        for file in files_named_in(read_toml(path)):
            if isinstance(file, str):
                yield from _of_body(path.parent / own_path(file))


def _of_body(path: Path) -> Iterator[Path]:
    """A file that a material names and, if it is the file of a body, the files that this names in turn."""
    yield path
    if path.suffix == ".toml" and path.is_file():
        yield from (path.parent / own_path(file) for file in files_named_in(read_toml(path)) if isinstance(file, str))


def _read(folder: Path, table: Settings, outside: Sequence[str], follow_up: bool) -> Measurement:
    file = checked(MeasurementFile, table)
    base = load_material(file.material, relative_to=folder)
    given = _condition_entries(file.condition, needed=not follow_up or file.bodies is None)
    declared, bare = [], []
    for entry in given:
        with _within(entry.name):
            declared.append(base if entry.material is None else load_material(entry.material, relative_to=folder))
            bare.append(in_rig(declared[-1], entry.rig))
    measured, notes = read_parameters(file.parameters, bare or [base])
    uncertainty = _uncertainty(file.uncertainty)
    names = [entry.name for entry in given]
    piles, strangers = pile_files(folder, names)
    scans, unknown = scan_files(folder, names)
    conditions: list[Condition] = []
    checks: list[CrossCheck] = []
    ignored = [f"{path.parent.name}/{path.name}: of no condition" for path in (*strangers, *unknown)]
    for entry, material in zip(given, declared, strict=True):
        name = entry.name
        with _within(name):
            scene = condition_scene(material, entry, measured)
            photographed, unread = photograph_values(folder, entry.images)
        surfaces: dict[int, UpperSurface] = {**pile_surfaces(piles[name]), **read_scans(scans[name], entry.scan)}
        replicates, observations, crossed, unused = read_observations(
            name, folder / entry.data, piles[name], photographed, scene, uncertainty
        )
        if max(surfaces, default=0) > replicates:
            last = max(surfaces)
            raise MeasurementError(
                f"{scans[name][last]}: replicate {last}; allowed: 1 to {replicates}, as in the table"
            )
        conditions.append(
            Condition(name, entry.role, scene, replicates, observations, entry.mean_of, surfaces, entry.turned)
        )
        checks += crossed
        ignored += unused
        ignored += [f"condition {name}: images: {line}" for line in unread]
    bodies = () if file.bodies is None else read_bodies(folder / own_path(file.bodies), base)
    _of_one_material(bodies, conditions)
    suited = tuple(narrowed(parameter, [condition.scene for condition in conditions]) for parameter in measured)
    return Measurement(
        folder=folder,
        title=file.title,
        scene=base,
        parameters=suited,
        conditions=tuple(conditions),
        ignored=tuple(ignored),
        notes=(*outside, *notes, *_narrowed(measured, suited), *_assumed(base, measured)),
        cross_check=tuple(checks),
        bodies=bodies,
    )


def _of_one_material(bodies: Sequence[MeasuredBody], conditions: Sequence[Condition]) -> None:
    """Raise if a measured body differs between fitted conditions because one of them has its own material."""
    scenes = [condition.scene for condition in conditions if condition.role == "fit"]
    for row in bodies:
        kinds = {next((one for one in scene.bodies if one.name == row.body), None) for scene in scenes}
        if len(kinds) > 1:
            raise MeasurementError(f"bodies: {row.body}: differs between the fitted conditions; allowed: one material")


def _condition_entries(tables: Sequence[Settings], needed: bool) -> list[ConditionTable]:
    """The conditions in order; ``needed``: whether at least one is required."""
    given: list[ConditionTable] = []
    for table in tables:
        with _within(table.get("name")):
            given.append(checked(ConditionTable, table))
        if given[-1].name in (entry.name for entry in given[:-1]):
            raise MeasurementError(f"condition.name: {given[-1].name!r} appears twice; allowed: each name once")
    if not any(entry.role == "fit" for entry in given) and (given or needed):
        raise MeasurementError(
            f"condition.role: none of {len(given)} conditions has the role fit; at least one is needed"
        )
    return given


def _uncertainty(table: Mapping[str, float | str]) -> dict[str, float]:
    found = {}
    for name, value in table.items():
        known = named(name)
        if known is None:
            raise MeasurementError(f"uncertainty.{name}: no such observable; allowed: {', '.join(all_names())}")
        found[name] = parse_quantity(value, known.unit, f"uncertainty.{name}")
        if found[name] <= 0.0:
            raise MeasurementError(f"uncertainty.{name}: {found[name]:g}; allowed: more than 0")
    return found


def _narrowed(before: Sequence[MeasuredParameter], after: Sequence[MeasuredParameter]) -> Iterator[str]:
    """Notes on ranges that had to be narrowed because a rig does not accept all of their values."""
    for old, new in zip(before, after, strict=True):
        if old != new:
            yield f"{old.path}: range {old.low:g} … {old.high:g} narrowed to {new.low:g} … {new.high:g} by the rig"


def _assumed(base: Scene, measured: Sequence[MeasuredParameter]) -> Iterator[str]:
    """Notes on values that were neither measured nor are calibrated."""
    # The material file writes `materials.x`, parameter paths `material.x`.
    paths = {parameter.path for parameter in measured}
    for path in base.assumed:
        if path.replace("materials.", "material.", 1) not in paths:
            yield f"{path}: assumed in the material, and not among [parameters]"


@contextmanager
def _within(name: str | None) -> Iterator[None]:
    """Prefix an error with the condition that it is about."""
    try:
        yield
    except WRONG as error:
        raise MeasurementError(f"condition {name!r}: {error}" if name else f"condition: {error}") from None
