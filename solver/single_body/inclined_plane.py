"""Angle at which a body begins to slide (``rigs/inclined_plane.py``), or a ball to roll; and how high a ball rebounds.

A fast tilt first finds the angle roughly; a slow one that starts ``MARGIN`` below it then measures it. Sliding is
noticed late, at ``SLIDING`` speed. As the tilt grows in proportion to time, so does the acceleration: √v grows in
proportion to the time, and to the tilt, since the onset, which is where the line through two of its values meets zero.
The same holds for a rolling ball, held up to tan α = μ_r by its rolling resistance (``effects/rolling_resistance.py``).

On the level plane, a ball that falls from h1 rises to h2 = e² h1, without air.
"""

from __future__ import annotations

import math
from typing import cast

import numpy as np

from solver.rigs.inclined_plane import InclinedPlane
from solver.scenes.body import Body
from solver.scenes.scene import Scene
from solver.single_body.bench import Bench, BenchResult, Quantity, ball, held, onset_of

FAST = 20.0
"""Speed of the first tilt, and of the second until it reaches its starting angle [°/s]."""
MARGIN = 3.0
"""How far below the rough angle the slow tilt begins [°]."""
STEEPEST = 85.0
"""Tilt at which a body that still holds is given up [°]."""
SLIDING = 1e-3
"""Speed from which the body counts as sliding [m/s]."""
MOMENT = 1e-3
"""Simulated time between two changes of the tilt [s]."""
SETTLING = 0.1
"""Time to settle on the level plane [s]."""
CLOSE_BY = 1e-3
"""Time before the impact [s] from which a falling ball is watched, every ``LOOK`` steps."""
LOOK = 5
GIVEN_UP = 1.0
"""Time after the impact [s] after which a ball that has not left the plane counts as staying on it."""

Path = list[tuple[float, float, float]]
"""Tilt [°], displacement [m], speed [m/s]."""


def measure(scene: Scene, seed: int) -> BenchResult:
    """Tilt the plane under the held body; the angle of sliding beside atan μ_s of the pair."""
    rig = cast(InclinedPlane, scene.rig)
    body = next(body for body in scene.bodies if body.name == rig.body)
    angle, path = onset(scene, held(body))
    friction = scene.contact_pair(body, rig.wall).static_friction
    return BenchResult(
        test=rig.name,
        body=body.name,
        wall=rig.wall,
        quantities=(
            Quantity("sliding_angle_deg", "deg", angle, math.degrees(math.atan(friction))),
            Quantity("static_friction", "1", math.tan(math.radians(angle)), friction),
        ),
        series=(
            ("tilt_deg", tuple(tilt for tilt, _, _ in path)),
            ("displacement_m", tuple(displacement for _, displacement, _ in path)),
        ),
        note="" if math.isfinite(angle) else f"the body still holds at {STEEPEST:g} deg",
    )


def onset(scene: Scene, specimen: Body) -> tuple[float, Path]:
    """Angle [°] from which on ``specimen`` moves down the plane, NaN if it holds, and the path of the slow tilt.

    A specimen that is :func:`~solver.single_body.bench.held` slides; a ball rolls or slides.
    """
    rig = cast(InclinedPlane, scene.rig)
    rough, _ = _tilt(scene, specimen, 0.0, FAST)
    slow = min(rig.tilt_rate, FAST)
    return _tilt(scene, specimen, max(0.0, rough - MARGIN), slow) if math.isfinite(rough) else (rough, [])


def _tilt(scene: Scene, specimen: Body, start: float, rate: float) -> tuple[float, Path]:
    """Angle of the onset [°], NaN if the body holds, and the path; tilted by ``rate`` [°/s] from ``start`` on."""
    bench = Bench(scene, scene.rig, specimen)
    gravity = math.hypot(*scene.gravity)
    bench.lay()
    _set_tilt(bench, gravity, 0.0)
    bench.run(SETTLING)
    origin, tilt, path = float(bench.state()[0]), 0.0, Path()
    moment = bench.steps_of(MOMENT)
    while tilt < STEEPEST:
        tilt += (rate if tilt >= start else FAST) * moment
        _set_tilt(bench, gravity, tilt)
        bench.run(MOMENT)
        state = bench.state()
        path.append((tilt, float(state[0]) - origin, float(state[7])))
        if state[7] > SLIDING:
            return max(0.0, onset_of([(tilt, speed) for tilt, _, speed in path], SLIDING)), path
    return math.nan, path


def _set_tilt(bench: Bench, gravity: float, tilt_deg: float) -> None:
    """Turn gravity so that the plane slopes down towards +x."""
    angle = math.radians(tilt_deg)
    bench.batch.set_gravity(0, (gravity * math.sin(angle), 0.0, -gravity * math.cos(angle)))


def rebound_height(scene: Scene, body: Body, height: float) -> float:
    """Height [m] to which a ball of ``body`` rises again, its lowest point above the plane, after falling ``height``.

    NaN if it stays on the plane. Once it has left the plane it flies freely, up to z + v²/(2g).
    """
    specimen, gravity = ball(body), math.hypot(*scene.gravity)
    bench = Bench(scene, scene.rig, specimen)
    radius = float(specimen.clump.radii[0])
    bench.put(np.array([0.0, 0.0, radius + height]))
    bench.run(max(bench.dt, math.sqrt(2.0 * height / gravity) - CLOSE_BY))
    for _ in range(math.ceil((GIVEN_UP + CLOSE_BY) / (LOOK * bench.dt))):
        touching = bench.run(LOOK * bench.dt)["touching"] > 0
        state = bench.state()
        if not touching and state[9] > 0.0:
            return float(state[2] - radius + state[9] ** 2 / (2.0 * gravity))
    return math.nan
