"""Restitution from the drop on a plate at 45° (``rigs/drop_plate_45.py``).

    tracked rebound   e = (v_x + v_z)/√(2gH), v_z upward, the flight traced back to the middle of the contact
    paper             e = L/(2H), L the horizontal distance flown until H below the place of the impact:
                      L = v_x (v_z + √(v_z² + 2gH))/g

A sphere that grips the plate leaves with 5/7 of its tangential speed, v_x = (e + 5/7)/2 · √(2gH) and
v_z = (e − 5/7)/2 · √(2gH), so that the paper's estimate gives 0.546 for e = 0.50; a smooth one gives 0.586.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import cast

import numpy as np
import numpy.typing as npt

from solver.rigs.drop_plate_45 import DropPlate45
from solver.scenes.body import Body
from solver.scenes.insertion import random_quaternion, rotation_matrix
from solver.scenes.material import Pair
from solver.scenes.scene import Scene
from solver.single_body.bench import UPRIGHT, Bench, BenchResult, Quantity, ball

Array = npt.NDArray[np.float64]

NORMAL = np.array([1.0, 0.0, 1.0]) / math.sqrt(2.0)
BEFORE_IMPACT = 1e-3
"""Time before the impact [s] from which the body is watched closely."""
GIVEN_UP = 1.0
"""Time after the impact [s] after which a body that is not clear of the plate, whichever way it turns, is given up."""
MOMENT_STEPS = 5
RESTITUTIONS = (0.2, 0.35, 0.5, 0.65, 0.8)
FRICTIONS = (0.0, 0.1, 0.3, 0.6)
"""Values for which the bias of the paper's estimate is shown."""


@dataclass(frozen=True)
class PlateRebound:
    """Velocity of the centre of mass after the impact [m/s]; NaN for a body that stays on the plate."""

    v_x: float
    v_z: float


def measure(scene: Scene, seed: int) -> BenchResult:
    """Drop the specimen; the restitution from its rebound beside that of the pair, and the paper's estimate."""
    rig = cast(DropPlate45, scene.rig)
    body = next(body for body in scene.bodies if body.name == rig.body)
    pair, gravity, height = scene.contact_pair(body, rig.wall), math.hypot(*scene.gravity), rig.drop_height
    if rig.specimen == "sphere":
        rebounds = [drop(scene, ball(body), UPRIGHT)]
    else:
        rng = np.random.default_rng(seed)
        rebounds = [drop(scene, body, random_quaternion(rng)) for _ in range(round(rig.drops))]
    tracked = np.array([restitution(one, gravity, height) for one in rebounds])
    paper = np.array([paper_estimate(one, gravity, height) for one in rebounds])
    return BenchResult(
        test=rig.name,
        body=body.name if rig.specimen == "body" else f"sphere of {body.name}",
        wall=rig.wall,
        quantities=(
            _quantity("restitution", tracked, pair.restitution),
            _quantity("restitution_paper_L_over_2H", paper, pair.restitution),
        ),
        series=(
            ("v_x_m_s", tuple(one.v_x for one in rebounds)),
            ("v_z_m_s", tuple(one.v_z for one in rebounds)),
            ("restitution", tuple(tracked.tolist())),
        ),
        table=paper_bias(scene),
        note=""
        if rig.specimen == "sphere"
        else "a body that hits off centre also turns: every drop gives another number",
    )


def restitution(rebound: PlateRebound, gravity: float, height: float) -> float:
    """e = (v_x + v_z)/√(2gH)."""
    return (rebound.v_x + rebound.v_z) / math.sqrt(2.0 * gravity * height)


def paper_estimate(rebound: PlateRebound, gravity: float, height: float) -> float:
    """L/(2H), L = v_x (v_z + √(v_z² + 2gH))/g."""
    flight = (rebound.v_z + math.sqrt(rebound.v_z**2 + 2.0 * gravity * height)) / gravity
    return rebound.v_x * flight / (2.0 * height)


def paper_bias(scene: Scene) -> tuple[tuple[str, tuple[float, ...]], ...]:
    """Both estimates for a sphere over ``RESTITUTIONS`` × ``FRICTIONS``."""
    rig = cast(DropPlate45, scene.rig)
    body = next(body for body in scene.bodies if body.name == rig.body)
    gravity, rows = math.hypot(*scene.gravity), []
    for friction in FRICTIONS:
        for e in RESTITUTIONS:
            changed = _with_pair(scene, body, Pair(body.name, rig.wall, friction, e))
            rebound = drop(changed, ball(body), UPRIGHT)
            tracked = restitution(rebound, gravity, rig.drop_height)
            rows.append((friction, e, tracked, paper_estimate(rebound, gravity, rig.drop_height)))
    names = ("static_friction", "restitution", "tracked", "paper_L_over_2H")
    return tuple((name, tuple(row[k] for row in rows)) for k, name in enumerate(names))


def drop(scene: Scene, specimen: Body, quaternion: Array) -> PlateRebound:
    """Let ``specimen`` fall on the plate so that it first touches after falling ``drop_height``."""
    rig = cast(DropPlate45, scene.rig)
    bench = Bench(scene, rig, specimen)
    gravity = math.hypot(*scene.gravity)
    clump = specimen.clump
    centres = clump.centres @ rotation_matrix(quaternion).T
    # Along the vertical through the centre of mass, the sphere with the smallest gap touches the plate first.
    touching = -float((centres @ NORMAL - clump.radii).min()) / NORMAL[2]
    bench.put(np.array([0.0, 0.0, touching + rig.drop_height]), quaternion)
    fall = math.sqrt(2.0 * rig.drop_height / gravity)
    bench.run(max(bench.dt, fall - BEFORE_IMPACT))
    moment = MOMENT_STEPS * bench.dt
    contact, flight = 0.0, math.inf
    for _ in range(math.ceil(GIVEN_UP / moment)):
        if bench.run(moment)["touching"] > 0:
            contact, flight = (contact if flight == 0.0 else 0.0) + moment, 0.0
        else:
            flight += moment
        state = bench.state()
        if flight < math.inf and float(state[0:3] @ NORMAL) > clump.bounding_radius:
            v = state[7:10]
            # Gravity acts during the contact, too: it is treated as an impact in the middle of the contact.
            return PlateRebound(float(v[0]), float(v[2]) + gravity * (flight + 0.5 * contact))
    return PlateRebound(math.nan, math.nan)


def _with_pair(scene: Scene, body: Body, pair: Pair) -> Scene:
    """``scene`` in which ``pair`` applies to the contact of ``body`` with the wall."""
    old = scene.contact_pair(body, pair.b)
    new = dataclasses.replace(pair, a=old.a, b=old.b)
    return dataclasses.replace(scene, pairs=tuple(new if one is old else one for one in scene.pairs))


def _quantity(name: str, values: Array, reference: float) -> Quantity:
    found = values[np.isfinite(values)]
    spread = float(found.std(ddof=1)) if found.size > 1 else None
    return Quantity(name, "1", float(found.mean()) if found.size else math.nan, reference, spread)
