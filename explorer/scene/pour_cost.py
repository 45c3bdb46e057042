"""What one pour of a scene takes, before it is started: time and memory, estimated from its spheres and steps."""

from __future__ import annotations

import math

from solver import Scene, body_counts, parameters, pour_rig, value
from solver.rigs.funnel import Funnel
from solver.rigs.rig import Rig
from solver.scenes.time_step import time_step

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


def pour_time(scene: Scene) -> float:
    """Time of one pour of ``scene`` [s]: spheres × steps / ``PACES``, after a first body enters; NaN without a feed."""
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
        f"{sum(body_counts(scene))} bodies of {spheres} spheres: roughly {time_text(seconds)} a pour on one core "
        f"(from spheres and steps, to a factor of five), {WORKER_GB + spheres * SPHERE_GB:.1f} GB of memory"
    )


def time_text(seconds: float) -> str:
    """``seconds`` in the unit that suits them."""
    if seconds >= 5400.0:
        return f"{seconds / 3600.0:.1f} h"
    return f"{seconds / 60.0:.0f} min" if seconds >= 90.0 else f"{seconds:.0f} s"
