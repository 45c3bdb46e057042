"""The training pours: the base model, every effect at its level, and more of what stays in question.

Measured values only decide which further pours are made, and at which multiple of a level (a power of two, so that data
sets of one model ask for the same pours). All pours belong to the declared model.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
import numpy.typing as npt

from doe.declared.budget import Budget
from doe.declared.model import Declared, effect_of, possible
from doe.declared.points import (
    AS_IT_IS,
    BASE,
    Direction,
    Point,
    View,
    base_points,
    directions_of,
    effect_points,
    far_points,
)
from doe.declared.pours import ModelPours, PointPour, Search
from doe.diagnose.compared_features import Instrument, MeasuredFeatures
from doe.diagnose.emulator import Lessons, Way
from doe.diagnose.posterior import LEAST, Posterior
from doe.diagnose.result import Level
from doe.diagnose.training_amplitudes import STRONG, Trials, level_of, taught_shifts
from doe.errors import StatisticsError
from doe.measurement.measurement import Condition
from doe.measurement.sight import PERFECT, Sight
from doe.measurement.summaries import summary_names
from solver import EFFECTS, Scene, actual, pour_rig

FloatArray = npt.NDArray[np.float64]
Say = Callable[[str], None]

TRIALS = Trials(pours=1, most=5, enough=6.0, too_much=18.0)
"""One pour gives the order of a shift, and all pours of an effect show whether it is enough."""
RAISES = 3
"""How often, at most, an effect is poured farther out because its pours together shift too little."""
TOLD = 4.0
"""Shift that four pours can tell from none: a smaller one is replaced by it when the amplitude is raised to
``STRONG``."""
ENDED = 0.75
"""Fraction of pours that must come to a valid end where an effect is poured farther out."""
NEAR = (0.2, 2.5)
"""Multiples of a level between which pours of its search are used for training: a parabola describes no wider range."""
SHIFTED = 12
"""Number of the base model's pours that are viewed displaced, for a displaced funnel."""
IN_QUESTION = 0.03
"""Probability above which an effect is in question."""
FURTHER, FOLLOWED = 5.0, 3
"""Log evidence over the base model's above which an effect is followed further if its best fit is at the end of what
was poured, and largest number of these at once: data of a strong effect resemble nothing that was poured."""
LIMIT, FAR = 1.5, 2.5
"""Deviation of a parameter from its mean at the base model's best fit above which it is poured farther off, and how far
[deviations]. A nonlinear response, continued straight from one deviation, looks like an effect (root 2, set 3:
restitution at 2.8)."""
BEHIND = 4.0
"""Log evidence by which a direction may trail the best one of its effect and still be in question with it."""


@dataclass(frozen=True)
class Probe:
    """A training pour: of way ``way`` at a multiple of its level, or of the base model (−1, 0)."""

    point: Point
    way: int
    multiple: float


class TrainingPours:
    """Makes the training pours of a declared scene in the set-ups of ``conditions``.

    ``declared`` holds the first of these, or all. Amplitudes are chosen by the shifts in the conditions that it holds,
    so a condition added later does not change what was poured in the others.

    Raises StatisticsError if too few pours of the base model come to a valid end.
    """

    def __init__(
        self, declared: Declared, conditions: Sequence[Condition], pours: ModelPours, budget: Budget, say: Say
    ) -> None:
        self.declared, self._conditions = declared, tuple(conditions)
        self._pours, self._budget, self._say = pours, budget, say
        self._acting: dict[Point, tuple[int, float]] = {}
        """Way and multiple of every point that was poured."""
        self._rows: dict[Point, list[PointPour]] = {}
        self._tried: list[tuple[Direction, float, list[Point]]] = []
        self._directions = [one for effect in declared.effects for one in directions_of(effect)]
        # A calibrated direction differs between the pours of the base model.
        self._turned = all(unchanged_by_a_quarter_turn(condition.scene) for condition in conditions) and not any(
            len(EFFECTS[name].amplitudes) > 1 for p in declared.parameters if (name := effect_of(p.name))
        )
        self._heaps = all(pour_rig(condition.scene).leaves_heap for condition in conditions)
        base = base_points(declared, budget.base)
        self._keep(base, pours.run("base model", base), -1, 0.0)
        self._base = [self._rows[point] for point in base]
        valid = sum(all(pour.valid for pour in row) for row in self._base)
        if valid < max(4, len(base) // 3):
            outcomes = sorted({pour.outcome for row in self._base for pour in row if not pour.valid})
            raise StatisticsError(
                f"base model: {valid} of {len(base)} pours end in a valid pile in every condition (the others: "
                f"{', '.join(outcomes)}); the declared model does not reproduce the experiment"
            )
        say(f"base model: {len(base)} settings")
        self._levels = self._found_levels()
        self._pour("screening", [(way, 1.0, budget.screening) for way in range(len(self.ways))])
        self._tell_shifts()
        refused: dict[int, float] = {}
        for _ in range(RAISES):
            if not self._raise_levels(refused):
                break
            self._tell_shifts()
        self._keep_trials()
        for direction, level in zip(self._directions, self._levels, strict=True):
            if not direction.angle:
                reach = " ".join(f"{one:.3g}" for one in direction.at(level.share))
                say(f"{direction.name}: up to {reach}, which shifts by {level.shift:.1f} standard errors")
        say(f"screening: {len(self._rows)} settings of {len(declared.effects)} effects")

    @property
    def ways(self) -> tuple[Way, ...]:
        """Directions of effects, with their levels as reference amplitudes."""
        return tuple(
            Way(one.effect, one.name, one.at(level.share), 1.0 / level.share, one.angle)
            for one, level in zip(self._directions, self._levels, strict=True)
        )

    @property
    def calibrated(self) -> frozenset[str]:
        """Paths of the calibrated parameters."""
        return frozenset(one.name for one in self.declared.parameters)

    @property
    def settings(self) -> int:
        """Number of settings poured so far."""
        return len({point.seen(AS_IT_IS) for point in self._rows})

    @property
    def levels(self) -> tuple[Level, ...]:
        """Reference amplitudes, way by way."""
        return tuple(self._levels)

    @property
    def pours(self) -> tuple[int, ...]:
        """Number of training pours of each way."""
        ways = [way for way, _ in self._acting.values()]
        return tuple(ways.count(way) for way in range(len(self._levels)))

    def look(self, found: Posterior) -> tuple[str, ...]:
        """Pour more of what ``found`` leaves in question, near its best fits; return the effects that were poured.

        More of the base model is poured as well, because all models build on it: if it were known less well than they
        are, data without an effect would agree better with them, by the noise of its pours.
        """
        further = self.at_end(found)
        wanted = [(way, multiple, self._budget.screening) for way, multiple in further]
        wanted += [
            (way, multiple, self._taught(way, multiple) + self._budget.more)
            for way, multiple in self._in_question(found)
            if way not in dict(further)
        ]
        if wanted:
            number = sum(point.sequence == BASE for point, (way, _) in self._acting.items() if way == -1)
            points = base_points(self.declared, number + self._budget.more)
            for j, theta in enumerate(found.fits["base"].theta):
                if abs(theta) > LIMIT:
                    points += far_points(self.declared, j, math.copysign(FAR, theta), self._budget.more)
            self._pour("closer look", wanted, points)
        return tuple(dict.fromkeys(self.ways[way].effect for way, _, _ in wanted))

    def refine(self, found: Posterior, label: str) -> None:
        """Pour the effects of ``label`` on both sides of their best fits, so that these are no extrapolations."""
        wanted = []
        for way, amplitude in acting(found, label, self.ways):
            power = math.log2(amplitude)
            for one in (math.floor(power), math.ceil(power)):
                multiple = min(2.0**one, self.ways[way].most)
                wanted.append((way, multiple, max(self._taught(way, multiple), self._budget.more)))
        self._pour("refinement", wanted)

    def lessons(self) -> Lessons:
        """All pours; NaN where one broke off or a feature could not be read."""
        probes = [Probe(point, *self._acting[point]) for point in self._rows]
        return self.told(probes, list(self._rows.values()))

    def instruments(self, conditions: Sequence[MeasuredFeatures]) -> list[Instrument]:
        """Shift by each condition's scanner in the base model's pours; empty if every sight and axis is perfect."""
        if all(one.sight == PERFECT and one.axis_error == 0.0 for one in conditions):
            return []
        return [
            _instrument(self.declared, self._pours, c, one.scalars, one.axis_error, one.sight)
            for c, one in enumerate(conditions)
        ]

    def axis_in(self, pours: ModelPours, c: int, scalars: int, error: float) -> FloatArray:
        """Shift in condition ``c`` of ``pours`` if a scan's axis is ``error`` [m] off along x and along y, (2, d)."""
        return _instrument(self.declared, pours, c, scalars, error).axis

    def probes(self, found: Posterior, labels: Sequence[str], number: int) -> list[Probe]:
        """``number`` pours of each effect of ``labels``, as in training, near its best fit in ``found``."""
        wanted: dict[tuple[int, float], None] = {}
        for label in labels:
            for way, multiple in acting(found, label, self.ways):
                nearest = min(2.0 ** round(math.log2(multiple)), self.ways[way].most)
                wanted |= {(one, nearest): None for one in self._alike(way)}
        return [
            Probe(point, way, multiple)
            for way, multiple in wanted
            for point in self._points(self._directions[way], min(1.0, multiple * self._levels[way].share), number)
        ]

    def possible_in(self, scene: Scene) -> bool:
        """Whether ``scene`` can be set up with every effect at both ends of its range."""
        return all(
            possible(scene, effect.name, end) for effect in self.declared.effects for end in (effect.low, effect.high)
        )

    def base(self, number: int) -> list[Probe]:
        """``number`` pours of the base model, as in training."""
        return [Probe(point, -1, 0.0) for point in base_points(self.declared, number)]

    def told(self, probes: Sequence[Probe], rows: Sequence[Sequence[PointPour]]) -> Lessons:
        """Training data from pours of ``probes``, one per condition; NaN where one broke off or could not be read."""
        blocks, number = [], dict[Point, int]()
        for pours in zip(*rows, strict=True):
            block = np.array([(*pour.summaries, *pour.surface) for pour in pours], dtype=np.float64)
            block[[not pour.valid for pour in pours]] = np.nan
            blocks.append(block)
        return Lessons(
            np.array([self.declared.theta(probe.point.theta) for probe in probes]).reshape(len(probes), -1),
            np.array([probe.way for probe in probes], dtype=np.int64),
            np.array([probe.multiple for probe in probes], dtype=np.float64),
            np.array([number.setdefault(probe.point.seen(AS_IT_IS), len(number)) for probe in probes], dtype=np.int64),
            tuple(blocks),
        )

    def _found_levels(self) -> list[Level]:
        """Find the level of every direction; all directions in the plane share one."""
        asked = [one for one in self._directions if not one.angle]

        def tried(direction: Direction, share: float, number: int) -> list[Point]:
            points = self._points(direction, share, number)
            self._tried.append((direction, share, points))
            return points

        def search(one: Direction) -> Search[Level]:
            level = yield from level_of(self.declared, one, self._base, partial(tried, one), TRIALS)
            # Start the screening pours of this direction while others are still searched.
            yield self._points(one, level.share, self._budget.screening)
            return level

        searches = [search(one) for one in asked]
        widest = [point for one in asked for point in self._points(one, 1.0, 1)]
        first = range(len(self.declared.conditions))
        found = self._pours.answered("amplitudes", searches, first, widest)
        levels, last = [], iter(found)
        for one in self._directions:
            if not one.angle:
                level = next(last)
            levels.append(replace(level, direction=one))
        return levels

    def _tell_shifts(self) -> None:
        """Compute from all pours so far how much each level shifts the scalars."""
        first = len(self.declared.conditions)
        scalars = [np.arange(len(summary_names(condition))) for condition in self._conditions[:first]]
        lessons = self.lessons()
        shifts = taught_shifts(replace(lessons, blocks=lessons.blocks[:first]).only(scalars), self.ways)
        self._levels = [replace(one, shift=float(shift)) for one, shift in zip(self._levels, shifts, strict=True)]

    def _raise_levels(self, refused: dict[int, float]) -> bool:
        """Pour an effect farther out if it shifts the scalars too little; return whether there was any.

        ``refused``: by way, the least share at which pours broke off.
        """
        first = len(self.declared.conditions)
        asked: dict[int, tuple[float, list[Point]]] = {}
        for way, (direction, level) in enumerate(zip(self._directions, self._levels, strict=True)):
            if direction.angle or level.shift >= TRIALS.enough or level.share == 1.0:
                continue
            share = min(1.0, level.share * STRONG / max(level.shift, TOLD))
            if way in refused:
                share = min(share, math.sqrt(level.share * refused[way]))
            for one in self._alike(way):
                asked[one] = share, self._points(self._directions[one], share, self._budget.screening)
        self._pours.run("screening", list({p.seen(AS_IT_IS): None for _, points in asked.values() for p in points}))
        rows = {way: self._pours.run("screening", points) for way, (_, points) in asked.items()}
        ended = {way: np.mean([all(pour.valid for pour in row[:first]) for row in some]) for way, some in rows.items()}
        for way, (share, points) in asked.items():
            # All directions in the plane share one level.
            if any(ended[one] < ENDED for one in self._alike(way)):
                refused[way] = share
                continue
            outward = share / self._levels[way].share
            self._acting |= {p: (w, a / outward) for p, (w, a) in self._acting.items() if w == way}
            self._levels[way] = replace(self._levels[way], share=share)
            self._keep(points, rows[way], way, 1.0)
        return bool(asked)

    def _keep_trials(self) -> None:
        """Use the pours of the search for a level in training if they are not too far from it."""
        for direction, share, points in self._tried:
            way = self._directions.index(direction)
            multiple = share / self._levels[way].share
            if direction.angle is None and multiple != 1.0 and NEAR[0] <= multiple <= NEAR[1]:
                self._keep(points, self._pours.run("amplitudes", points), way, multiple)

    def _points(self, direction: Direction, share: float, number: int) -> list[Point]:
        """Pours of ``direction`` at ``share`` of its range, or views of other pours that stand in for them."""
        if direction.angle is not None and direction.effect == "funnel_offset" and self._heaps:
            dx, dy = direction.at(share)
            return [one.seen(View(shift=(dx, dy))) for one in base_points(self.declared, max(number, SHIFTED))]
        if direction.angle and self._turned:
            first = next(one for one in self._directions if one.effect == direction.effect)
            turns = View(turns=round(direction.angle / (0.5 * math.pi)))
            return [one.seen(turns) for one in effect_points(self.declared, first, share, number)]
        return effect_points(self.declared, direction, share, number)

    def _pour(self, what: str, wanted: Iterable[tuple[int, float, int]], base: Sequence[Point] = ()) -> None:
        """Pour ways at multiples of their levels, up to a number of each; an effect in the plane in all its directions.

        ``base``: points of the base model. All are run together, so that no core idles at the end of one group.
        """
        asked: list[tuple[int, float, Sequence[Point]]] = [(-1, 0.0, base)]
        for way, multiple, number in wanted:
            for w in self._alike(way):
                share = min(1.0, multiple * self._levels[w].share)
                asked.append((w, share / self._levels[w].share, self._points(self._directions[w], share, number)))
        plain = dict.fromkeys(point.seen(AS_IT_IS) for _, _, points in asked for point in points)
        self._pours.run(what, list(plain))
        for way, multiple, points in asked:
            self._keep(points, self._pours.run(what, points), way, multiple)

    def _alike(self, way: int) -> list[int]:
        """``way``, and the other directions of an effect in the plane, all of which it needs at one level."""
        own = self._directions[way]
        return [way] if own.angle is None else [k for k, one in enumerate(self._directions) if one.effect == own.effect]

    def _keep(self, points: Sequence[Point], rows: Sequence[list[PointPour]], way: int, multiple: float) -> None:
        for point, row in zip(points, rows, strict=True):
            self._rows[point], self._acting[point] = row, (way, multiple)

    def _taught(self, way: int, multiple: float) -> int:
        return sum(one == (way, multiple) for one in self._acting.values())

    def _in_question(self, found: Posterior) -> list[tuple[int, float]]:
        """Ways in question, each with a multiple at which it is poured near its best fit."""
        probability: dict[str, float] = {}
        for label, p in found.effects.items():
            for name in label.split("+"):
                probability[name] = probability.get(name, 0.0) + p
        best: dict[str, float] = {}
        for level in found.levels:
            effect = self.ways[level.way].effect
            best[effect] = max(best.get(effect, -math.inf), level.log_density)
        asked: list[tuple[int, float]] = []
        for level in found.levels:
            way = self.ways[level.way]
            if probability[way.effect] > IN_QUESTION and level.log_density > best[way.effect] - BEHIND:
                asked.append((level.way, self._beside(level.way, level.amplitude)))
        # With another effect, its best amplitude may differ from that alone.
        pairs = [label for label, p in found.effects.items() if "+" in label and p > IN_QUESTION]
        paired = [one for label in pairs for one in acting(found, label, self.ways)]
        asked += [(way, self._beside(way, amplitude)) for way, amplitude in paired]
        return list(dict.fromkeys(asked))

    def _beside(self, way: int, amplitude: float) -> float:
        """The power of two of a level nearest to ``amplitude``, or the one on its other side once the nearest has been
        poured: a model that is well known on one side only loses evidence by its uncertainty on the other.
        """
        power = math.log2(amplitude)
        sides = sorted((math.floor(power), math.ceil(power)), key=lambda one: abs(one - power))
        multiples = [min(2.0**one, self.ways[way].most) for one in sides]
        return next((one for one in multiples if self._taught(way, one) < self._budget.more), multiples[0])

    def at_end(self, found: Posterior) -> list[tuple[int, float]]:
        """Ways whose best fit is the largest amplitude that the models reach, each with a larger possible one."""
        base = found.fits["base"].log_evidence
        ends = []
        for level in sorted(found.levels, key=lambda one: -one.log_density):
            way, reached = self.ways[level.way], max(a for one, a in self._acting.values() if one == level.way)
            further = min(2.0 * reached, way.most)
            if level.log_density - base > FURTHER and level.amplitude > reached and further > 1.001 * reached:
                ends.append((level.way, further))
        return ends[:FOLLOWED]


def acting(found: Posterior, label: str, ways: Sequence[Way]) -> list[tuple[int, float]]:
    """Ways and multiples of their reference amplitudes at which the effects of ``label`` fit best; none for "base". An
    effect with a direction in the plane is given by its first way, whatever its direction.
    """
    places = []
    for name in label.split("+"):
        own = [level for level in found.levels if ways[level.way].effect == name]
        if not own:
            continue
        best = max(own, key=lambda one: one.log_density)
        way, amplitude = best.way, best.amplitude
        if "+" in label:
            # With another effect, its amplitude and sign may differ.
            values = [one.value for one in found.fits[label].amplitudes if one.effect == name]
            way = next((one.way for one in own if ways[one.way].unit[0] * values[0] > 0.0), way)
            amplitude = max(LEAST, math.hypot(*values) / math.hypot(*ways[way].unit))
        places.append((way, amplitude))
    return places


def _instrument(
    declared: Declared, pours: ModelPours, c: int, scalars: int, axis_error: float, sight: Sight = PERFECT
) -> Instrument:
    """Shift by a scanner in the base model's pours in condition ``c`` of ``pours``; none in the ``scalars``."""
    points = base_points(declared, SHIFTED)
    shifts = ((axis_error, 0.0), (0.0, axis_error))
    views = [AS_IT_IS, View(sight=sight), *(View(shift=shift) for shift in shifts)]
    seen = pours.run("scanner", [p.seen(v) for v in views for p in points], [c])
    rows = np.array([(*row.summaries, *row.surface) for (row,) in seen]).reshape(len(views), len(points), -1)
    change = rows[1:] - rows[0]
    # Scalars in the table come from other instruments.
    change[:, :, :scalars] = 0.0
    ended = np.isfinite(change).all(axis=(0, 2))
    bias, *axis = change[:, ended].mean(axis=1)
    return Instrument(bias, np.array(axis))


def unchanged_by_a_quarter_turn(scene: Scene) -> bool:
    """Whether a quarter turn leaves the declared ``scene`` as it is."""
    found = actual(scene)
    return pour_rig(found).quarter_turns and found.gravity[0] == found.gravity[1] == 0.0 and not any(found.axis)
