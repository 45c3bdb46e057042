"""A pour alone in its batch: begun with everything compiled that it will need, and let run."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np

from solver.engine.world import Batch
from solver.pours.pour import Pour
from solver.pours.run import capacity_for
from solver.scenes.scene import Scene


def begun(scene: Scene, seed: int, announce: Callable[[str], None]) -> Pour:
    """A pour of ``scene`` before its first launch but one step; ``announce`` is told what takes long."""
    announce("fitting member spheres to the shapes")
    for body in scene.bodies:
        _ = body.clump  # fitted once per process and shape; the pour below takes it from the cache
    announce("compiling the solver")
    pour = Pour(Batch(capacity_for([scene], 1)), 0, endless(scene), seed)
    _compile(pour)
    return pour


def endless(scene: Scene) -> Scene:
    """``scene`` without the limit on simulated time: in the live view the person at the screen ends a pour."""
    return dataclasses.replace(scene, numerics=dataclasses.replace(scene.numerics, max_time=math.inf))


def launch(pour: Pour, steps: int) -> bool:
    """Run ``steps``; True at a moment of decision, before which nobody asks for the world's summary."""
    launched = np.array([steps], dtype=np.int32)
    if not pour.decides_after(steps):
        pour.batch.run(launched)
        return pour.after(steps)
    return pour.after(steps, pour.batch.advance(launched)[0])


def _compile(pour: Pour) -> None:
    """Compile every kernel now, those of a change of stiffness too, so that the first slider does not stall."""
    launch(pour, pour.steps_due(1))
    kinds = pour.batch.capacity.kinds
    pour.batch.scale_springs(0, np.ones((kinds, kinds)))
    pour.batch.measure(0)
