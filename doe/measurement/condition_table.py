"""A ``[[condition]]`` of ``measurement.toml`` (:class:`ConditionTable`) → the scene that repeats it.

The feed of a rig begins at its opening, so region_z must begin there. ``duration`` is the time from the first body to
the reading; the run is read then, at rest or not. ``batch_interval`` becomes the interval at which a run is sampled and
makes its decisions. Each batch holds what is to be fed in the interval that follows it; the first batch is fed at
time 0. The shipped pours confirm this: the measured t10 of the fast pour of trefoil_1 is 177.5 ± 1.8 ms; simulated in
this way it is 177.6 ± 1.2 ms, but 197.5 ms if each batch holds what was due in the interval before it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, StrictBool

from doe.errors import MeasurementError
from doe.measurement.measurement import MeasuredParameter, Role
from doe.measurement.photographs import PhotographTable
from doe.measurement.scans import ScanSettings
from solver import (
    EFFECTS,
    Quantity,
    RigTable,
    Scalar,
    Scene,
    TomlTable,
    Vector,
    Whole,
    canonical,
    parameters,
    pour_rig,
    value,
    with_rig,
    with_settings,
    with_values,
)  # fmt: skip

AS_THEY_ARE = ("protocol", "rate", "region_radius")
"""Keys of ``[condition.insertion]`` that have the same names as our parameters."""
FEED_SLACK = 1e-4
"""Largest distance [m] between the start of region_z and the feed opening."""


class FeedTable(TomlTable):
    """``[condition.insertion]``: how the bodies were fed."""

    protocol: Annotated[str, Scalar()] | None = None
    rate: Annotated[float | str, Scalar()] | None = None
    region: Literal["cylinder"] = "cylinder"
    region_radius: Annotated[float | str, Scalar()] | None = None
    region_z: Annotated[tuple[float, float], Vector(2, "m")] | None = None
    """From … to; must begin at the rig's feed opening."""
    batch_interval: Annotated[float | str, Scalar()] | None = None
    """Time between two batches; also the interval at which a run is sampled."""
    velocity: Annotated[tuple[float, float, float], Vector(3, "m/s")] | None = None
    """Straight down: [0, 0, −v]."""
    orientation: Literal["random"] = "random"
    duration: Annotated[float, Quantity("s", above=0.0)] | None = None
    """Time from the first body to the reading; here or in the condition."""


class DomainTable(TomlTable):
    """``[condition.domain]``: the plate."""

    half_width: Annotated[float | str, Scalar()]


def _image(given: object) -> object:
    if not isinstance(given, str | dict):
        raise ValueError(f"{given!r}; allowed: a file name or a table")
    return {"file": given} if isinstance(given, str) else given


class ConditionTable(TomlTable):
    """A ``[[condition]]``: the set-up in which piles were poured, and the files of what was measured."""

    name: str
    role: Role
    """Calibrated against (fit), or only predicted (holdout)."""
    rig: str
    data: str
    """The table of its measurements."""
    material: str | None = None
    """Another declared base model than the data set's, with the same pairs in [parameters]."""
    rig_parameters: RigTable = Field(default_factory=dict)
    insertion: FeedTable = FeedTable()
    domain: DomainTable | None = None
    duration: Annotated[float, Quantity("s", above=0.0)] | None = None
    """Time from the first body to the reading; the run is read then, at rest or not."""
    images: list[Annotated[PhotographTable, BeforeValidator(_image, json_schema_input_type=str | PhotographTable)]] = (
        Field(default_factory=list)
    )
    """Photographs of its piles, by file name or as tables."""
    mean_of: Annotated[int, Whole(1)] = 1
    """Number of pours that every value in the table is the mean of."""
    scan: ScanSettings = ScanSettings()
    turned: StrictBool = False
    """The rig stood turned by 180° on its bench, and so do all readings."""


def in_rig(base: Scene, name: str) -> Scene:
    """Return ``base`` in the rig ``name`` with that rig's defaults; the scene as a whole is not checked."""
    scene = base if name == base.rig.name else with_rig(base, name)
    pour_rig(scene)
    return scene


def condition_scene(base: Scene, entry: ConditionTable, measured: Sequence[MeasuredParameter]) -> Scene:
    """Return the scene of a condition: ``base`` in its rig, with its insertion and the ``measured`` parameters.

    A parameter without a measured mean keeps its declared value if that lies within its range (:func:`_start`).
    """
    bare = in_rig(base, entry.rig)
    settings: dict[str, Any] = {f"rig.{key}": value for key, value in entry.rig_parameters.items()}
    if entry.domain is not None:
        settings["rig.domain_half_width"] = entry.domain.half_width
    own = {canonical(bare, path) for path in settings}
    known = parameters(bare)
    for parameter in measured:
        if parameter.path in own:
            raise MeasurementError(
                f"rig_parameters.{parameter.path.removeprefix('rig.')}: is in [parameters] too; allowed: in one of them"
            )
        if parameter.path in known:
            settings[parameter.path] = _start(parameter, float(value(bare, parameter.path)))
    scene = with_settings(bare, settings | _insertion(entry.insertion) | _duration(entry, bare))
    _check_feed(scene, entry.insertion)
    return turned(scene) if entry.turned else scene


def turned(scene: Scene) -> Scene:
    """Return ``scene`` with its rig turned by 180° on the bench: effects fixed to the bench act in reverse on the rig.

    Their amplitudes change sign, because positions are given in the rig's own frame.
    """
    paths = [f"effect.{name}.{one}" for name, kind in EFFECTS.items() if kind.on_bench for one in kind.amplitudes]
    found = {path: float(value(scene, path)) for path in paths}
    return with_values(scene, {path: -amplitude for path, amplitude in found.items() if amplitude != 0.0})


def _start(parameter: MeasuredParameter, declared: float) -> float:
    """Return the mean; without one, the declared value, or the middle of the range if that value lies outside it."""
    if parameter.mean is not None:
        return parameter.mean
    inside = parameter.low <= declared <= parameter.high
    return declared if inside else 0.5 * (parameter.low + parameter.high)


def _insertion(table: FeedTable) -> dict[str, Any]:
    settings = {f"insertion.{key}": given for key in AS_THEY_ARE if (given := getattr(table, key)) is not None}
    if table.region_z is not None:
        settings["insertion.region_height"] = table.region_z[1] - table.region_z[0]
    if table.velocity is not None:
        x, y, z = table.velocity
        if (x, y) != (0.0, 0.0) or z > 0.0:
            raise MeasurementError(f"insertion.velocity: {[x, y, z]}; allowed: straight down, [0, 0, −v]")
        settings["insertion.drop_speed"] = -z
    if table.batch_interval is not None:
        settings["numerics.sample_interval"] = settings["insertion.lead"] = table.batch_interval
    return settings


def _duration(entry: ConditionTable, scene: Scene) -> dict[str, Any]:
    """Settings for ``duration``, given in the insertion or in the condition; max_time is raised to it if needed."""
    stated = [duration for duration in (entry.duration, entry.insertion.duration) if duration is not None]
    if len(stated) > 1:
        raise MeasurementError("duration: given in the condition and in its insertion; allowed: in one of the two")
    if not stated:
        return {}
    most = max(float(value(scene, "numerics.max_time")), stated[0])
    return {"numerics.duration": stated[0], "numerics.max_time": most}


def _check_feed(scene: Scene, insertion: FeedTable) -> None:
    if insertion.region_z is None:
        return
    floor, low = pour_rig(scene).feed().floor, insertion.region_z[0]
    if abs(low - floor) > FEED_SLACK:
        raise MeasurementError(
            f"insertion.region_z: begins at {low:g} m; allowed: {floor:g} m, the height of the feed opening of the "
            f"{scene.rig.name}"
        )
