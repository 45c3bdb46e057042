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
from solver import Scene, available_cores, body_counts, parameters, pour_rig, value
from solver.rigs.funnel import Funnel
from solver.rigs.rig import Rig
from solver.scenes.time_step import time_step

FEWEST = 3
"""Stored pours needed to state a mean time."""
PACES: dict[type[Rig], float] = {Funnel: 80e6}
"""Spheres × time steps per second of one process, two at once on two cores: between the quick study's 48 million (90
pours of 326 spheres, 2.2 s each) and the standard one's 136 million (923 spheres, 2.9 s)."""
PACE = 20e6
"""The same in other rigs, where bodies sleep for less of the time: 4 million for steel balls behind a lip, 13 for seeds
in a funnel of triangles, 17 for wheat, 20 in a drum, 28 in a draw-down box, 91 under a lifted cylinder."""
SETTLING = 1.1
"""Simulated time [s] from the last body's entry to rest; mean of the same pours."""
WORKER_GB = 0.25
"""Resident memory of a pouring process with a study's few hundred bodies [GB]: 0.22 to 0.23 for the shipped ones."""
SPHERE_GB = 3.3e-6
"""Further memory for each member sphere [GB]: a funnel of 162 358 spheres takes 0.79 GB, one of 160 takes 0.25."""
LONG = 600.0
"""Time of a pour [s] above which the command line announces it beforehand."""


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
    time = _time_text(runs * mean / workers)
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


def pour_time(scene: Scene) -> float:
    """Time of one pour of ``scene`` [s], estimated as in :func:`reckoned_time`."""
    if "insertion.rate" not in parameters(scene):
        return math.nan
    counts = body_counts(scene)
    if "rig.mass" in parameters(scene):
        mass = float(value(scene, "rig.mass"))
    else:
        mass = sum(n * body.mass for n, body in zip(counts, scene.bodies, strict=True))
    simulated = mass / float(value(scene, "insertion.rate")) + SETTLING + (pour_rig(scene).running_time or 0.0)
    simulated = min(simulated, float(value(scene, "numerics.max_time")))
    pace = next((known for rig, known in PACES.items() if isinstance(scene.rig, rig)), PACE)
    return spheres_of(scene) * simulated / time_step(scene) / pace


def spheres_of(scene: Scene) -> int:
    """Member spheres of all bodies that are poured."""
    return sum(n * len(body.clump.radii) for n, body in zip(body_counts(scene), scene.bodies, strict=True))


def large_pour_text(scene: Scene) -> str:
    """What one pour of ``scene`` takes, if that is more than ``LONG``; otherwise "". Estimated before it begins."""
    seconds = pour_time(scene)
    if not seconds > LONG:
        return ""
    spheres = spheres_of(scene)
    return (
        f"{sum(body_counts(scene))} bodies of {spheres} spheres: roughly {_time_text(seconds)} a pour on one core "
        f"(from spheres and steps, to a factor of five), {WORKER_GB + spheres * SPHERE_GB:.1f} GB of memory"
    )


def _time_text(seconds: float) -> str:
    if seconds >= 5400.0:
        return f"{seconds / 3600.0:.1f} h"
    return f"{seconds / 60.0:.0f} min" if seconds >= 90.0 else f"{seconds:.0f} s"


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
