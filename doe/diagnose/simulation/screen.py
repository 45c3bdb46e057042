"""What is simulated, in order: the base model, how far each effect may go, all effects, those that stay in question.

Measured values come in only in the choice of these and of ranges to be widened; all the pours belong to the declared
model.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from doe.diagnose.runs import BASE, Declared, Effect, Runs
from doe.diagnose.simulation.budget import Budget
from doe.diagnose.simulation.plan import Point, base_points, effect_points, middle_points, scaling_points, sequence
from doe.diagnose.simulation.pours import ModelPours, Pour, Rows, Search
from doe.diagnose.simulation.ranges import range_of

Say = Callable[[str], None]


@dataclass(frozen=True)
class Screened:
    """Declared model with the ranges found, and all runs so far."""

    declared: Declared
    points: tuple[Point, ...]
    pours: tuple[tuple[Pour, ...], ...]

    @property
    def runs(self) -> Runs:
        """As arrays."""
        return as_runs(self.declared, self.points, self.pours)


def screen(declared: Declared, model: ModelPours, budget: Budget, say: Say) -> Screened:
    """Base model, ranges of the effects, and every effect over its range."""
    points = base_points(declared.parameters, budget.base) + middle_points(declared.parameters, budget.middle)
    pours = model.run("base model", points)
    say(f"base model: {len(points)} settings")
    centre = [row for point, row in zip(points, pours, strict=True) if point.sequence == "middle"]
    searches = [looked_at(declared, effect, stream, budget, centre) for stream, effect in enumerate(declared.effects)]
    widest = [
        point for stream, effect in enumerate(declared.effects) for point in settings(declared, effect, stream, budget)
    ]
    found = model.answered("screening", searches, widest=widest)
    for look in found:
        seen = "" if look.effect.unseen is None else "; too little to be told from noise"
        end = f"{look.effect.name}: up to {look.effect.high[0]:.3g}"
        say(f"{end}, which shifts the summaries by {look.shift:.1f} standard errors{seen}")
    asked = [point for look in found for point in look.points]
    say(f"screening: {len(asked)} settings of {sum(look.effect.unseen is None for look in found)} effects")
    return Screened(
        replace(declared, effects=tuple(look.effect for look in found)),
        (*points, *asked),
        tuple(map(tuple, (*pours, *(row for look in found for row in look.pours)))),
    )


@dataclass(frozen=True)
class FirstLook:
    """An effect over its range, the shift [σ] at its end, and its settings with their pours; none of one unseen."""

    effect: Effect
    shift: float
    points: tuple[Point, ...] = ()
    pours: tuple[Sequence[Pour], ...] = ()


def looked_at(declared: Declared, effect: Effect, stream: int, budget: Budget, centre: Rows) -> Search[FirstLook]:
    """The range of one effect, and its first settings over it."""
    effect, shift = yield from range_of(declared, effect, budget.scaling, centre)
    if effect.unseen is not None:
        return FirstLook(effect, shift)
    points = settings(declared, effect, stream, budget)
    pours = yield points
    return FirstLook(effect, shift, points, tuple(pours))


def settings(declared: Declared, effect: Effect, stream: int, budget: Budget) -> tuple[Point, ...]:
    """The first settings of one effect: at the end of its range, as its search has poured them, and all over it."""
    return (
        *scaling_points(declared.parameters, effect, budget.scaling),
        *effect_points(declared.parameters, effect, stream, screening_number(effect, budget.screening)),
    )


def continued(
    screened: Screened, what: str, names: Sequence[str], number: int, model: ModelPours, say: Say
) -> Screened:
    """``number`` more settings of each of the effects ``names`` over their whole range, on in their sequences."""
    asked: list[Point] = []
    for stream, effect in enumerate(screened.declared.effects):
        if effect.name in names:
            there = sum(point.sequence == sequence(effect) for point in screened.points)
            more = screening_number(effect, number)
            asked += effect_points(screened.declared.parameters, effect, stream, there + more, there)
    pours = model.run(what, asked)
    say(f"{what}: {len(asked)} more settings of {', '.join(names)}")
    return Screened(screened.declared, (*screened.points, *asked), (*screened.pours, *map(tuple, pours)))


def over_wider_ranges(
    screened: Screened, names: Sequence[str], widest: Declared, model: ModelPours, budget: Budget, say: Say
) -> Screened:
    """The ranges of the effects ``names`` twice as wide, up to those of ``widest``; their runs so far still count."""
    effects, asked = list(screened.declared.effects), []
    for e, limit in enumerate(widest.effects):
        if effects[e].name in names:
            effects[e] = replace(
                effects[e],
                low=tuple(max(2.0 * low, end) for low, end in zip(effects[e].low, limit.low, strict=True)),
                high=tuple(min(2.0 * high, end) for high, end in zip(effects[e].high, limit.high, strict=True)),
            )
            number = screening_number(effects[e], budget.widened)
            asked += effect_points(screened.declared.parameters, effects[e], e, number)
    pours = model.run("wider range", asked)
    say(f"wider range: {len(asked)} more settings of {', '.join(names)}")
    declared = replace(screened.declared, effects=tuple(effects))
    return Screened(declared, (*screened.points, *asked), (*screened.pours, *map(tuple, pours)))


def screening_number(effect: Effect, points: int) -> int:
    """Points of an effect where one with a single amplitude gets ``points``."""
    return points * (1 + effect.amplitudes) // 2


def as_runs(declared: Declared, points: Sequence[Point], pours: Sequence[Sequence[Pour]]) -> Runs:
    """Points with at most one effect and their pours as arrays; a pour that broke off counts as not simulated."""
    names = [effect.name for effect in declared.effects]
    effect = np.full(len(points), BASE, dtype=np.int64)
    amplitude = np.zeros((len(points), 2))
    for k, point in enumerate(points):
        for name, values in point.effects:
            effect[k] = names.index(name)
            amplitude[k, : len(values)] = values
    blocks = []
    for c, condition in enumerate(declared.conditions):
        block = np.full((len(points), len(condition.summaries)), np.nan)
        for k, row in enumerate(pours):
            if row[c].valid:
                block[k] = row[c].summaries
        blocks.append(block)
    return Runs(np.array([p.theta for p in points]), effect, amplitude, tuple(blocks))
