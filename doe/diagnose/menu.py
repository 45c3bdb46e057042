"""What to measure next: the feasible changes of the rig, each poured with every model that is still in the race."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace

import numpy as np

from doe.diagnose.confirm import Model, confirm
from doe.diagnose.next_experiment import MenuItem, Prediction, RankedExperiment, rank_experiments
from doe.diagnose.pours import ModelPours, OnPour
from doe.measurement.measurement import Condition
from doe.measurement.summaries import summary_names
from doe.record import Record
from doe.runner import Pours
from doe.store import Store
from solver import EFFECTS, ParameterError, Scene, parameters, value, with_values

POURS = 4
"""Per model and set-up of the menu."""
PLANNED = 6
"""Pours that are asked of the laboratory."""


@dataclass(frozen=True)
class Change(Record):
    """A change of the first fitted condition that a laboratory can make in minutes.

    ``factors`` multiply its parameters, ``choices`` replace settings.
    """

    name: str
    factors: Mapping[str, float] = field(default_factory=dict)
    choices: Mapping[str, str] = field(default_factory=dict)


CHANGES = (
    Change("as it is, poured again"),
    Change("half the mass", {"rig.mass": 0.5}),
    Change("half as much mass again", {"rig.mass": 1.5}),
    Change("outlet at 0.6 times the height", {"rig.outlet_height": 0.6}),
    Change("outlet at 1.5 times the height", {"rig.outlet_height": 1.5}),
    Change("outlet at twice the height", {"rig.outlet_height": 2.0}),
    Change("outlet 1.3 times as wide", {"rig.outlet_diameter": 1.3}),
    Change("fed four times as fast", {"insertion.rate": 4.0}),
    Change("fed at 0.4 times the rate", {"insertion.rate": 0.4}),
    Change("dropped four times as fast", {"insertion.drop_speed": 4.0}),
    Change("filled with the outlet closed, then opened", choices={"insertion.protocol": "fill_then_open"}),
    Change("outlet 1.3 times as wide at twice the height", {"rig.outlet_diameter": 1.3, "rig.outlet_height": 2.0}),
)


@dataclass(frozen=True)
class Suggestion(Record):
    """An experiment.

    Attributes
    ----------
    experiment
        What it tells, and with which chance.
    values
        Parameter path → value [SI] of what is set otherwise than in the condition ``condition``.
    condition
        Name of the fitted condition that it changes.
    rivals
        Labels of what it is to tell apart, "base" for nothing missing.
    levers
        By their nature: what reveals each of the rivals' effects.
    pours
        That it asks for.
    """

    experiment: RankedExperiment
    values: Mapping[str, float | str]
    condition: str
    rivals: tuple[str, ...]
    levers: tuple[str, ...]
    pours: int = PLANNED


@dataclass(frozen=True)
class Menu:
    """Set-ups in order, and how many pours had to be run for them."""

    suggestions: tuple[Suggestion, ...]
    run_now: int


def next_experiment(
    rivals: Mapping[str, Model],
    weights: Mapping[str, float],
    condition: Condition,
    paths: Sequence[str],
    store: Store,
    pours: Pours,
    on_pour: OnPour | None,
) -> Menu:
    """The menu for telling ``rivals`` of probabilities ``weights`` apart, the most discriminating first.

    Empty with fewer than two of them.
    """
    if len(rivals) < 2:
        return Menu((), 0)
    set_ups = [
        replace(condition, name=change.name, scene=with_values(condition.scene, dict(values)))
        for change, values in feasible(condition.scene)
    ]
    # All set-ups at once, so that no core waits for the last pour of one of them.
    model, widths = ModelPours(set_ups, paths, store, pours, on_pour), [len(summary_names(one)) for one in set_ups]
    poured = confirm(tuple(rivals.values()), model, POURS, widths)
    blocks = {label: one.blocks for label, one in zip(rivals, poured, strict=True)}
    items = []
    for k, set_up in enumerate(set_ups):
        found = {label: block[k] for label, block in blocks.items()}
        if min(len(block) for block in found.values()) < POURS // 2:
            continue  # a set-up that jams tells nothing
        spread = np.mean([np.atleast_2d(np.cov(block, rowvar=False)) for block in found.values()], axis=0)
        varies = np.diag(spread) > 0.0
        # Few pours: half of the way to the diagonal.
        pour = 0.5 * (spread + np.diag(np.diag(spread)))[np.ix_(varies, varies)]
        items.append(
            MenuItem(
                set_up.name,
                {label: Prediction(b.mean(axis=0)[varies], pour / len(b)) for label, b in found.items()},
                pour,
            )
        )
    if not items:
        return Menu((), model.run_now)
    asked = dict.fromkeys(name for rival in rivals.values() for name, _ in rival.effects)
    levers = tuple(f"{name}: {EFFECTS[name].lever}" for name in asked)
    changed = {change.name: values for change, values in feasible(condition.scene)}
    ranked = rank_experiments(items, weights, PLANNED)
    names = tuple(rivals)
    suggestions = [Suggestion(one, changed[one.name], condition.name, names, levers) for one in ranked]
    return Menu(tuple(suggestions), model.run_now)


def feasible(scene: Scene) -> list[tuple[Change, dict[str, float | str]]]:
    """The changes that the rig of ``scene`` can do, with the values [SI] that they come to."""
    found = []
    known = parameters(scene)
    for change in CHANGES:
        if not (set(change.factors) | set(change.choices)) <= set(known):
            continue
        values: dict[str, float | str] = {path: f * float(value(scene, path)) for path, f in change.factors.items()}
        values |= change.choices
        if values and all(value(scene, path) == new for path, new in values.items()):
            continue  # as it is already
        with suppress(ParameterError):  # beyond what the rig allows
            with_values(scene, dict(values))
            found.append((change, values))
    return found
