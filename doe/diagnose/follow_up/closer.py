"""Closer looks: the models that the answer hangs on are poured where they were fitted, and judged again.

An emulator of the whole box finds where a model fits best, well or badly by the number of runs that it was made from;
pours about that point tell what the model gives there. Every effect that may explain the residual gets a few. Those
that are then near the best get more, since their errors decide, and one whose fit moves away from its pours is poured
again, as in a sequential search over response surfaces (Box and Wilson 1951, J. R. Stat. Soc. B 13:1).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from doe.diagnose.decision.gates import Limits
from doe.diagnose.decision.verdict import FittedModel, Verdict
from doe.diagnose.emulation.fresh_pours import FreshPours
from doe.diagnose.runs import Declared
from doe.diagnose.simulation.plan import Point, sobol
from doe.diagnose.simulation.pours import ModelPours

FloatArray = npt.NDArray[np.float64]

LOOKS = 6
"""Times that models are poured about their fits; each asks again which are the best of the race."""
MODELS = 4
"""At most so many are near the best: the first of the race,"""
WITHIN = Limits.held_out
"""as far as their criterion is no farther behind the best."""
CLOSE = 0.2
"""Distance of a fit from its pours, as a share of the box, within which they hold it."""
STEP, POURS = 6, 18
"""Pours per model, condition and look, and of a contender in all: three times those of a usual data set, so that what
they add to the variance of its mean is a third of that."""
SCATTER = 0.15
"""Share of the box to either side of a fit over which its pours are scattered, so that they tell slopes as well."""
STREAM = 2000
"""Seed of that sequence."""
IN_QUESTION = 0.25
"""Share of the largest drop of T^2 from which on an effect may explain the residual."""


def in_question(verdict: Verdict) -> tuple[str, ...]:
    """Effects that take up ``IN_QUESTION`` of what the best one does of the residual, best first.

    None where nothing is missing. The criterion of a fit is not asked: from five runs of an effect it may be off by
    more than what it has to tell.
    """
    drops = {row.name: row.drop for row in verdict.effects if row.status == "raced"}
    most = max(drops.values(), default=0.0)
    if verdict.kind == "no_missing_effect" or most <= 0.0:
        return ()
    return tuple(sorted((name for name in drops if drops[name] >= IN_QUESTION * most), key=lambda n: -drops[n]))


def lost(verdict: Verdict, names: Sequence[str]) -> tuple[str, ...]:
    """Those of ``names`` that these data cannot see any more: too few settings may have told too little of them.

    What the emulator does not know of an effect is taken off the shift that it can cause, so an effect that bends much
    may go out of sight when more of its settings come in.
    """
    return tuple(row.name for row in verdict.effects if row.name in names and row.status == "not identifiable here")


def near_best(race: Sequence[FittedModel], number: int) -> tuple[FittedModel, ...]:
    """The first of a race, in order of the criterion, and at most ``number`` in all that are not far behind it."""
    return tuple(model for model in race if model.criterion - race[0].criterion <= WITHIN)[:number]


def contenders(verdict: Verdict, declared: Declared, fresh: Sequence[FreshPours]) -> tuple[FittedModel, ...]:
    """Models to be poured next: effects in question that never were, else those near the best that too few pours hold.

    None where nothing is missing. Pairs come when all single effects that are near are held: a pair makes up for what a
    single one is off.
    """
    if verdict.kind == "no_missing_effect":
        return ()
    singles = [model for model in verdict.models if len(model.members) == 1]
    known, asked = {one.members for one in fresh}, in_question(verdict)
    if unheard := tuple(model for model in singles if model.label in asked and model.members not in known):
        return unheard
    for race in (singles, [model for model in verdict.models if model.members]):
        near = near_best(race, MODELS)
        loose = tuple(
            model for model in near if (there := about_fit(model, declared, fresh)) is None or len(there.theta) < POURS
        )
        if loose:
            return loose
    return ()


def about_fit(model: FittedModel, declared: Declared, fresh: Sequence[FreshPours]) -> FreshPours | None:
    """The newest of ``fresh`` that are of this model, about where it is fitted."""
    return next((one for one in reversed(fresh) if _is_about(one, model, declared)), None)


def _is_about(fresh: FreshPours, model: FittedModel, declared: Declared) -> bool:
    if fresh.members != model.members:
        return False
    step = (fresh.coded(declared).mean(axis=0) - model.coded) / np.subtract(*_box(declared, model.members)[::-1])
    return bool(np.linalg.norm(step) <= CLOSE)


def _box(declared: Declared, members: tuple[int, ...]) -> tuple[FloatArray, FloatArray]:
    """Lower and upper ends of parameters and amplitudes, (q,), coded."""
    k = len(declared.parameters)
    effects = [declared.effects[e] for e in members]
    low = np.concatenate([np.full(k, -1.0), *(np.array(e.low) / e.scale for e in effects)])
    high = np.concatenate([np.full(k, 1.0), *(np.array(e.high) / e.scale for e in effects)])
    return low, high


def about(model: FittedModel, declared: Declared, number: int, first: int = 0) -> list[Point]:
    """``number`` points about a model's fit, within the box: a Sobol sequence over ``SCATTER`` of it on either side.

    From its point ``first`` on.
    """
    low, high = _box(declared, model.members)
    reach = SCATTER * (high - low)
    ends = np.clip([model.coded - reach, model.coded + reach], low, high)
    k, points = len(declared.parameters), []
    for n, row in enumerate(np.array(sobol(list(zip(*ends.tolist(), strict=True)), first + number, STREAM))):
        theta = tuple(p.natural(float(x)) for p, x in zip(declared.parameters, row[:k], strict=True))
        effects, column = [], k
        for e in model.members:
            effect = declared.effects[e]
            coded = row[column : column + effect.amplitudes]
            effects.append((effect.name, tuple((coded * effect.scale).tolist())))
            column += effect.amplitudes
        points.append(Point(f"about {model.label}", n, theta, tuple(effects)))
    return points[first:]


def poured(
    models: Sequence[FittedModel],
    declared: Declared,
    pours: ModelPours,
    fresh: Sequence[Sequence[FreshPours]],
    number: int = STEP,
) -> tuple[FreshPours, ...]:
    """``number`` pours about the fit of each of ``models`` in every condition of ``pours``, with those there already.

    fresh: per model, what was poured before.
    """
    before = [about_fit(model, declared, known) for model, known in zip(models, fresh, strict=True)]
    starts = [0 if one is None else len(one.theta) for one in before]
    asked = [about(model, declared, number, start) for model, start in zip(models, starts, strict=True)]
    # All of them at once, so that no worker waits for the last pour of a model.
    rows = iter(pours.run("best fits", [point for points in asked for point in points]))
    found = []
    for model, points, known in zip(models, asked, before, strict=True):
        own = [next(rows) for _ in points]
        blocks = tuple(
            np.array([row[c].summaries if row[c].valid else np.full(len(row[c].summaries), np.nan) for row in own])
            for c in range(len(own[0]))
        )
        theta = np.array([point.theta for point in points])
        amplitudes = np.array([[x for _, a in point.effects for x in a] for point in points])
        new = FreshPours(model.members, theta, amplitudes, blocks)
        found.append(new if known is None else known.joined(new))
    return tuple(found)


def with_new(fresh: Sequence[FreshPours], found: Sequence[FreshPours]) -> tuple[FreshPours, ...]:
    """``fresh`` and ``found``, of which those that go on from earlier pours take their place."""
    return (*(one for one in fresh if not any(new.goes_on_from(one) for new in found)), *found)
