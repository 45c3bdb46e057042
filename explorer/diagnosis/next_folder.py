"""What to measure next, as a folder that a laboratory fills in (``OUT/next`` of a diagnosis): written and read.

measurement.toml, <name>.csv, scans/    a measured data set (`doe.measurement`) of one condition, without its values
bodies.csv                              what to measure on single bodies, if that tells the answers apart; alone,
                                        without a condition, if there is an answer that single bodies can check
README.md, setup.svg                    what to set differently, in words and to scale
follow_up.json                          which answers the pours are to tell apart, and the folders of earlier follow-ups
"""

from __future__ import annotations

import json
import math
import os
import re
import shlex
import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from doe.diagnose.result import BASE, Suggestion
from doe.diagnose.verdict import NOTHING_FROM, THRESHOLD
from doe.errors import MeasurementError
from doe.measurement.bodies import COLUMNS as BODY_COLUMNS
from doe.measurement.bodies import QUANTITIES
from doe.measurement.condition_table import AS_THEY_ARE, FEED_SLACK
from doe.measurement.load import FILE, MeasurementFile, load_measurement
from doe.measurement.long_form import COLUMNS, MOST_BYTES
from doe.measurement.measurement import Condition, Measurement
from doe.measurement.parameter_table import read_parameters
from doe.record import plain
from doe.table_file import read_table, read_text
from explorer.diagnosis.setup_drawing import PROTOCOLS, millimetres, setup_svg
from explorer.errors import CommandError
from explorer.files.output_file import write_whole
from explorer.files.run_folder import appearing
from explorer.report.diagnosis.wording import FOLLOW_UPS_SO_FAR, spelled
from explorer.scene.text import toml_key, toml_value
from explorer.units import code, enumeration, number, parameter_label, parameter_value, percent
from solver import EFFECTS, Scene, Settings, checked, named, parse_quantity, pour_rig, read_toml, value
from solver.assets import own_path

ORDER, SCHEMA, BODIES = "follow_up.json", 1, "bodies.csv"
NEXT = "next"
"""Name of the folder inside that of the diagnosis."""
DROPPED = ("images", "mean_of", "material")
"""Keys dropped from a condition: they describe pours already made; its material becomes that of the whole follow-up."""
TURNED_FRAME = "x and y of what is read off the pile, and the axes of scans, stay those of the plate and turn with it"


@dataclass(frozen=True, eq=False)
class NextFolder:
    """A follow-up that was measured: the labels it is to tell apart, the name of the change, and its data.

    before: folders of the follow-ups that were among the data when it was asked for, in their order.
    """

    rivals: tuple[str, ...]
    change: str
    measurement: Measurement
    before: tuple[Path, ...]


def write_next(
    folder: Path,
    source: Path,
    measurement: Measurement,
    suggestion: Suggestion,
    given: Path | None = None,
    taken: Sequence[str] = (),
    before: Sequence[Path] = (),
) -> None:
    """Write ``suggestion``, a change of a condition of ``measurement`` as read from ``source``, to the new ``folder``.

    ``given``: finished diagnosis that the command for the follow-up also has to name. ``taken``: names of further
    conditions, from earlier follow-ups. ``before``: folders of those that were among the data.

    Raises CommandError in one line if the folder is not empty or no condition can state the change.
    """
    with appearing(folder, option="") as made:
        if suggestion.bodies:
            write_whole(made / BODIES, _empty_bodies(suggestion.bodies))
        if suggestion.pours:
            readme = _write_pours(made, source, measurement, suggestion, taken, bool(before))
        else:
            table = read_toml(source / FILE)
            stated = next(one for one in table["condition"] if one["name"] == suggestion.condition)
            material = copied_material(str(stated.get("material", table["material"])), source, made)
            title = f"{measurement.title or source.name}: {suggestion.experiment.name}"
            top = {"format": 1, "title": title, "material": material, "bodies": BODIES}
            write_whole(made / FILE, measurement_toml(top))
            readme = _readme_of_bodies(source, measurement, suggestion)
        write_whole(made / "README.md", f"{readme}\n{_command(folder, source, given, before)}")
        order = {"schema": SCHEMA, "rivals": suggestion.rivals, "change": suggestion.experiment.name}
        order |= {"values": suggestion.values, "turned": suggestion.turned, "condition": suggestion.condition}
        # Relative, so that a project can be moved as a whole.
        earlier = [Path(os.path.relpath(one.resolve(), folder.resolve())).as_posix() for one in before]
        order |= {"source": str(source.absolute()), "before": earlier}
        write_whole(made / ORDER, json.dumps(plain(order), ensure_ascii=False, indent=1) + "\n")


def _write_pours(
    made: Path, source: Path, measurement: Measurement, suggestion: Suggestion, taken: Sequence[str], further: bool
) -> str:
    """Write the condition to be poured into ``made``; returns its README. ``further``: not the first follow-up."""
    # This import loads the solver's kernels, which writing a measurement's file alone does not need.
    from doe.diagnose.candidate_experiments import as_suggested

    table = read_toml(source / FILE)
    condition = next(one for one in measurement.conditions if one.name == suggestion.condition)
    stated = next(one for one in table["condition"] if one["name"] == condition.name)
    name = _free_name(suggestion, measurement, taken)
    changed = as_suggested(condition, suggestion).scene
    entry = _changed_entry(stated, name, measurement, suggestion, changed)
    title = f"{measurement.title or source.name}: follow-up, {suggestion.experiment.name}"
    drawing, scanned = setup_svg(changed, suggestion.values), any(one.surfaces for one in measurement.conditions)
    material = copied_material(str(stated.get("material", table["material"])), source, made)
    top = {"format": 1, "title": title, "material": material} | ({"bodies": BODIES} if suggestion.bodies else {})
    tables = {"parameters": _parameters(table, measurement), "uncertainty": _uncertainty(table, condition)}
    write_whole(made / FILE, measurement_toml(top, tables, entry))
    write_whole(made / f"{name}.csv", _empty_table(condition, suggestion.pours))
    if scanned:
        (made / "scans").mkdir()
        files = f"{name}_1.ply … {name}_{suggestion.pours}.ply"
        unit = f"in metres, or with unit under [condition.scan] in {FILE}"
        told = f"A scan of each pile: {files} (or .stl, .xyz, .npz, .tif), {unit}.\n"
        write_whole(made / "scans/README.txt", told)
    if drawing:
        write_whole(made / "setup.svg", drawing)
    return _readme(source, measurement, suggestion, name, further, bool(drawing), scanned)


def asks_for(folder: Path, suggestion: Suggestion) -> bool:
    """Whether the follow-up in ``folder`` is ``suggestion``, for the same answers."""
    try:
        return _order(folder)[:2] == (tuple(suggestion.rivals), suggestion.experiment.name)
    except CommandError:  # somebody has changed the file
        return False


def read_next(folder: Path) -> NextFolder:
    """The follow-up in ``folder``, filled in.

    Raises CommandError if it is not such a folder or holds no value yet, MeasurementError if the data cannot be read;
    each in one line naming file and key.
    """
    rivals, change, before = _order(folder)
    try:
        measurement = load_measurement(folder, follow_up=True)
        if not measurement.conditions and not measurement.bodies:
            raise CommandError(
                f"{folder / BODIES}: mean: none is filled in yet; remove the # from a row and enter mean and standard "
                "error"
            )
        return NextFolder(rivals, change, measurement, tuple((folder / one).resolve() for one in before))
    except MeasurementError:
        for table in sorted(folder.glob("*.csv")):
            if table.name != BODIES and not _holds_value(table):
                raise CommandError(
                    f"{table}: value: none is filled in yet; remove the # from a row and enter the measured value"
                ) from None
        raise


def measured_so_far(folder: Path) -> tuple[Measurement, ...]:
    """The follow-up in ``folder`` after those before it, each read by :func:`read_next`."""
    last, earlier = read_next(folder), []
    for one in last.before:
        try:
            earlier.append(read_next(one).measurement)
        except (CommandError, MeasurementError) as error:
            raise CommandError(f"{folder / ORDER}: before: {error}") from None
    return (*earlier, last.measurement)


def is_copy(folder: Path, original: Path) -> bool:
    """Whether ``folder`` is the follow-up in ``original``, filled in elsewhere."""
    return _order(folder) == _order(original)


def _order(folder: Path) -> tuple[tuple[str, ...], str, tuple[str, ...]]:
    """Rivals, change and predecessors of the follow-up in ``folder``; raises CommandError if its file is not valid."""
    path = folder / ORDER
    try:
        order = json.loads(read_text(path, MOST_BYTES, CommandError))
    except json.JSONDecodeError as error:
        raise CommandError(f"{path}: no JSON ({error})") from None
    if not isinstance(order, dict) or order.get("schema") != SCHEMA:
        found = order.get("schema") if isinstance(order, dict) else order
        raise CommandError(f"{path}: schema: {found!r:.60}; allowed: {SCHEMA}")
    rivals, change, before = order.get("rivals"), order.get("change"), order.get("before", [])
    if not isinstance(rivals, list) or len(rivals) < 2 or not all(_is_label(label) for label in rivals):
        raise CommandError(
            f"{path}: rivals: {rivals!r:.60}; allowed: a list of {BASE}, effects or pairs a+b, two or more"
        )
    if not isinstance(change, str):
        raise CommandError(f"{path}: change: {change!r:.60}; allowed: the name of a change")
    if not isinstance(before, list) or not all(isinstance(one, str) for one in before):
        raise CommandError(f"{path}: before: {before!r:.60}; allowed: a list of folders of earlier follow-ups")
    return tuple(rivals), change, tuple(before)


def _is_label(label: Any) -> bool:
    return isinstance(label, str) and (label == BASE or all(name in EFFECTS for name in label.split("+")))


def _holds_value(table: Path) -> bool:
    found = read_table(table, MOST_BYTES, MeasurementError, ":{}", comments=True)
    at = COLUMNS.index("value")
    return any(len(cells) > at and cells[at] for _, cells in found.rows[1:])


# The data set


def _free_name(suggestion: Suggestion, measurement: Measurement, others: Sequence[str]) -> str:
    """The change as a file name that no condition has: a diagnosis takes the new data beside the old."""
    slug = re.sub(r"[^a-z0-9]+", "_", suggestion.experiment.name.lower()).strip("_") or "follow_up"
    taken = {Path(BODIES).stem, *others, *(condition.name for condition in measurement.conditions)}
    return next(one for k in range(1, len(taken) + 2) if (one := slug if k == 1 else f"{slug}_{k}") not in taken)


def _changed_entry(
    given: Settings, name: str, measurement: Measurement, suggestion: Suggestion, changed: Scene
) -> dict[str, Any]:
    entry = {key: item for key, item in given.items() if key not in DROPPED}
    entry |= {"name": name, "role": "fit", "data": f"{name}.csv"}
    if suggestion.turned:
        entry["turned"] = not entry.get("turned", False)
    rig, insertion = dict(given.get("rig_parameters", {})), dict(given.get("insertion", {}))
    calibrated = {parameter.path for parameter in measurement.parameters}
    for path, new in suggestion.values.items():
        kind, _, key = path.partition(".")
        if path in calibrated:
            raise CommandError(
                f"{path}: is calibrated, but {suggestion.experiment.name!r} sets it; allowed: one of the two"
            )
        if kind == "rig":
            rig[key] = new
        elif path == "insertion.drop_speed":
            insertion["velocity"] = [0.0, 0.0, -float(new)]
        elif (kind == "insertion" and key in AS_THEY_ARE) or path == "numerics.duration":
            insertion[key] = new
        else:
            raise CommandError(f"{path}: no condition states it; allowed: rig.…, insertion.drop_speed, {AS_THEY_ARE}")
    if "mesh" in rig:  # a relative path would be resolved in the reader's working directory
        rig["mesh"] = value(changed, "rig.mesh")
    if "region_z" in insertion:
        insertion["region_z"] = _moved(insertion["region_z"], pour_rig(changed).feed().floor)
    return entry | {key: found for key, found in (("rig_parameters", rig), ("insertion", insertion)) if found}


def _moved(region: list[float], floor: float) -> list[float]:
    """``region`` moved to begin at the opening, unless it begins there already.

    Its height stays the same to the last bit if possible: another height would make other pours.
    """
    if abs(region[0] - floor) <= FEED_SLACK:
        return region
    height = region[1] - region[0]
    # The height is a difference of two rounded numbers: their neighbours may give the exact bits when they do not.
    near = [(low, high) for low in _neighbours(floor) for high in _neighbours(floor + height)]
    low, high = min(near, key=lambda ends: abs(ends[1] - ends[0] - height))
    return [low, high]


def _neighbours(x: float) -> tuple[float, float, float]:
    return x, math.nextafter(x, -math.inf), math.nextafter(x, math.inf)


def _parameters(table: Settings, measurement: Measurement) -> dict[str, Any]:
    """As stated, except for a range that another condition's rig has narrowed.

    Read without that condition, the range would stay wide, and a diagnosis refuses a follow-up with other parameters.
    """
    stated = table.get("parameters", {})
    read, _ = read_parameters(
        checked(MeasurementFile, table).parameters, [condition.scene for condition in measurement.conditions]
    )
    rows = zip(stated.items(), read, measurement.parameters, strict=True)
    return {
        path: entry if before == after else {**entry, "low": after.low, "high": after.high}
        for (path, entry), before, after in rows
    }


def _uncertainty(table: Settings, condition: Condition) -> dict[str, Any]:
    """As stated; the uncertainty of a mean of n pours becomes that of one pour, √n times as large."""
    stated = table.get("uncertainty", {})
    if condition.mean_of == 1:
        return stated
    known = {name: found for name in stated if (found := named(name))}
    return {
        name: math.sqrt(condition.mean_of) * parse_quantity(stated[name], found.unit, name)
        for name, found in known.items()
    }


def copied_material(name: str, source: Path, folder: Path) -> str:
    """Name of the material in the new file: that of its copy in ``folder``, or of a shipped material."""
    own = source / own_path(name)
    if not own.is_file():
        return name
    _copy_toml(own, folder / own.name)
    return own.name


def _copy_toml(path: Path, to: Path) -> None:
    """Copy a material or body file with the files it names; those outside its folder are named by full path instead."""
    text = path.read_text(encoding="utf-8")
    for name, is_body in _named_files(read_toml(path)):
        if Path(name).is_absolute() or not (path.parent / name).is_file():
            continue  # valid from anywhere: a full path, or a shipped mesh
        if ".." in Path(name).parts:
            full = toml_value(str((path.parent / name).resolve()))
            text = text.replace(f'"{name}"', full).replace(f"'{name}'", full)
            continue
        (to.parent / name).parent.mkdir(parents=True, exist_ok=True)
        (_copy_toml if is_body else shutil.copyfile)(path.parent / name, to.parent / name)
    write_whole(to, text)


def _named_files(table: Settings) -> Iterator[tuple[str, bool]]:
    """Files that a material or body file names, and whether each is a body file."""
    for body in table.get("body", []):
        shape = body.get("shape")
        for holder, key in ((body, "file"), (body, "mesh"), (shape, "mesh")):
            if isinstance(holder, dict) and key in holder:
                yield str(holder[key]), key == "file"
    if "mesh" in table.get("rig", {}):
        yield str(table["rig"]["mesh"]), False


def measurement_toml(
    top: Mapping[str, Any], tables: Mapping[str, Any] | None = None, entry: Mapping[str, Any] | None = None
) -> str:
    """measurement.toml of the keys ``top``, further ``tables`` and the one condition ``entry``, if there is one."""
    parts = {"": top} | {f"[{name}]\n": table for name, table in (tables or {}).items() if table}
    if entry is None:
        return _toml(parts)
    parts["[[condition]]\n"] = {key: item for key, item in entry.items() if not isinstance(item, dict)}
    parts |= {f"[condition.{toml_key(key)}]\n": item for key, item in entry.items() if isinstance(item, dict)}
    return _toml(parts)


def _toml(parts: Mapping[str, Mapping[str, Any]]) -> str:
    """Tables under their heads."""
    text = "\n".join(
        head + "".join(f"{toml_key(key)} = {toml_value(item)}\n" for key, item in table.items())
        for head, table in parts.items()
    )
    return text.replace("\x7f", "\\u007F")  # the strings are JSON, which allows this character; TOML does not


def _empty_table(condition: Condition, pours: int) -> str:
    """One row per pour, observable and place. Slopes that follow from a listed profile are not asked for.

    The reader refuses a row without a value, so each row is a comment until it has one.
    """
    asked = [one for one in condition.observations if one.origin != "profile"]
    units = ", ".join(f"{one.observable} [{one.unit}]" for one in asked)
    lines = [
        '# Not measured yet. Of each row that you measured, take off the "# " in front and write the value at its end.',
        "# What was not measured stays as it is. Places x of a curve may be others.",
        f"# Units: {units}",
        ",".join(COLUMNS),
    ]
    for replicate in range(1, pours + 1):
        for one in sorted(asked, key=lambda one: one.x is not None):
            places = [""] if one.x is None else [repr(float(x)) for x in one.x]
            lines += [f"# {replicate},{one.observable},{x}," for x in places]
    return "\n".join(lines) + "\n"


def _empty_bodies(asked: Sequence[tuple[str, str]]) -> str:
    """One row per component and quantity, each a comment until it has its numbers."""
    lines = [
        '# Not measured yet. Of each row that you measured, take off the "# " in front and write mean and',
        "# standard error at its end. What was not measured stays as it is.",
        ",".join(BODY_COLUMNS),
    ]
    lines += [f"# {body},{quantity},{QUANTITIES[quantity].written},," for body, quantity in asked]
    return "\n".join(lines) + "\n"


# For people


def _readme(
    source: Path, measurement: Measurement, suggestion: Suggestion, name: str, further: bool, drawn: bool, scanned: bool
) -> str:
    experiment, pours = suggestion.experiment, suggestion.pours
    condition = next(one for one in measurement.conditions if one.name == suggestion.condition)
    title = code(" ".join((measurement.title or source.name).split()))
    answers = enumeration([spelled(label) for label in suggestion.rivals])
    settings = [f"- {_setting(condition.scene, path, new)}" for path, new in suggestion.values.items()]
    if suggestion.turned:
        settings.append(f"- the whole rig, plate and funnel: **turned by 180° on its bench**; {TURNED_FRAME}")
    until = float(suggestion.values.get("numerics.duration", condition.scene.numerics.duration))
    reading = f" Read each pile {number(until)} s after the first body entered, at rest or not." if until > 0.0 else ""
    drawing = " `setup.svg` shows it to scale, what changes in colour." if drawn else ""
    more = f", and a scan of each pile as `scans/{name}_1.ply` and so on" if scanned else ""
    if any(one.origin == "photographs" for one in condition.observations):
        more += f', or name photographs under `[[condition]]` in `{FILE}`: `images = ["…"]`'
    weighed = _what_of_bodies(suggestion, "these answers differ in it") + "\n" if suggestion.bodies else ""
    so_far = "" if further else f" {FOLLOW_UPS_SO_FAR}"
    return f"""# To be measured next: {experiment.name}

The data of {title} leave {len(suggestion.rivals)} answers: {answers}. These pours are to tell them apart.

## What to set otherwise than in condition {code(condition.name)}

{_lines(settings) or "- nothing: the same set-up once more"}

All else stays as it was, and bodies enter right above the feed opening, wherever that is now.{drawing}

Pour **{pours} times**, each time onto the bare plate.{reading}

{weighed}## What it will decide

{pours} pours{" and these numbers" if weighed else ""} give the right answer with a chance of
**{percent(experiment.chance)}**, by simulated pours of the likeliest of these.{so_far}
(An effect is named with {percent(THRESHOLD)} or more, alone or with others; nothing missing is the answer with
{percent(NOTHING_FROM)} or more.)

## Why this one

Of the changes that this rig allows, none has a better chance. By their nature, the effects in question are told by

{_lines([f"- {lever}" for lever in suggestion.levers])}

## What to fill in

`{name}.csv`: take the `# ` off each row that you measured and write the value behind its last comma{more}.
The table needs two pours or more. If a setting came out otherwise than asked, correct it in `{FILE}`.
"""


def _readme_of_bodies(source: Path, measurement: Measurement, suggestion: Suggestion) -> str:
    title = code(" ".join((measurement.title or source.name).split()))
    answer, *others = (spelled(label) for label in suggestion.rivals)
    return f"""# To be checked: {answer}

The data of {title} give this answer. No further pour is asked for: single bodies tell it from
{enumeration(others)}.

{_what_of_bodies(suggestion, "these answers differ in it")}
## What it will decide

These numbers give the right answer with a chance of **{percent(suggestion.experiment.chance)}**, if it is one of these.
They also expose a cause that is in no library: it shifts piles much as some effect does, and leaves single bodies as
they are declared.
"""


def _what_of_bodies(suggestion: Suggestion, why: str) -> str:
    kinds = [f"- {body}, {QUANTITIES[one].words}: {QUANTITIES[one].how}" for body, one in suggestion.bodies]
    return f"""## What to measure of single bodies

It takes minutes, and {why}. Write into `{BODIES}` the mean and its standard error (from the
scatter of lots or bodies, and what the instrument may be off), and take the `# ` off that row.

{_lines(kinds)}
"""


def _command(folder: Path, source: Path, given: Path | None, before: Sequence[Path]) -> str:
    command = ["explorer", "diagnose", str(source.absolute()), "--follow-up", str(folder.absolute())]
    command += [] if given is None else ["--given", str(given.absolute())]
    # The folder of the first diagnosis is no longer empty.
    command += ["--out", f"{folder.absolute().parent}_with_follow_up"]
    others = enumeration([code(str(one.absolute())) for one in before])
    also = f"It reads {others} too, which has to stay where it is.\n\n" if others else ""
    return f"""## The command that takes it

    {shlex.join(command)}

{also}On the page the same is done under *Diagnose*, *Follow-up*: there the tables can be filled in, too.
"""


def _lines(items: list[str]) -> str:
    return "\n".join(items)


def _setting(scene: Scene, path: str, new: float | str) -> str:
    old, label = value(scene, path), parameter_label(path)
    if path == "insertion.protocol":
        return f"{label}: **{PROTOCOLS[str(new)]}** (so far {PROTOCOLS[str(old)]})"
    # A laboratory sets this speed by the height from which bodies fall.
    fall = (
        f", as after a free fall of {millimetres(float(new) ** 2 / (2.0 * 9.81))}"
        if path == "insertion.drop_speed"
        else ""
    )
    return f"{label}: **{parameter_value(path, new)}**{fall} (so far {parameter_value(path, old)})"
