"""What is simulated, in order: the base model, how far each effect may go, all effects, leads, wider ranges.

An effect's amplitude is scaled before it is screened: its range ends where, with the parameters in the middle, it
shifts the summaries by ``WANTED`` standard errors of a data set of ``REPLICATES`` pours, or at the end of what the
literature supports if that comes first. Measured values come in only in
the choice of leads and of ranges to be widened; all the pours belong to the declared model.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from doe.diagnose.runs import Declared, Effect, Runs
from doe.diagnose.simulation.plan import Point, base_points, effect_points, middle_points, scaling_points
from doe.diagnose.simulation.pours import ModelPours, Pour, as_runs

FloatArray = npt.NDArray[np.float64]
Say = Callable[[str], None]

REPLICATES = 6
WANTED = 16.0
"""Shift [standard errors] at the end of a range: beyond the 10 at which an effect has to be told for certain."""
TOO_LITTLE, TOO_FAR = 12.0, 24.0
"""Shifts [standard errors] that will do; less only where the literature's bounds allow no more."""
LEAST_STEP = 0.05
"""A range shrinks by no more than this factor at once: the answer to a strong effect may saturate."""
ROUNDS = 6
UNSEEN = 3.0
"""Shift [standard errors] by the whole range below which an effect is not simulated further: the race would not admit
it (`Limits.reach`)."""
SECOND_LOOK = 8
"""Pours by which that is decided."""


@dataclass(frozen=True)
class Budget:
    """Numbers of points; each is poured once in every condition."""

    base: int = 48
    middle: int = 16
    scaling: int = 2
    screening: int = 10
    """Per effect with one amplitude; half as many again with two."""
    leads: int = 10
    """More of each lead, over its whole range."""
    widened: int = 12
    """Of an effect over a wider range than the first."""

    def scaled(self, runs: int, effects: int, conditions: int) -> Budget:
        """The same shares in about ``runs`` pours."""
        total = conditions * (
            self.base + self.middle + effects * (1.5 * self.scaling + self.screening) + 4 * self.leads
        )
        share = runs / total
        return Budget(
            base=max(24, round(share * self.base)),
            middle=max(10, round(share * self.middle)),
            scaling=max(2, round(share * self.scaling)),
            screening=max(8, round(share * self.screening)),
            leads=max(8, round(share * self.leads)),
            widened=max(8, round(share * self.widened)),
        )


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
    effects = []
    for effect in declared.effects:
        found, shift = scaled_range(declared, effect, model, budget.scaling, centre)
        if shift < UNSEEN and found.high == effect.high:
            found, shift = looked_twice(declared, effect, model, centre)
        seen = "" if found.unseen is None else "; too little to be told from noise"
        say(
            f"{effect.name}: up to {found.high[0]:.3g}, which shifts the summaries by {shift:.1f} standard errors{seen}"
        )
        effects.append(found)
    declared = replace(declared, effects=tuple(effects))
    asked = [
        point
        for stream, effect in enumerate(effects)
        if effect.unseen is None
        for point in effect_points(declared.parameters, effect, stream, screening_number(effect, budget.screening))
    ]
    found_pours = model.run("screening", asked)
    say(f"screening: {len(asked)} settings of {sum(effect.unseen is None for effect in effects)} effects")
    return Screened(declared, (*points, *asked), tuple(map(tuple, (*pours, *found_pours))))


def continued(screened: Screened, names: Sequence[str], model: ModelPours, budget: Budget, say: Say) -> Screened:
    """More settings of the effects ``names`` over their whole range, on in their sequences."""
    asked: list[Point] = []
    for stream, effect in enumerate(screened.declared.effects):
        if effect.name in names:
            first = screening_number(effect, budget.screening)
            number = first + screening_number(effect, budget.leads)
            asked += effect_points(screened.declared.parameters, effect, stream, number, first)
    pours = model.run("leads", asked)
    say(f"leads: {len(asked)} more settings of {', '.join(names)}")
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


def looked_twice(
    declared: Declared, effect: Effect, model: ModelPours, centre: Sequence[Sequence[Pour]]
) -> tuple[Effect, float]:
    """``effect`` by ``SECOND_LOOK`` pours at its whole range, named unseen where they shift too little, and the shift.

    Two pours may hide five standard errors; so many do not hide much more than the three that could be told at all.
    """
    pours = model.run(f"range of {effect.name}", scaling_points(declared.parameters, effect, SECOND_LOOK))
    shift = whitened_shift(declared, centre, pours)
    return (replace(effect, unseen=shift) if shift < UNSEEN else effect), shift


def scaled_range(
    declared: Declared, effect: Effect, model: ModelPours, number: int, centre: Sequence[Sequence[Pour]]
) -> tuple[Effect, float]:
    """``effect`` with its bounds drawn in to where the summaries shift by about ``WANTED``, and the shift [σ].

    From the whole range inward; back out, halfway on a logarithmic scale, where a step inward went too far.
    """
    found, share, inside, beyond = (effect, 0.0), 1.0, 0.0, math.inf
    for _ in range(ROUNDS):
        trial = _drawn_in(effect, share)
        points = scaling_points(declared.parameters, trial, number)
        shift = whitened_shift(declared, centre, model.run(f"range of {effect.name}", points))
        if shift > TOO_FAR:
            beyond = share
            share = max(share * max(LEAST_STEP, WANTED / shift), math.sqrt(inside * beyond))
            if inside == 0.0:
                found = _drawn_in(effect, share), shift
            continue
        inside, found = share, (trial, shift)
        if shift >= TOO_LITTLE or math.isinf(beyond):
            break
        share = math.sqrt(inside * beyond)
    return found


def _drawn_in(effect: Effect, share: float) -> Effect:
    low, high = (tuple(share * bound for bound in bounds) for bounds in (effect.low, effect.high))
    return replace(effect, low=low, high=high)


def whitened_shift(declared: Declared, centre: Sequence[Sequence[Pour]], moved: Sequence[Sequence[Pour]]) -> float:
    """Distance of the means of two sets of pours in standard errors of ``REPLICATES`` pours, all conditions together.

    The covariance is that of ``centre``, shrunk halfway to its diagonal (they are few). Pours that broke off are left
    out; infinite if a condition has none left.
    """
    square = 0.0
    for c in range(len(declared.conditions)):
        still = _valid(centre, c)
        there = _valid(moved, c)
        if len(there) == 0:
            return float("inf")
        spread = still.std(axis=0, ddof=1)
        varies = spread > 0.0
        covariance = np.cov(still[:, varies], rowvar=False)
        covariance = 0.5 * (np.atleast_2d(covariance) + np.diag(spread[varies] ** 2))
        step = (there.mean(axis=0) - still.mean(axis=0))[varies]
        # What noise alone adds to the square, on average.
        noise = REPLICATES * varies.sum() * (1.0 / len(there) + 1.0 / len(still))
        square += max(0.0, REPLICATES * float(step @ np.linalg.solve(covariance, step)) - noise)
    return float(np.sqrt(square))


def screening_number(effect: Effect, points: int) -> int:
    """Points of an effect where one with a single amplitude gets ``points``."""
    return points * (1 + effect.amplitudes) // 2


def _valid(pours: Sequence[Sequence[Pour]], condition: int) -> FloatArray:
    rows = [row[condition].summaries for row in pours if row[condition].valid]
    complete = [row for row in rows if np.isfinite(row).all()]
    return np.array(complete) if complete else np.empty((0, 0))
