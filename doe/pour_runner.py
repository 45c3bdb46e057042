"""From parameter settings to finished runs: seeds, replicates, replacement of failed runs, resuming from the store."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, Protocol

import numpy as np

from doe.run_records import Run, Setting
from doe.store import READINGS, RIG, Reader, Store, StoredRun, StoreError, observables_of, read_off
from doe.studies.study import TRIES
from solver import PHYSICS, Job, Scene, observable_names, packed, parameters, pour_key, run_queue, value, with_values
from solver import Record as PourRecord


class PourObserver(Protocol):
    """An observer that records pours as they are run (not those found in the store)."""

    def sample(self, stage: str, seed: int, pour: Any) -> None:
        """Called whenever a running pour is sampled."""
        ...

    def finish(self, stage: str, seed: int, record: PourRecord) -> None:
        """Called when a pour has ended."""
        ...


OnRun = Callable[[str, Run, int], None]
"""Called with (stage, run, number of replicates of this stage still outstanding)."""


def seed_of(study_seed: int, stage: str, row: int, replicate: int, attempt: int, experiment: str = "") -> int:
    """Return a distinct seed for every run: independent streams from one root (NumPy's SeedSequence)."""
    entropy = [study_seed, *stage.encode(), row, replicate, attempt, *experiment.encode()]
    return int(np.random.SeedSequence(entropy).generate_state(1)[0])


Pours = Callable[[deque[Job], Sequence[Scene]], Iterable[tuple[Job, PourRecord]]]
"""Runs the jobs of a queue, which may grow meanwhile, with room for the scenes given."""


def stored_run(
    job: Job, record: PourRecord, study: str, stage: str, label: str, reader: Reader, key: str, variant: str = ""
) -> StoredRun:
    """Return a finished job as the store keeps it, with the readings of ``reader``.

    ``key`` is the key of the pour at the time of the request, ``variant`` the variant it was made with (`pour_key`).
    Raises StoreError if the key has changed since, because a mesh file was changed meanwhile.
    """
    if pour_key(job.scene, job.seed, variant) != key:
        raise StoreError(f"{stage}, {label}: a mesh file changed during the pour; start again")
    raw = packed(record)
    return StoredRun(
        key=key,
        study=study,
        stage=stage,
        label=label,
        seed=job.seed,
        physics=PHYSICS,
        outcome=str(record.outcome),
        message=record.message,
        parameters={RIG: job.scene.rig.name} | {path: value(job.scene, path) for path in parameters(job.scene)},
        readings=READINGS,
        observables=read_off(raw, reader),
        dt=record.dt,
        steps=record.steps,
        wall_s=record.wall_s,
        raw=raw,
    )


class PourRunner:
    """Runs settings as pours and keeps every run in the store.

    ``tries``: number of seeds tried for one replicate. ``seeds``: one seed per replicate, with no replacement of failed
    runs; if None, every run has its own seed (:func:`seed_of`). ``experiments``: the scenes of the study's further
    experiments by name. Pours run in this process, where ``observer`` can watch them, or by ``pours``
    (``solver.Executor.run_queue``); ``watched`` wraps either of them to follow how pours end.
    """

    def __init__(
        self,
        scene: Scene,
        store: Store,
        study: str,
        study_seed: int,
        threads: int | None = None,
        on_run: OnRun | None = None,
        observer: PourObserver | None = None,
        pours: Pours | None = None,
        tries: int = TRIES,
        seeds: Sequence[int] | None = None,
        experiments: Mapping[str, Scene] | None = None,
        watched: Callable[[Pours], Pours] = lambda pours: pours,
    ) -> None:
        self._scenes = {"": scene, **(experiments or {})}
        self._store, self._study, self._seed = store, study, study_seed
        self._threads, self._on_run, self._observer = threads, on_run, observer
        self._pours, self._seeds, self._watched = pours, seeds, watched
        self._tries = tries if seeds is None else 1

    def run(self, stage: str, settings: Sequence[Setting]) -> list[list[Run]]:
        """See :class:`Runner`. Runs found in the store are taken from there."""
        found: list[list[Run]] = [[] for _ in settings]
        for row, run in self.each(stage, settings):
            found[row].append(run)
        return [sorted(runs, key=self._order) for runs in found]

    def each(self, stage: str, settings: Sequence[Setting]) -> Iterator[tuple[int, Run]]:
        """Yield (index of the setting, run) as each run ends, so that the caller need not keep them all."""
        scenes = {
            (row, name): with_values(self._scenes[name], setting.values)
            for row, setting in enumerate(settings)
            for name in setting.experiments
        }
        ended: deque[tuple[int, Run]] = deque()
        places: list[tuple[int, str, int, int, str]] = []
        queue: deque[Job] = deque()
        waiting = [sum(setting.replicates * len(setting.experiments) for setting in settings)]

        def settle(run: Run, row: int) -> None:
            ended.append((row, run))
            again = not run.valid and run.attempt + 1 < self._tries
            waiting[0] -= 0 if again else 1
            if self._on_run is not None:
                self._on_run(stage, run, waiting[0])
            if again:
                request(row, run.experiment, run.replicate, run.attempt + 1)

        def request(row: int, experiment: str, replicate: int, attempt: int) -> None:
            scene = scenes[row, experiment]
            seed = (
                seed_of(self._seed, stage, row, replicate, attempt, experiment)
                if self._seeds is None
                else self._seeds[replicate]
            )
            key = pour_key(scene, seed)
            stored = self._store.find(key)
            if stored is not None:
                stored = self._store.read(stored, observable_names(scene), observables_of)
                settle(_run(stored, settings[row], experiment, replicate, attempt, reused=True), row)
            else:
                places.append((row, experiment, replicate, attempt, key))
                queue.append(Job(scene, seed, tag=len(places) - 1))

        # The whole design once, then again, so that a partial analysis is possible long before the last run.
        for replicate in range(max((setting.replicates for setting in settings), default=0)):
            for row, setting in enumerate(settings):
                if replicate < setting.replicates:
                    for experiment in setting.experiments:
                        request(row, experiment, replicate, 0)

        def sample(job: Job, pour: Any) -> None:
            if self._observer is not None:
                self._observer.sample(stage, job.seed, pour)

        def here(jobs: deque[Job], room: Sequence[Scene]) -> Iterable[tuple[Job, PourRecord]]:
            return run_queue(jobs, room, self._threads, on_sample=sample)

        while ended:
            yield ended.popleft()
        if queue:
            for job, record in self._watched(self._pours or here)(queue, list(scenes.values())):
                row, experiment, replicate, attempt, key = places[job.tag]
                if self._observer is not None:
                    self._observer.finish(stage, job.seed, record)
                label = settings[row].label + (f", {experiment}" if experiment else "")
                stored = stored_run(job, record, self._study, stage, label, observables_of, key)
                self._store.add(stored)
                settle(_run(stored, settings[row], experiment, replicate, attempt), row)
                while ended:
                    yield ended.popleft()

    def _order(self, run: Run) -> tuple[int, int, int]:
        return list(self._scenes).index(run.experiment), run.replicate, run.attempt


def _run(
    stored: StoredRun, setting: Setting, experiment: str, replicate: int, attempt: int, reused: bool = False
) -> Run:
    observables = stored.observables
    if experiment:
        observables = {f"{experiment}/{name}": value for name, value in observables.items()}
    return Run(
        label=setting.label,
        replicate=replicate,
        attempt=attempt,
        seed=stored.seed,
        outcome=stored.outcome,
        message=stored.message,
        observables=observables,
        wall_s=stored.wall_s,
        key=stored.key,
        reused=reused,
        experiment=experiment,
    )
