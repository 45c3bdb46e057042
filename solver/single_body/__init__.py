"""Bench tests: the paper's own measurements of single bodies, run on the solver with known answers.

Each test has a rig (``solver/rigs``, ``BENCH_RIGS``) with its parameters, and a file here with ``measure(scene)``. A
new test needs these two files and a line in each of the two lists.
"""

from __future__ import annotations

from collections.abc import Callable

from solver import backend
from solver.params import ParameterError
from solver.scenes.scene import Scene, actual
from solver.single_body import compression, drop_plate_45, inclined_plane
from solver.single_body.bench import BenchResult, Quantity

BENCH_TESTS: dict[str, Callable[[Scene, int], BenchResult]] = {
    "inclined_plane": inclined_plane.measure,
    "drop_plate_45": drop_plate_45.measure,
    "compression": compression.measure,
}

__all__ = ["BENCH_TESTS", "BenchResult", "Quantity", "run_bench_test"]


def run_bench_test(scene: Scene, seed: int = 1) -> BenchResult:
    """Run the bench test given by the rig of ``scene``, after the set-up effects of the scene.

    ``seed`` is for the orientations, if the test draws any.
    """
    if scene.rig.name not in BENCH_TESTS:
        raise ParameterError(f"rig.name: {scene.rig.name!r} is no bench test; known: {', '.join(BENCH_TESTS)}")
    backend.init(threads=1)
    return BENCH_TESTS[scene.rig.name](actual(scene), seed)
