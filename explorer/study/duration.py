"""What a study takes before it is started: its runs, time by what stored pours of its kind took, and memory."""

from __future__ import annotations

import math
import os
from contextlib import closing
from pathlib import Path

import numpy as np

from doe.stages import planned_runs
from doe.store import Store, StoreError
from doe.studies.profile import Profile
from doe.studies.study import Study, with_profile
from solver import body_counts, parameters, value
from solver.scenes.time_step import time_step

FEWEST = 3
"""Stored pours from which a time is told."""
PACE = 80e6
"""Spheres × time steps per second of one process, two at once on two cores: between the quick study's 48 million (90
pours of 326 spheres, 2.2 s each) and the standard one's 136 million (923 spheres, 2.9 s). Good to a factor of two."""
SETTLING = 1.1
"""Simulated time [s] from the last body's entry to rest; mean of the same pours."""
WORKER_GB = 0.25
"""Resident memory of a process that pours, with a study's few hundred bodies [GB]: 0.22 to 0.23 of the shipped ones."""


def duration_text(study: Study, profile: Profile, store: Path, workers: int | None = None) -> str:
    """E.g. "83 runs of coarse shapes, about 6 min on 2 cores (8.3 s a pour, mean of 90 stored ones), 0.5 GB".

    Parameters
    ----------
    study, profile
        What is asked for.
    store
        File of the store; it need not be there.
    workers
        Pours at once; None: one on every core.

    Returns
    -------
    One line. Runs that are stored already cost nothing, so it is an upper bound where they are; replacements of runs
    without a pile come on top.
    """
    workers = workers or os.cpu_count() or 1
    runs = sum(planned_runs(study, profile).values())
    least = "" if profile.resolution_deg is None else "at least "  # the pilot may ask for more
    memory = f"{workers * WORKER_GB:.1f} GB of memory"
    pours = f"{least}{runs} runs of {profile.spheres} shapes"
    took = stored_times(study, profile, store)
    if len(took) < FEWEST:
        mean = reckoned_time(study, profile)
        told = f"{mean:.0f} s a pour, from spheres and steps, to a factor of two; none of its kind is stored yet"
        about = "roughly"
    else:
        mean = float(np.mean(took))
        told, about = f"{mean:.1f} s a pour, mean of {len(took)} stored ones", "about"
    if not math.isfinite(mean):
        return f"{pours}, {memory}; how long is told after the first pours: none of its kind is stored yet."
    minutes = runs * mean / workers / 60.0
    time = f"{minutes:.0f} min" if minutes >= 1.5 else f"{60.0 * minutes:.0f} s"
    cores = f"{workers} core{'s' if workers > 1 else ''}"
    return f"{pours}, {least}{about} {time} on {cores} ({told}), {memory}."


def reckoned_time(study: Study, profile: Profile) -> float:
    """Time of one pour [s]: spheres × steps / ``PACE``, from the first body's entry to rest; NaN without a feed."""
    try:
        scene = with_profile(study, profile.name)[0].scene
    except ValueError:  # a profile that this study cannot have, which is told where it is started
        return math.nan
    if not {"rig.mass", "insertion.rate"} <= set(parameters(scene)):
        return math.nan
    spheres = sum(n * len(body.clump.radii) for n, body in zip(body_counts(scene), scene.bodies, strict=True))
    simulated = float(value(scene, "rig.mass")) / float(value(scene, "insertion.rate")) + SETTLING
    return spheres * simulated / time_step(scene) / PACE


def stored_times(study: Study, profile: Profile, store: Path) -> list[float]:
    """Wall times [s] of the stored pours of ``study`` with the shapes and the mass of ``profile``."""
    if not store.is_file():
        return []
    try:
        with closing(Store(store, pouring=False)) as kept:
            return kept.wall_times(study.name, {"body.spheres": profile.spheres, "rig.mass": profile.mass})
    except StoreError:
        return []  # told where it is used
