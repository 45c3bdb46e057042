"""Closer looks: the models that the answer hangs on are poured where they were fitted, and judged again.

The emulator of the whole box finds where each model fits best; there, its error no longer has to be argued about. A
model whose fit then moves away from its pours is poured again.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from doe.diagnose.decision.verdict import FittedModel, Verdict
from doe.diagnose.emulation.fresh_pours import FreshPours
from doe.diagnose.follow_up.confirm import fitted
from doe.diagnose.runs import Declared
from doe.diagnose.simulation.plan import Point
from doe.diagnose.simulation.pours import ModelPours

LOOKS = 3
MODELS = 4
"""At most so many are poured per look: the best of the race,"""
WITHIN = 12.0
"""as far as their criterion is no farther behind the best."""
CLOSE = 0.2
"""Distance of a fit from its pours, as a share of the box, within which they hold it."""
POURS = 12
"""Per model and condition: with twice the pours of a usual data set, what they add to its error is half of that."""


def to_be_poured(verdict: Verdict, declared: Declared, fresh: Sequence[FreshPours]) -> tuple[FittedModel, ...]:
    """Models near the best of the race whose fit no pours of their own hold; none where nothing is missing."""
    if verdict.kind == "no_missing_effect":
        return ()
    raced = [model for model in verdict.models if model.members]
    near = [model for model in raced if model.criterion - raced[0].criterion <= WITHIN][:MODELS]
    return tuple(model for model in near if not any(_holds(one, model, declared) for one in fresh))


def _holds(fresh: FreshPours, model: FittedModel, declared: Declared) -> bool:
    if fresh.members != model.members:
        return False
    effects = [declared.effects[e] for e in model.members]
    amplitudes = [(np.array(e.high) - np.array(e.low)) / e.scale for e in effects]
    width = np.concatenate([np.full(len(declared.parameters), 2.0), *amplitudes])
    return bool(np.linalg.norm((fresh.x - model.coded) / width) <= CLOSE)


def points_of(verdict: Verdict, model: FittedModel) -> list[Point]:
    """The settings of a model's fresh pours."""
    at = fitted(verdict, model.label)
    return [Point("fit", number, at.theta, at.effects) for number in range(POURS)]


def poured(verdict: Verdict, models: Sequence[FittedModel], pours: ModelPours) -> tuple[FreshPours, ...]:
    """Fresh pours of ``models`` in every condition of ``pours``; those that broke off are left out."""
    asked = {model.label: points_of(verdict, model) for model in models}
    pours.run("best fits", [point for points in asked.values() for point in points])
    found = []
    for model in models:
        rows = pours.run("best fits", asked[model.label])
        width = [len(pour.summaries) for pour in rows[0]]
        blocks = tuple(
            np.array(
                [r[c].summaries for r in rows if r[c].valid and np.isfinite(r[c].summaries).all()], dtype=np.float64
            ).reshape(-1, d)
            for c, d in enumerate(width)
        )
        found.append(FreshPours(model.members, model.coded, blocks))
    return tuple(found)
