"""Pours of the declared model: takes points, returns summaries per condition, and keeps every pour in the store."""

from __future__ import annotations

import contextlib
import math
from collections import deque
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from doe.declared.model import effect_values, in_rig_frame
from doe.declared.points import AS_IT_IS, Point, View
from doe.declared.pour_end import Ended, OnPour
from doe.measurement.features import feature_set, features_of_record
from doe.measurement.measurement import Condition, Observation
from doe.pour_runner import Pours, seed_of, stored_run
from doe.store import Reader, Store, StoredRun
from solver import EFFECTS, Job, Outcome, ParameterError, Record, Scene, observe_named, pour_key, unpacked, with_values

PROFILE = "height_profile_m"
ROOT = 0
"""Root of the seeds: the same for every data set of a model, so that its pours are found again in the store."""


@dataclass(frozen=True)
class PointPour:
    """Results of one pour of a point in a condition; NaN for numbers that could not be read."""

    summaries: tuple[float, ...]
    outcome: str
    profile: tuple[float, ...] = ()
    """Mean heights [m] for a plot; no decision uses them."""
    surface: tuple[float, ...] = ()
    """Features of the pile's surface (``doe/measurement/features.py``), which come after the summaries."""

    @property
    def valid(self) -> bool:
        """Whether the run came to its end."""
        return Outcome(self.outcome).valid


Rows = list[list[PointPour]]
"""Pours per point and condition."""
Result = TypeVar("Result")
Search = Generator[Sequence[Point], Rows, Result]
"""Generator that asks for pours of points, as often as it needs, and returns its result."""
Place = tuple[Point, int]
"""Point and number of a condition."""


def once(points: Sequence[Point]) -> Search[Rows]:
    """A search that asks for ``points`` once and returns their pours."""
    return (yield points)


def room_of(conditions: Sequence[Condition]) -> list[Scene]:
    """Scenes that need as much capacity as most points: every condition at the ends of each effect, where possible.

    They are the same at every stage, so that a worker compiles its batches once.
    """
    room: list[Scene] = []
    for condition in conditions:
        for name, kind in EFFECTS.items():
            for share in (-1.0, 1.0):
                ends = effect_values(name, [share * kind.strongest for _ in kind.amplitudes])
                with contextlib.suppress(ParameterError):
                    room.append(with_values(condition.scene, ends))
    return room


class ModelPours:
    """Runs points of one declared model under its conditions, each point only once."""

    def __init__(
        self,
        conditions: Sequence[Condition],
        paths: Sequence[str],
        store: Store,
        pours: Pours,
        on_pour: OnPour | None = None,
        root: int = ROOT,
        place: int | None = None,
    ) -> None:
        """``place``: index that all ``conditions`` use for their seeds, if they are possible additions to the data; by
        default each condition uses its own index.
        """
        self._conditions, self._paths, self._store = tuple(conditions), tuple(paths), store
        self._names = [(profile_names(one), feature_set(one)) for one in conditions]
        """Names of the profile and the feature set that are read off a pour, by condition."""
        self._places = [c if place is None else place for c in range(len(conditions))]
        self._pours, self._on_pour, self._root = pours, on_pour, root
        self._known: dict[Place, PointPour] = {}
        self._keys: dict[Place, str] = {}
        """Store keys of the requested pours, whatever their view."""
        self.run_now = 0
        """Number of pours that were run and not found in the store."""

    def run(self, what: str, points: Sequence[Point], where: Sequence[int] | None = None) -> Rows:
        """Pours of every point, one per condition, or one per condition in ``where``."""
        return self.answered(what, [once(points)], where)[0]

    def answered(
        self,
        what: str,
        searches: Sequence[Search[Result]],
        where: Sequence[int] | None = None,
        widest: Sequence[Point] = (),
    ) -> list[Result]:
        """The results of ``searches``. Each search continues as soon as its own pours are done.

        A single point that a search asks for on continuing goes to the front of the queue, so that a search of many
        steps does not finish last; several points at once go to the back, as no further step waits for them. They must
        fit into the capacity that the first points and the points ``widest`` need.
        """
        asked = range(len(self._conditions)) if where is None else where
        found: dict[int, Result] = {}
        open_places: dict[int, set[Place]] = {}
        points: dict[int, Sequence[Point]] = {}
        wanted: list[tuple[int, Place]] = []
        queue: deque[Job] = deque()

        def resumed(k: int) -> list[Job]:
            """Jobs that search ``k`` now waits for; none if it has ended."""
            try:
                while True:
                    rows = [[self._known[point, c] for c in asked] for point in points[k]] if k in points else None
                    points[k] = next(searches[k]) if rows is None else searches[k].send(rows)
                    places = dict.fromkeys((point, c) for point in points[k] for c in asked)
                    if missing := [place for place in places if not self._find(*place)]:
                        break
            except StopIteration as end:
                found[k] = end.value
                return []
            open_places[k] = set(missing)
            first = len(wanted)
            wanted.extend((k, place) for place in missing)
            return [Job(self.scene(*one), self.seed(*one), tag=first + n) for n, one in enumerate(missing)]

        for k in range(len(searches)):
            queue.extend(resumed(k))
        left = len(queue)
        if not queue:
            return [found[k] for k in range(len(searches))]
        room = room_of(self._conditions) + [job.scene for job in queue] + self._possible(widest, asked)
        for job, record in self._pours(queue, room):
            k, (point, c) = wanted[job.tag]
            self._known[point, c] = self._keep(what, point, c, job, record)
            self.run_now += 1
            open_places[k].discard((point, c))
            more = [] if open_places[k] else resumed(k)
            if len(more) <= len(asked):
                queue.extendleft(reversed(more))
            else:
                queue.extend(more)
            left += len(more) - 1
            if self._on_pour is not None:
                label = f"{point.sequence} {point.number}, {self._conditions[c].name}"
                ended = Ended(label, job.seed, record.outcome, record.message, wall_s=record.wall_s)
                self._on_pour(what, left, ended)
        return [found[k] for k in range(len(searches))]

    def records(self, points: Sequence[Point], condition: int) -> list[Record]:
        """Records of the pours of ``points`` that came to a valid end; the points have been asked for before."""
        stored = [self._store.find(self._key(point, condition)) for point in points]
        return [unpacked(one.raw) for one in stored if one is not None and Outcome(one.outcome).valid]

    def scene(self, point: Point, condition: int) -> Scene:
        """The scene of ``point`` in a condition."""
        turned = self._conditions[condition].turned
        values: dict[str, float | str] = {
            path: in_rig_frame(path, one, turned) for path, one in zip(self._paths, point.theta, strict=True)
        }
        for effect, amplitude in point.effects:
            values |= effect_values(effect, amplitude, turned)
        return with_values(self._conditions[condition].scene, values)

    def seed(self, point: Point, condition: int) -> int:
        """Seed of the pour of ``point`` in a condition."""
        return seed_of(self._root, point.sequence, point.number, self._places[condition], 0)

    def _possible(self, points: Sequence[Point], where: Sequence[int]) -> list[Scene]:
        """Scenes of ``points``, without those that are impossible."""
        scenes: list[Scene] = []
        for point in points:
            for c in where:
                with contextlib.suppress(ParameterError):
                    scenes.append(self.scene(point, c))
        return scenes

    def _find(self, point: Point, condition: int) -> bool:
        """Whether the pour is known, in memory or in the store."""
        place = point, condition
        if place not in self._known:
            stored = self._store.find(self._key(point, condition))
            if stored is not None:
                asked = self._conditions[condition]
                profile, features = self._names[condition]
                names = [name + point.view.label for name in (*profile, *features.names)]
                stored = self._store.read(stored, names, reader(asked, point.view))
                self._known[place] = self._pour(condition, stored, point.view)
        return place in self._known

    def _key(self, point: Point, condition: int) -> str:
        """Store key of the pour of ``point`` in a condition, whatever the view."""
        place = point.seen(AS_IT_IS), condition
        if place not in self._keys:
            self._keys[place] = pour_key(self.scene(point, condition), self.seed(point, condition))
        return self._keys[place]

    def _keep(self, what: str, point: Point, condition: int, job: Job, record: Record) -> PointPour:
        asked = self._conditions[condition]
        key, label = self._key(point, condition), f"{point.sequence} {point.number}"
        stored = stored_run(job, record, "diagnose", what, label, reader(asked, point.view), key)
        self._store.add(stored)
        return self._pour(condition, stored, point.view)

    def _pour(self, condition: int, stored: StoredRun, view: View) -> PointPour:
        """The numbers of a stored pour; NaN for those that could not be read."""
        profile, features = self._names[condition]

        def numbers(names: Sequence[str]) -> tuple[float, ...]:
            found = (stored.observables[name + view.label] for name in names)
            return tuple(math.nan if x is None else x for x in found)

        return PointPour(
            numbers(features.scalars), stored.outcome, numbers(profile), numbers(features.profile + features.surface)
        )


def measured_profile(condition: Condition) -> Observation | None:
    """The measured profiles: positions x (k,) [m], values (replicates, k) [m]; None if the data offer none."""
    return condition.offered.get(PROFILE)


def profile_names(condition: Condition) -> tuple[str, ...]:
    """Names under which the k heights of a pour are kept; none if the data offer no profile."""
    profile = measured_profile(condition)
    return () if profile is None or profile.x is None else tuple(f"{PROFILE}({x:g})" for x in profile.x)


def profile_of_record(condition: Condition, record: Record) -> tuple[float, ...]:
    """Heights (k,) [m] of a run at the measured positions; none if the data offer no profile."""
    profile = measured_profile(condition)
    if profile is None or profile.x is None:
        return ()
    return tuple(np.asarray(observe_named(record, {PROFILE: profile.x})[PROFILE]).tolist())


def reader(condition: Condition, view: View = AS_IT_IS) -> Reader:
    """The function that reads a pour of ``condition`` for a diagnosis: profile, summaries, and surface features."""

    def read(record: Record) -> dict[str, float]:
        record = view.of(record)
        heights, numbers = profile_of_record(condition, record), features_of_record(condition, record, view.sight)
        names = [name + view.label for name in (*profile_names(condition), *feature_set(condition).names)]
        return dict(zip(names, (*heights, *numbers.tolist()), strict=True))

    return read
