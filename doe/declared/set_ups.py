"""Alternatives to the fitted set-up: changes of a rig that a laboratory can make in minutes."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace

from doe.measurement.condition_table import turned as turned_scene
from doe.measurement.measurement import Condition
from doe.record import Record
from solver import ParameterError, Scene, parameters, pour_rig, value, with_values


@dataclass(frozen=True)
class Change(Record):
    """A change of the first fitted condition that a laboratory can make in minutes.

    ``factors`` multiply parameters, ``choices`` replace settings.
    """

    name: str
    factors: Mapping[str, float] = field(default_factory=dict)
    choices: Mapping[str, str] = field(default_factory=dict)

    def named(self, turned: bool) -> str:
        """Its name, for the rig ``turned`` by 180° on its bench or not."""
        if not turned:
            return self.name
        return f"{self.name}, {TURNED}" if self.factors or self.choices else TURNED


TURNED = "rig turned by 180° on its bench"
"""Added to any change while an effect with a direction is still in question: it costs no pours, because all else is the
same in a turned rig, and it distinguishes what stays with the bench from what turns with the rig."""
CHANGES = (
    Change("as it is, poured again"),
    Change("half the mass", {"rig.mass": 0.5}),
    Change("half as much mass again", {"rig.mass": 1.5}),
    Change("fed four times as fast", {"insertion.rate": 4.0}),
    Change("fed at 0.4 times the rate", {"insertion.rate": 0.4}),
    Change("dropped four times as fast", {"insertion.drop_speed": 4.0}),
    Change("filled with the outlet closed, then opened", choices={"insertion.protocol": "fill_then_open"}),
)
"""Changes of any rig, except of what it ``forgets``; each rig adds its own (``PourRig.quick_changes``)."""


def changed(condition: Condition, name: str, values: Mapping[str, float | str], about: bool) -> Condition:
    """``condition`` under another name, with ``values`` set and, if ``about``, with its rig turned on the bench."""
    scene = turned_scene(condition.scene) if about else condition.scene
    return replace(condition, name=name, scene=with_values(scene, dict(values)), turned=condition.turned != about)


def feasible(scene: Scene, calibrated: Collection[str] = ()) -> list[tuple[Change, dict[str, float | str]]]:
    """The changes that the rig of ``scene`` allows, each with the values [SI] that it sets.

    Changes of ``calibrated`` parameters are left out, because every pour sets those itself.
    """
    found = []
    known = set(parameters(scene)) - set(calibrated) - set(pour_rig(scene).forgets)
    for change in (*CHANGES, *(Change(*own) for own in pour_rig(scene).quick_changes.items())):
        if "insertion.protocol" in change.choices and scene.numerics.duration > 0.0:
            continue  # filled first, the rig would be read before it has run out
        if not set(change.factors) | set(change.choices) <= known:
            continue
        values: dict[str, float | str] = {path: f * float(value(scene, path)) for path, f in change.factors.items()}
        values |= change.choices
        if values and all(value(scene, path) == new for path, new in values.items()):
            continue  # changes nothing
        with suppress(ParameterError):  # beyond what the rig allows
            values |= _read_later(scene, with_values(scene, dict(values)))
            with_values(scene, dict(values))
            found.append((change, values))
    return found


def _read_later(before: Scene, after: Scene) -> dict[str, float | str]:
    """A later reading of the pile, if it is read at a stated time and its feed takes longer than before: as long after
    the last body."""
    paths = ("rig.mass", "insertion.rate")
    if before.numerics.duration <= 0.0 or not set(paths) <= set(parameters(before)):
        return {}
    now, then = ([float(value(scene, path)) for path in paths] for scene in (after, before))
    longer = now[0] / now[1] - then[0] / then[1]
    if longer <= 1e-9:
        return {}
    return {"numerics.duration": before.numerics.duration + longer}
