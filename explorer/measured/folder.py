"""A folder of measured data (`doe/measurement/README.md`) from a laboratory's files; and one more condition in it.

The first condition of a folder is fitted. When a second is added, one of the two is held out, as a proposal that is
reported and written into the file: the one that gives fewer numbers, or the later one if they are equal, because
held-out data are predicted and never fitted. Once one is held out, or a role was asked for, roles stay as they are.

The general reader of data sets reads the folder before it appears. An existing folder is changed only after that, its
``measurement.toml`` last, so that it holds a complete data set at any time.
"""

from __future__ import annotations

import dataclasses
import math
import shutil
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomlkit

from doe.errors import MeasurementError
from doe.measurement import Measurement, load_measurement, reach_of
from doe.measurement.condition_table import AS_THEY_ARE, in_rig
from doe.measurement.load import FILE
from doe.measurement.long_form import COLUMNS
from doe.measurement.measurement import Role
from doe.studies.study import load_study
from explorer.diagnosis.next_folder import copied_material, measurement_toml
from explorer.errors import CommandError
from explorer.files.output_file import write_whole
from explorer.files.run_folder import appearing
from explorer.measured.readings import Brought, Readings, read_brought
from explorer.scene.file import material_scene, study_path, with_settings
from explorer.scene.source import differences
from explorer.scene.starter_files import SPAN, check_name, factor_paths
from explorer.scene.text import toml_key, toml_value
from explorer.terminal.measurement import check_text
from solver import Scene, asset_path, parameters, pour_rig, read_toml, value

FIRST = "A"
"""Name of the first condition, unless another is given."""
STATED = ("rig.", *(f"insertion.{key}" for key in (*AS_THEY_ARE, "region_height", "drop_speed")), "numerics.duration")
"""Beginnings of the paths that a condition can state itself."""
FREE = ("material", "pair", "body", "contact")
"""Kinds of parameters that describe the material in every condition."""
OF_STUDY = "What calibration may move: the factors of the study"
ASSUMED = (
    f"what calibration may move. Ranges without mean and sd are ± {SPAN:.0%} of the material's values: CHANGE THEM"
)


@dataclass(frozen=True)
class NewCondition:
    """One condition as requested."""

    name: str = FIRST
    role: Role | None = None
    study: str | None = None
    """Study to whose material, set-up and factors the data belong."""
    material: str | None = None
    settings: tuple[str, ...] = ()
    """Items path=value of the set-up."""
    uncertainty: tuple[str, ...] = ()
    """Items observable=standard deviation of one value."""


@dataclass(frozen=True, eq=False)
class WrittenCondition:
    """The data set with the new condition."""

    measurement: Measurement
    files: tuple[Path, ...]
    told: tuple[str, ...]
    """What was read, assumed and left out."""
    proposal: str


def has_data(folder: Path) -> bool:
    """Whether ``folder`` holds measured data, to which a condition can be added."""
    return (folder / FILE).exists()


def written_text(found: WrittenCondition) -> str:
    """What was written, what was read from it, and what all the data can tell."""
    lines = [*(f"wrote {path}" for path in found.files), *(f"note: {line}" for line in found.told)]
    return "\n".join(lines) + f"\n\n{check_text(found.measurement)}\n\n{found.proposal}"


def write_condition(folder: Path, asked: NewCondition, brought: Brought) -> WrittenCondition:
    """Write ``brought`` into the new ``folder``, or as one more condition into a folder of measured data.

    Raises CommandError, MeasurementError or another ValueError of this program in one line, with nothing changed.
    """
    check_name(asked.name)
    return (_added if has_data(folder) else _begun)(folder, asked, brought)


def _begun(folder: Path, asked: NewCondition, brought: Brought) -> WrittenCondition:
    if (asked.study is None) == (asked.material is None):
        raise CommandError(
            f"{folder}: a new folder needs --study or --material, one of the two: the model to compare the data with"
        )
    file = study_path(asked.study) if asked.study is not None else None
    named = str(read_toml(file)["material"]) if file else str(asked.material)
    scene = load_study(str(file)).scene if file else material_scene(named)
    scene = _set(scene, asked)
    free, left_out = _of_study(file) if file else (_starter_ranges(scene, named), [])
    found = read_brought(brought, scene)
    with appearing(folder, "NAME") as made:
        material = copied_material(named, file.parent if file else Path(), made)
        base = material_scene(material, made)
        entry = _entry(base, scene, asked, asked.role or "fit", found, brought)
        top = {"format": 1, "title": folder.resolve().name, "material": material}
        text = measurement_toml(top, {"parameters": free, "uncertainty": _uncertainty(asked)}, entry)
        about = OF_STUDY if file else ASSUMED
        _write_data(made, asked.name, found)
        files = [*sorted(file for file in made.rglob("*") if file.is_file()), made / FILE]
        write_whole(files[-1], _heading(folder) + text.replace("[parameters]\n", f"# {about}.\n[parameters]\n", 1))
        measurement = dataclasses.replace(_loaded(made, folder), folder=folder)
    told = [*found.told, *left_out, *_unstated(scene, measurement, asked.name)]
    proposal = f"role: {asked.name} is fitted; another condition, poured otherwise, would be held out"
    if not free:
        told.append("no [parameters]: nothing is calibrated; state what may move and how far")
    return WrittenCondition(measurement, _moved(files, made, folder), tuple(told), proposal)


def _added(folder: Path, asked: NewCondition, brought: Brought) -> WrittenCondition:
    for option, given in (("--study", asked.study), ("--material", asked.material)):
        if given is not None:
            raise CommandError(f"{option}: {folder / FILE} has its own; allowed only for a new folder")
    before = load_measurement(folder)
    names = [one.name for one in before.conditions]
    if asked.name in names or (folder / f"{asked.name}.csv").exists():
        raise CommandError(f"--condition {asked.name}: exists already; allowed: a name other than {', '.join(names)}")
    scene = _set(before.conditions[0].scene, asked)
    found = read_brought(brought, scene)
    # Beside the folder, so that relative paths in its files stay valid.
    staged = Path(tempfile.mkdtemp(prefix=".measurement-", dir=folder.resolve().parent))
    try:
        shutil.copytree(folder, staged, dirs_exist_ok=True)
        free = [parameter.path for parameter in before.parameters]
        entry = _entry(before.scene, scene, asked, asked.role or "fit", found, brought, free)
        text = (
            (folder / FILE).read_text(encoding="utf-8-sig").rstrip() + "\n\n" + measurement_toml({}, {}, entry).lstrip()
        )
        text = _with_uncertainty(text, asked, folder)
        files = [*_write_data(staged, asked.name, found), staged / FILE]
        _check_new(folder, asked.name, [file.relative_to(staged) for file in files[:-1]])
        write_whole(files[-1], text)
        measurement = _loaded(staged, folder)
        held = _to_hold_out(measurement) if asked.role is None else None
        if held is not None:
            write_whole(files[-1], _with_role(text, held))
            roles = tuple(
                dataclasses.replace(one, role="holdout") if one.name == held else one for one in measurement.conditions
            )
            measurement = dataclasses.replace(measurement, conditions=roles)
        for file in files:
            place = folder / file.relative_to(staged)
            place.parent.mkdir(exist_ok=True)
            file.replace(place)
    finally:
        shutil.rmtree(staged, ignore_errors=True)
    told = [*found.told, *_unstated(scene, measurement, asked.name)]
    told += [
        f"{asked.name} has the set-up of {one.name}: it is another sample of that, and no other condition"
        for one in before.conditions
        if one.scene == next(new for new in measurement.conditions if new.name == asked.name).scene
    ]
    measurement = dataclasses.replace(measurement, folder=folder)
    return WrittenCondition(measurement, _moved(files, staged, folder), tuple(told), _proposal(measurement, held))


# The set-up


def _set(scene: Scene, asked: NewCondition) -> Scene:
    for setting in asked.settings:
        if not setting.strip().startswith(STATED):
            raise CommandError(
                f"--set {setting}: a condition cannot state it; allowed: rig.name, rig.…, {', '.join(STATED[1:])}"
            )
    return with_settings(scene, asked.settings)


def _of_study(file: Path) -> tuple[dict[str, Any], list[str]]:
    """[parameters] from the factors of a study; lines on those that no data set can leave open, and on references."""
    study = load_study(str(file))
    open_ = [f for f in study.factors if f.path.startswith(tuple(f"{kind}." for kind in FREE))]
    free = {f.path: {"low": float(f.low), "high": float(f.high)} for f in open_ if not isinstance(f.low, str)}
    shut = [f.path for f in study.factors if f.path not in free]
    left_out = [f"not among [parameters], as a condition states them: {', '.join(shut)}"] if shut else []
    return free, [*left_out, *study.replaced]


def _starter_ranges(scene: Scene, material: str) -> dict[str, Any]:
    """[parameters] like the factors of a starter study; mean and sd if the material's file has measured ones."""
    file, declared = asset_path("materials", material), parameters(scene)
    measured = read_toml(file).get("measured", {})
    free: dict[str, Any] = {}
    for path in factor_paths(scene):
        here: Any = measured
        place = path.replace("material.", "materials.", 1)
        for key in place.split("."):
            here = here.get(key) if isinstance(here, Mapping) else None
        if isinstance(here, Mapping) and "sd" in here:
            mean, sd = (_measured(f"{file}: measured.{place}.{key}", here.get(key)) for key in ("value", "sd"))
            if sd > 0.0:
                free[path] = {"mean": mean, "sd": sd}
                continue
        reference, known = float(value(scene, path)), declared[path]
        low, high = max(known.low, (1.0 - SPAN) * reference), min(known.high, (1.0 + SPAN) * reference)
        free[path] = {"low": float(f"{low:.6g}"), "high": float(f"{high:.6g}")}
    return free


def _measured(where: str, given: Any) -> float:
    if isinstance(given, bool) or not isinstance(given, int | float) or not math.isfinite(given):
        said = "missing, with an sd beside it" if given is None else repr(given)
        raise CommandError(f"{where}: {said}; allowed: a number in SI")
    return float(given)


def _entry(
    base: Scene,
    scene: Scene,
    asked: NewCondition,
    role: str,
    found: Readings,
    brought: Brought,
    free: Sequence[str] = (),
) -> dict[str, Any]:
    """The ``[[condition]]`` that turns ``base`` into ``scene``, except for the calibrated paths ``free``."""
    bare, fed = in_rig(base, scene.rig.name), scene.insertion
    rig = {path.removeprefix("rig."): value(scene, path) for path in parameters(scene) if path.startswith("rig.")}
    rig = {key: given for key, given in rig.items() if f"rig.{key}" not in free}
    insertion: dict[str, Any] = {key: getattr(fed, key) for key in AS_THEY_ARE}
    insertion["velocity"] = [0.0, 0.0, -fed.drop_speed]
    if fed.region_height != bare.insertion.region_height:
        floor = pour_rig(scene).feed().floor
        insertion["region_z"] = [floor, floor + fed.region_height]
    if fed.lead > 0.0:
        insertion["batch_interval"] = fed.lead
    if scene.numerics.duration > 0.0:
        insertion["duration"] = scene.numerics.duration
    entry: dict[str, Any] = {"name": asked.name, "role": role, "rig": scene.rig.name, "data": f"{asked.name}.csv"}
    if found.photographs:
        scale = {} if brought.pixel is None else {"pixel": brought.pixel}
        entry["images"] = [{"file": f"images/{name}"} | scale for name in _kept_names(asked.name, found.photographs)]
    entry |= {"rig_parameters": rig, "insertion": insertion}
    if found.scans:
        entry["scan"] = {"unit": brought.scan_unit}
    return entry


def _unstated(scene: Scene, measurement: Measurement, name: str) -> list[str]:
    """A line on what the folder cannot state of ``scene``, apart from what is calibrated."""
    free = {parameter.path for parameter in measurement.parameters}
    (now,) = (one.scene for one in measurement.conditions if one.name == name)
    lost = [
        str(one) for one in differences(scene, now) if one.path not in free and one.path != "insertion.region_height"
    ]
    return [f"otherwise than asked for, since no condition states it: {'; '.join(lost)}"] if lost else []


# The files


def _heading(folder: Path) -> str:
    return (
        f"# {folder.resolve().name}: measured data, begun by `explorer new measurement`. SI, angles in degrees.\n"
        "# `explorer measurements check` says what they can tell, `explorer diagnose` what the material lacks.\n"
    )


def _kept_names(condition: str, files: Sequence[Path]) -> list[str]:
    return [f"{condition}_{k}{file.suffix.lower()}" for k, file in enumerate(files, start=1)]


def _write_data(folder: Path, condition: str, found: Readings) -> list[Path]:
    """The table of ``condition``, its pictures and scans, in ``folder``."""
    head = [f"# {' '.join(line.split())}" for line in found.sources]
    rows = [
        f"{row.replicate},{row.observable},{'' if row.x is None else repr(row.x)},{row.value!r}" for row in found.rows
    ]
    written = [folder / f"{condition}.csv"]
    write_whole(written[0], "\n".join([*head, ",".join(COLUMNS), *rows]) + "\n")
    for kept, files in (("images", found.photographs or found.faces), ("scans", found.scans)):
        for file, name in zip(files, _kept_names(condition, files), strict=True):
            (folder / kept).mkdir(exist_ok=True)
            written.append(Path(shutil.copyfile(file, folder / kept / name)))
    return written


def _check_new(folder: Path, condition: str, files: Sequence[Path]) -> None:
    for file in files:
        if (folder / file).exists():
            raise CommandError(
                f"--condition {condition}: {folder / file} exists already; allowed: a name whose files do not exist"
            )


def _moved(files: Sequence[Path], made: Path, folder: Path) -> tuple[Path, ...]:
    return tuple(folder / file.relative_to(made) for file in files)


def _loaded(made: Path, folder: Path) -> Measurement:
    """The data set in ``made``, which is to become ``folder``; errors name the latter."""
    try:
        measurement = load_measurement(made)
    except MeasurementError as error:
        hint = " (--uncertainty NAME=VALUE)" if "[uncertainty]" in str(error) else ""
        raise MeasurementError(str(error).replace(str(made), str(folder)) + hint) from None
    for one in measurement.conditions:
        if not one.observations:
            said = "; ".join(line for line in measurement.ignored if line.startswith(f"{one.name}: "))
            raise MeasurementError(
                f"{folder}: condition {one.name!r} has no usable value ({said}); allowed: two pours or more, or "
                "--uncertainty NAME=VALUE"
            )
    return measurement


def _uncertainty(asked: NewCondition) -> dict[str, float | str]:
    found: dict[str, float | str] = {}
    for text in asked.uncertainty:
        name, _, given = (part.strip() for part in text.rpartition("="))
        if not name or not given:
            raise CommandError(f"--uncertainty {text}: allowed: observable=value, such as angle_of_repose_deg=1.5")
        try:
            found[name] = float(given)
        except ValueError:
            found[name] = given
    return found


def _with_uncertainty(text: str, asked: NewCondition, folder: Path) -> str:
    """``text`` with a table of the stated uncertainties; an error if it has one already."""
    stated = _uncertainty(asked)
    if stated and "uncertainty" in tomlkit.parse(text):
        raise CommandError(f"--uncertainty: {folder / FILE} has [uncertainty]; state it there")
    lines = [f"{toml_key(name)} = {toml_value(given)}" for name, given in stated.items()]
    return text + "\n".join(["\n[uncertainty]", *lines, ""]) if lines else text


# Roles


def _numbers(measurement: Measurement) -> dict[str, int]:
    """Condition → number of its summaries that have a spread."""
    return {
        one.condition: sum(
            math.isfinite(number.standard_error) and number.standard_error > 0.0 for number in one.resolutions
        )
        for one in reach_of(measurement).conditions
    }


def _to_hold_out(measurement: Measurement) -> str | None:
    """Name of the condition that gives the fewest numbers, the last of several; None if one is held out already."""
    if measurement.holdout:
        return None
    numbers = _numbers(measurement)
    return min(reversed(numbers), key=lambda name: numbers[name])


def _with_role(text: str, held: str) -> str:
    document: Any = tomlkit.parse(text)
    next(one for one in document["condition"] if one["name"] == held)["role"] = "holdout"
    return tomlkit.dumps(document)


def _proposal(measurement: Measurement, proposed: str | None) -> str:
    numbers = _numbers(measurement)
    listed = ", ".join(f"{name} {count}" for name, count in numbers.items())
    if proposed is None:
        held = ", ".join(one.name for one in measurement.holdout) or "none"
        return f"roles: held out: {held}, as before or as asked for; numbers with a spread: {listed}"
    return (
        f"roles: proposed to hold out: {proposed}, since it tells no more than any other (numbers with a spread: "
        f"{listed}) and what is held out is predicted, never fitted; change role in {FILE} to choose otherwise"
    )
