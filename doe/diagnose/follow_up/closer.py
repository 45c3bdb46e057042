"""Closer looks: the models that the answer hangs on are poured where they were fitted, and judged again.

An emulator of the whole box finds where a model fits best, well or badly by the number of runs that it was made from;
pours at that point tell what the model gives there. A model whose fit then moves away from its pours is poured again,
as in a Gauss-Newton search in which the emulator only has to know the slopes.
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
LEAD_SHARE = 0.5
"""Share of the largest drop of T^2 from which on an effect counts as a lead after the screening."""
LEADS, LEAD_POURS = 8, 6


def leads(verdict: Verdict) -> tuple[FittedModel, ...]:
    """Effects that take up a good part of the residual, after a screening too thin to say how much they leave.

    The criterion of a fit is not asked yet: from ten runs of an effect it may be off by more than what it has to tell.
    """
    drops = {row.name: row.drop for row in verdict.effects if row.status == "raced"}
    most = max(drops.values(), default=0.0)
    if verdict.kind == "no_missing_effect" or most <= 0.0:
        return ()
    named = sorted((name for name in drops if drops[name] >= LEAD_SHARE * most), key=lambda name: -drops[name])
    models = {model.label: model for model in verdict.models}
    return tuple(models[name] for name in named[:LEADS])


def contenders(verdict: Verdict, declared: Declared, fresh: Sequence[FreshPours]) -> tuple[FittedModel, ...]:
    """Models near the best of the race whose fit no pours of their own hold; none where nothing is missing.

    Pairs come when all single effects that are near are held: a pair makes up for what a single one is off.
    """
    if verdict.kind == "no_missing_effect":
        return ()
    singles = [model for model in verdict.models if len(model.members) == 1]
    for race in (singles, [model for model in verdict.models if model.members]):
        near = [model for model in race if model.criterion - race[0].criterion <= WITHIN][:MODELS]
        loose = tuple(model for model in near if not any(_holds(one, model, declared) for one in fresh))
        if loose:
            return loose
    return ()


def _holds(fresh: FreshPours, model: FittedModel, declared: Declared) -> bool:
    if fresh.members != model.members or len(fresh.blocks[0]) < POURS:
        return False
    effects = [declared.effects[e] for e in model.members]
    amplitudes = [(np.array(e.high) - np.array(e.low)) / e.scale for e in effects]
    width = np.concatenate([np.full(len(declared.parameters), 2.0), *amplitudes])
    return bool(np.linalg.norm((fresh.coded(declared) - model.coded) / width) <= CLOSE)


def points_of(verdict: Verdict, model: FittedModel, number: int = POURS) -> list[Point]:
    """The settings of a model's fresh pours."""
    at = fitted(verdict, model.label)
    return [Point("fit", k, at.theta, at.effects) for k in range(number)]


def poured(
    verdict: Verdict, models: Sequence[FittedModel], pours: ModelPours, number: int = POURS
) -> tuple[FreshPours, ...]:
    """``number`` fresh pours of each of ``models`` in every condition of ``pours``."""
    asked = {model.label: points_of(verdict, model, number) for model in models}
    pours.run("best fits", [point for points in asked.values() for point in points])
    found = []
    for model in models:
        rows = pours.run("best fits", asked[model.label])
        blocks = tuple(
            np.array([row[c].summaries if row[c].valid else np.full(len(row[c].summaries), np.nan) for row in rows])
            for c in range(len(rows[0]))
        )
        amplitudes = tuple(one.value for one in model.amplitudes)
        found.append(FreshPours(model.members, model.parameters, amplitudes, blocks))
    return tuple(found)
