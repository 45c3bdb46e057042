"""What to measure next: the feasible changes of the rig, each poured with every model that is still in the race."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from doe.diagnose.confirm import Model, confirm
from doe.diagnose.next_experiment import MenuItem, Prediction, RankedExperiment, rank_experiments
from doe.diagnose.pours import ModelPours, OnPour
from doe.diagnose.screen import Screened
from doe.diagnose.verdict import Verdict
from doe.measurement.measurement import Condition
from doe.measurement.summaries import summary_names
from doe.record import Record
from doe.runner import Pours
from doe.store import Store
from solver import EFFECTS, ParameterError, Scene, parameters, value, with_values

POURS = 8
"""Per model and set-up of the menu."""
PLANNED = 6

CHANGES: dict[str, dict[str, float]] = {
    "as it is, poured again": {},
    "half the mass": {"rig.mass": 0.5},
    "twice the mass": {"rig.mass": 2.0},
    "outlet at twice the height": {"rig.outlet_height": 2.0},
    "outlet 1.3 times as wide": {"rig.outlet_diameter": 1.3},
    "fed four times as fast": {"insertion.rate": 4.0},
    "dropped four times as fast": {"insertion.drop_speed": 4.0},
}
"""Set-ups by the factors on the parameters of the first fitted condition."""


@dataclass(frozen=True)
class Suggestion(Record):
    """An experiment, and the levers of the effects that it is to tell apart."""

    experiment: RankedExperiment
    levers: tuple[str, ...]


def next_experiment(
    verdict: Verdict,
    screened: Screened,
    condition: Condition,
    paths: Sequence[str],
    store: Store,
    pours: Pours,
    on_pour: OnPour | None,
) -> tuple[Suggestion, ...]:
    """The menu, most discriminating first; empty unless the verdict is ambiguous."""
    if not verdict.kind.startswith("ambiguous"):
        return ()
    rivals = {name: rival(verdict, name) for name in verdict.names if "+" not in name}
    items = []
    width = len(summary_names(condition))
    for name, scene in feasible(condition.scene).items():
        model = ModelPours([replace(condition, name=name, scene=scene)], paths, store, pours, on_pour)
        found = {label: confirm(one, model, POURS, [width]).blocks[0] for label, one in rivals.items()}
        if min(len(block) for block in found.values()) < POURS // 2:
            continue  # a set-up that jams tells nothing
        spread = np.mean([np.cov(block, rowvar=False) for block in found.values()], axis=0)
        varies = np.diag(spread) > 0.0
        # Few pours: half of the way to the diagonal.
        pour = 0.5 * (spread + np.diag(np.diag(spread)))[np.ix_(varies, varies)]
        items.append(
            MenuItem(
                name,
                {label: Prediction(b.mean(axis=0)[varies], pour / len(b)) for label, b in found.items()},
                pour,
            )
        )
    if not items or len(rivals) < 2:
        return ()
    weights = {row.name: max(row.weight, 1e-3) for row in verdict.effects if row.name in rivals}
    levers = tuple(f"{name}: {EFFECTS[name].lever}" for name in rivals)
    return tuple(Suggestion(one, levers) for one in rank_experiments(items, weights, PLANNED))


def rival(verdict: Verdict, name: str) -> Model:
    """The model with effect ``name`` at its own best amplitudes and the parameters of the final fit."""
    row = next(row for row in verdict.effects if row.name == name)
    amplitude = tuple(a.value for a in sorted(row.amplitudes, key=lambda a: a.index))
    return Model(tuple(p.after for p in verdict.parameters), ((name, amplitude),))


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
