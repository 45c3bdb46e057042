"""A ``[[condition]]`` → the scene that repeats it.

name, role, rig, data              role: fit (calibrated against) or holdout (only predicted)
images                             photographs of its piles (`photographs`)
mean_of                            every value of the table is the mean of so many pours (1 where it is not stated)
material                           another declared base model than the data set's, with the same pairs in [parameters]
turned                             true: the rig stood turned by 180° on its bench, and so did all that is read off it
[condition.rig_parameters]         last parts of the rig's parameter paths
[condition.insertion]              protocol, rate, region_radius, region_z, velocity, batch_interval, duration;
                                   region = "cylinder", orientation = "random": the only ones there are
[condition.domain]                 half_width
[condition.scan]                   what the files of its scans do not say (`scans`)

The feed of a rig begins at its opening, so region_z must begin there. ``duration`` is the time from the first body to
the reading; the run is read then, at rest or not. ``batch_interval`` becomes the interval at which a run decides. A
batch holds what the interval after it feeds, the first one at time 0. The shipped pours show it: t10 of the fast one of
trefoil_1 is 177.5 ± 1.8 ms, simulated so 177.6 ± 1.2 ms, and 197.5 ms with batches of what was due before.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from doe.errors import MeasurementError
from doe.measurement.measurement import MeasuredParameter
from doe.studies.study_table import Table, number, one_of, only, section
from solver import (
    EFFECTS,
    Scene,
    canonical,
    parameters,
    parse_quantity,
    pour_rig,
    value,
    with_rig,
    with_settings,
    with_values,
)

KEYS = (
    "name",
    "role",
    "rig",
    "data",
    "rig_parameters",
    "insertion",
    "domain",
    "duration",
    "images",
    "mean_of",
    "scan",
    "turned",
    "material",
)
INSERTION = (
    "protocol",
    "rate",
    "region",
    "region_radius",
    "region_z",
    "batch_interval",
    "velocity",
    "orientation",
    "duration",
)
AS_THEY_ARE = ("protocol", "rate", "region_radius")
"""Keys of ``[condition.insertion]`` with the names of ours."""
FEED_SLACK = 1e-4
"""By how much [m] region_z may begin beside the feed opening."""


def in_rig(base: Scene, name: str) -> Scene:
    """``base`` in the rig ``name``, with that rig's defaults; not checked as a whole."""
    scene = base if name == base.rig.name else with_rig(base, name)
    pour_rig(scene)
    return scene


def condition_scene(base: Scene, entry: Table, measured: Sequence[MeasuredParameter]) -> Scene:
    """The scene of a condition: ``base`` with its rig and insertion, and what was ``measured`` within its range."""
    bare = in_rig(base, str(entry["rig"]))
    settings = {f"rig.{key}": value for key, value in section(entry, "rig_parameters").items()}
    if half_width := section(entry, "domain"):
        only(half_width, ("half_width",), "domain")
        settings["rig.domain_half_width"] = half_width["half_width"]
    own = {canonical(bare, path) for path in settings}
    known = parameters(bare)
    for parameter in measured:
        if parameter.path in own:
            raise MeasurementError(
                f"rig_parameters.{parameter.path.removeprefix('rig.')}: stands in [parameters] too; allowed: in one"
            )
        if parameter.path in known:
            settings[parameter.path] = _start(parameter, float(value(bare, parameter.path)))
    insertion = section(entry, "insertion")
    scene = with_settings(bare, settings | _insertion(insertion) | _duration(entry, insertion, bare))
    _check_feed(scene, insertion)
    return turned(scene) if is_turned(entry) else scene


def is_turned(entry: Table) -> bool:
    """Whether the rig of a condition stood turned by 180° on its bench."""
    given = entry.get("turned", False)
    if not isinstance(given, bool):
        raise MeasurementError(f"turned: {given!r}; allowed: true or false")
    return given


def turned(scene: Scene) -> Scene:
    """``scene`` with its rig turned by 180° on the bench: what stays with the bench acts the other way in its frame."""
    paths = [f"effect.{name}.{one}" for name, kind in EFFECTS.items() if kind.on_bench for one in kind.amplitudes]
    found = {path: float(value(scene, path)) for path in paths}
    return with_values(scene, {path: -amplitude for path, amplitude in found.items() if amplitude != 0.0})


def _start(parameter: MeasuredParameter, declared: float) -> float:
    """The mean; without one the declared value, or the middle of the range where that is outside."""
    if parameter.mean is not None:
        return parameter.mean
    inside = parameter.low <= declared <= parameter.high
    return declared if inside else 0.5 * (parameter.low + parameter.high)


def _insertion(table: Table) -> dict[str, Any]:
    only(table, INSERTION, "insertion")
    one_of(table.get("region", "cylinder"), "insertion.region", ("cylinder",))
    one_of(table.get("orientation", "random"), "insertion.orientation", ("random",))
    settings = {f"insertion.{key}": table[key] for key in AS_THEY_ARE if key in table}
    if "region_z" in table:
        low, high = _numbers(table["region_z"], "insertion.region_z", 2)
        settings["insertion.region_height"] = high - low
    if "velocity" in table:
        x, y, z = _numbers(table["velocity"], "insertion.velocity", 3)
        if (x, y) != (0.0, 0.0) or z > 0.0:
            raise MeasurementError(f"insertion.velocity: {table['velocity']}; allowed: straight down, [0, 0, −v]")
        settings["insertion.drop_speed"] = -z
    if "batch_interval" in table:
        settings["numerics.sample_interval"] = settings["insertion.lead"] = table["batch_interval"]
    return settings


def _duration(entry: Table, insertion: Table, scene: Scene) -> dict[str, Any]:
    """``duration`` stands with the insertion or in the condition itself; a run may take at least as long."""
    stated = [table["duration"] for table in (entry, insertion) if "duration" in table]
    if len(stated) > 1:
        raise MeasurementError("duration: stands in the condition and in its insertion; allowed: once")
    if not stated:
        return {}
    duration = parse_quantity(stated[0], "s", "duration")
    if duration <= 0.0:
        raise MeasurementError(f"duration: {duration:g} s; allowed: more than 0 s")
    most = max(float(value(scene, "numerics.max_time")), duration)
    return {"numerics.duration": duration, "numerics.max_time": most}


def _check_feed(scene: Scene, insertion: Table) -> None:
    if "region_z" not in insertion:
        return
    floor, low = pour_rig(scene).feed().floor, float(insertion["region_z"][0])
    if abs(low - floor) > FEED_SLACK:
        raise MeasurementError(
            f"insertion.region_z: begins at {low:g} m; allowed: {floor:g} m, the feed opening of the {scene.rig.name}"
        )


def _numbers(given: Any, where: str, n: int) -> tuple[float, ...]:
    if not isinstance(given, list) or len(given) != n:
        raise MeasurementError(f"{where}: {given!r}; allowed: a list of {n} numbers")
    return tuple(number(one, where) for one in given)
