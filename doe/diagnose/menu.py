"""What to measure next: the feasible changes of the rig, each poured with every model that is still in the race."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

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

POURS = 6
"""Per model and set-up of the menu."""
PLANNED = 6

CHANGES: dict[str, dict[str, float]] = {
    "as it is, poured again": {},
    "half the mass": {"rig.mass": 0.5},
    "outlet at twice the height": {"rig.outlet_height": 2.0},
    "outlet 1.3 times as wide": {"rig.outlet_diameter": 1.3},
    "fed four times as fast": {"insertion.rate": 4.0},
    "dropped four times as fast": {"insertion.drop_speed": 4.0},
}
"""Set-ups by the factors on the parameters of the first fitted condition.

More mass would tell what less of it tells, at four times the cost.
"""


@dataclass(frozen=True)
class Suggestion(Record):
    """An experiment, and the levers of the effects that it is to tell apart."""

    experiment: RankedExperiment
    levers: tuple[str, ...]


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
    set_ups = [replace(condition, name=name, scene=scene) for name, scene in feasible(condition.scene).items()]
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
    return Menu(tuple(Suggestion(one, levers) for one in rank_experiments(items, weights, PLANNED)), model.run_now)


def feasible(scene: Scene) -> dict[str, Scene]:
    """Set-ups of ``CHANGES`` that the rig can do."""
    found = {}
    known = parameters(scene)
    for name, factors in CHANGES.items():
        if not set(factors) <= set(known):
            continue
        try:
            found[name] = with_values(scene, {path: f * float(value(scene, path)) for path, f in factors.items()})
        except ParameterError:
            continue  # beyond what the rig allows
    return found
