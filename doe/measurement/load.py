"""``measurement.toml`` and the files beside it → :class:`Measurement`, with one clear line for whatever is wrong.

format = 1
title, source                free text, never interpreted
material = "material.toml"   the declared base model, or a shipped material
[parameters]                 what calibration may move (`parameter_table`)
[uncertainty]                observable → standard deviation of one value, where replicates cannot give it
[[condition]]                set-up and table (`condition_table`, `long_form`); its `material`: another declared one
piles/, scans/               scanned piles (`piles`) and scanned surfaces (`scans`) of the replicates
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from doe.errors import MeasurementError, StudyFileError
from doe.measurement.condition_table import KEYS as CONDITION_KEYS
from doe.measurement.condition_table import condition_scene, in_rig, is_turned
from doe.measurement.measurement import Condition, CrossCheck, MeasuredParameter, Measurement, Role
from doe.measurement.observations import read_observations
from doe.measurement.parameter_table import narrowed, read_parameters
from doe.measurement.photographs import photograph_entries, photograph_values
from doe.measurement.piles import pile_files, pile_surfaces
from doe.measurement.scans import UpperSurface, read_scans, scan_files, scan_settings
from doe.studies.study_table import Table, entries, one_of, only, required, section, whole
from solver import AssetNotFoundError, ParameterError, Scene, all_names, load_material, named, parse_quantity, read_toml

FILE = "measurement.toml"
KEYS = ("format", "title", "source", "material", "parameters", "uncertainty", "condition")
ROLES: tuple[Role, ...] = ("fit", "holdout")


def load_measurement(folder: Path) -> Measurement:
    """The measured data set in ``folder``.

    Raises:
        MeasurementError: one line naming file, key, value and what is allowed.
    """
    if not folder.is_dir():
        raise MeasurementError(f"{folder}: no such folder")
    path = folder / FILE
    with _naming(path):
        return _read(folder, read_toml(path))


def _read(folder: Path, table: Table) -> Measurement:
    only(table, KEYS, "")
    if table.get("format") != 1:
        raise MeasurementError(f"format: {table.get('format')!r}; allowed: 1")
    base = _material(table, folder)
    given = _condition_entries(table)
    declared, bare = [], []
    for entry in given:
        with _within(entry):
            declared.append(_material(entry, folder) if "material" in entry else base)
            bare.append(in_rig(declared[-1], str(entry["rig"])))
    measured, notes = read_parameters(section(table, "parameters"), bare)
    uncertainty = _uncertainty(section(table, "uncertainty"))
    names = [str(entry["name"]) for entry in given]
    piles, strangers = pile_files(folder, names)
    scans, unknown = scan_files(folder, names)
    conditions: list[Condition] = []
    checks: list[CrossCheck] = []
    ignored = [f"{path.parent.name}/{path.name}: of no condition" for path in (*strangers, *unknown)]
    for entry, material in zip(given, declared, strict=True):
        name = str(entry["name"])
        with _within(entry):
            scene = condition_scene(material, entry, measured)
            mean_of = whole(entry.get("mean_of", 1), "mean_of", 1)
            photographed, unread = photograph_values(folder, photograph_entries(entry.get("images", [])))
            settings = scan_settings(section(entry, "scan"))
        surfaces: dict[int, UpperSurface] = {**pile_surfaces(piles[name]), **read_scans(scans[name], settings)}
        replicates, observations, checked, unused = read_observations(
            name, folder / str(entry["data"]), piles[name], photographed, scene, uncertainty
        )
        if max(surfaces, default=0) > replicates:
            last = max(surfaces)
            raise MeasurementError(
                f"{scans[name][last]}: replicate {last}; allowed: 1 to {replicates}, as in the table"
            )
        conditions.append(
            Condition(name, entry["role"], scene, replicates, observations, mean_of, surfaces, is_turned(entry))
        )
        checks += checked
        ignored += unused
        ignored += [f"condition {name}: images: {line}" for line in unread]
    suited = tuple(narrowed(parameter, [condition.scene for condition in conditions]) for parameter in measured)
    return Measurement(
        folder=folder,
        title=str(table.get("title", "")),
        scene=base,
        parameters=suited,
        conditions=tuple(conditions),
        ignored=tuple(ignored),
        notes=(*notes, *_narrowed(measured, suited), *_assumed(base, measured)),
        cross_check=tuple(checks),
    )


def _material(table: Table, folder: Path) -> Scene:
    """The declared model that ``table`` names."""
    name = table.get("material")
    if not isinstance(name, str):
        raise MeasurementError(f"material: {name!r}; allowed: a material file or a shipped material")
    return load_material(name, relative_to=folder)


def _condition_entries(table: Table) -> list[Table]:
    given = entries(table, "condition")
    names = set()
    for entry in given:
        required(entry, ("name", "role", "rig", "data"), "condition")
        with _within(entry):
            only(entry, CONDITION_KEYS, "")
            one_of(entry["role"], "role", ROLES)
        if str(entry["name"]) in names:
            raise MeasurementError(f"condition.name: {entry['name']!r} stands twice; allowed: each name once")
        names.add(str(entry["name"]))
    if not any(entry["role"] == "fit" for entry in given):
        raise MeasurementError(f"condition.role: none of {len(given)} conditions is fit; allowed: at least one fit")
    return given


def _uncertainty(table: Table) -> dict[str, float]:
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
    """Notes on ranges that a rig does not take."""
    for old, new in zip(before, after, strict=True):
        if old != new:
            yield f"{old.path}: range {old.low:g} … {old.high:g} narrowed to {new.low:g} … {new.high:g} by the rig"


def _assumed(base: Scene, measured: Sequence[MeasuredParameter]) -> Iterator[str]:
    """Notes on values that nobody measured and that are not calibrated either."""
    # The material file writes `materials.x`, parameter paths `material.x`.
    paths = {parameter.path for parameter in measured}
    for path in base.assumed:
        if path.replace("materials.", "material.", 1) not in paths:
            yield f"{path}: assumed in the material, and not among [parameters]"


@contextmanager
def _within(entry: Table) -> Iterator[None]:
    """Put the condition in front of an error about it."""
    try:
        yield
    except (ParameterError, StudyFileError, MeasurementError, AssetNotFoundError) as error:
        raise MeasurementError(f"condition {entry['name']!r}: {error}") from None


@contextmanager
def _naming(path: Path) -> Iterator[None]:
    """Put the name of the file in front of an error about its contents, unless the error names a file itself."""
    try:
        yield
    except (ParameterError, StudyFileError, MeasurementError, AssetNotFoundError) as error:
        text = str(error)
        raise MeasurementError(text if text.startswith(str(path.parent)) else f"{path}: {text}") from None
