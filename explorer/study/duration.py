"""What a study will take, before it is started: runs, time (from stored pours of its kind), and memory."""

from __future__ import annotations

import math
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np

from doe.stages import planned_runs
from doe.store import RIG, Store, StoreError
from doe.studies.profile import Profile
from doe.studies.study import Study, with_profile
from explorer.scene.pour_cost import SPHERE_GB, WORKER_GB, pour_time, spheres_of, time_text
from solver import available_cores, parameters, value

FEWEST = 3
"""Stored pours needed to state a mean time."""


def duration_text(study: Study, profile: Profile, store: Path, workers: int | None = None) -> str:
    """E.g. "83 runs of coarse shapes, about 6 min on 2 cores (8.3 s a pour, mean of 90 stored ones), 0.5 GB".

    Parameters
    ----------
    study, profile
        What is asked for.
    store
        File of the store; it need not exist.
    workers
        Number of simultaneous pours; None: one per core.

    Returns
    -------
    One line. Stored runs cost nothing, so the time is an upper bound if there are any. Replacements of runs without a
    pile are not included.
    """
    workers = workers or available_cores()
    counts = runs_of_scenes(study, profile)
    runs = sum(counts.values())
    least = "" if profile.resolution_deg is None else "at least "  # the pilot may ask for more
    memory = f"{workers * _worker_gb(study, profile):.1f} GB of memory"
    pours = f"{least}{runs} runs of {profile.spheres} shapes"
    took = {name: stored_times(study, profile, store, name) for name in counts}
    known = {name: len(times) >= FEWEST for name, times in took.items()}
    means = {
        name: float(np.mean(times)) if known[name] else reckoned_time(study, profile, name)
        for name, times in took.items()
    }
    mean = sum(counts[name] * means[name] for name in counts) / runs
    if not all(known.values()):
        told = f"{mean:.0f} s a pour, from spheres and steps, to a factor of five; none of its kind is stored yet"
        about = "roughly"
    else:
        told, about = f"{mean:.1f} s a pour, mean of {sum(map(len, took.values()))} stored ones", "about"
    if not math.isfinite(mean):
        return f"{pours}, {memory}; how long is told after the first pours: none of its kind is stored yet."
    time = time_text(runs * mean / workers)
    cores = f"{workers} core{'s' if workers > 1 else ''}"
    return f"{pours}, {least}{about} {time} on {cores} ({told}), {memory}."


def runs_of_scenes(study: Study, profile: Profile) -> dict[str, int]:
    """Planned runs in the study's own rig, under "", and in each further experiment (equally many in each)."""
    every = sum(planned_runs(study, profile).values())
    own = sum(planned_runs(replace(study, experiments={}), profile).values())
    others = {name: (every - own) // len(study.experiments) for name in study.experiments}
    return {"": own} | others


def reckoned_time(study: Study, profile: Profile, experiment: str = "") -> float:
    """Time of one pour [s]: spheres × steps / ``PACES``, from the first body's entry to the end; NaN without a feed."""
    try:
        sized = with_profile(study, profile.name)[0]
    except ValueError:  # a profile that this study cannot have, which is reported when it is started
        return math.nan
    return pour_time(sized.scene_of(experiment))


def _worker_gb(study: Study, profile: Profile) -> float:
    """Memory of one process that pours for ``study`` [GB]."""
    try:
        sized = with_profile(study, profile.name)[0]
    except ValueError:  # reported when the study is started
        return WORKER_GB
    return WORKER_GB + SPHERE_GB * max(spheres_of(sized.scene_of(name)) for name in ("", *study.experiments))


def stored_times(study: Study, profile: Profile, store: Path, experiment: str = "") -> list[float]:
    """Wall times [s] of stored pours of ``study`` with the shapes of ``profile``, with the same rig and mass."""
    if not store.is_file():
        return []
    scene = study.scene_of(experiment)
    wanted: dict[str, float | str] = {RIG: scene.rig.name, "body.spheres": profile.spheres}
    if "rig.mass" in parameters(scene):
        own = None if experiment else profile.mass
        wanted["rig.mass"] = float(value(scene, "rig.mass")) if own is None else own
    try:
        with closing(Store(store, pouring=False)) as kept:
            return kept.wall_times(study.name, wanted)
    except StoreError:
        return []  # reported where the store is used
