"""Contact moduli from squeezing and shearing a sphere between plates (``rigs/compression.py``).

E*       least squares of F on 4/3 √R δ^1.5 over the upper three quarters of the approach
G*       least-squares slope of F_t on u, divided by 8 a, at the preload where the squeezing ended
paper    Equation (1): E = (F/A)/(ΔL/T), A = π R δ the area of the contact, ΔL = 2 δ, T = 2 R
         = 4 E* √R/(3 π √δ): not a material constant, which is why it is shown over the approach
"""

from __future__ import annotations

import dataclasses
import math
from typing import cast

import numpy as np
import numpy.typing as npt

from solver.laws import HertzMindlin
from solver.params import ParameterError
from solver.rigs.compression import Compression
from solver.scenes.material import effective_shear_modulus, effective_youngs_modulus
from solver.scenes.scene import Scene
from solver.single_body.bench import Bench, BenchResult, Quantity, ball, held

Array = npt.NDArray[np.float64]

UPPER = 1
"""Index of the plate that moves."""
MOMENTS = 200
"""Largest number of readings while squeezing, and again while shearing."""
FEWEST = 20
"""Fewest readings that a modulus is fitted to."""
SETTLING = 0.02
"""Time at rest between squeezing and shearing [s]."""


def measure(scene: Scene, seed: int) -> BenchResult:
    """Squeeze and shear; E* and G* beside those of the two materials, and the paper's apparent modulus.

    Raises ParameterError for contact laws other than Hertz's: there the force does not give moduli in this way.
    """
    if scene.contact.law != HertzMindlin.name:
        raise ParameterError(f"contact.law: {scene.contact.law!r} in a {scene.rig.name}; allowed: {HertzMindlin.name}")
    body = next(body for body in scene.bodies if body.name == cast(Compression, scene.rig).body)
    specimen = ball(body)
    radius = float(specimen.clump.radii[0])
    rig = dataclasses.replace(cast(Compression, scene.rig), gap=2.0 * radius)
    bench = Bench(scene, rig, held(specimen))
    bench.batch.set_gravity(0, (0.0, 0.0, 0.0))
    bench.put(np.array([0.0, 0.0, radius]))

    approach, force = _squeeze(bench, rig)
    overlap = 0.5 * approach
    hertz = 4.0 / 3.0 * math.sqrt(radius) * overlap**1.5
    used = overlap > 0.25 * overlap[-1]
    e_star = float(force[used] @ hertz[used] / (hertz[used] @ hertz[used]))

    materials = scene.material(body.material), scene.material(rig.wall)
    friction = scene.contact_pair(body, rig.wall).static_friction
    g_star = math.nan
    if friction > 0.0:
        contact_radius = math.sqrt(radius * overlap[-1])
        # Where T = 8 G* a s, at a slip s of half the shift, is the wanted share of sliding by the declared ratio G*/E*.
        expected = e_star * effective_shear_modulus(*materials) / effective_youngs_modulus(*materials)
        shift = 2.0 * rig.shear_load * friction * force[-1] / (8.0 * expected * contact_radius)
        slip, tangential = _shear(bench, rig, shift)
        g_star = float(np.polyfit(slip, tangential, 1)[0]) / (8.0 * contact_radius)
    apparent = (force / (math.pi * radius * overlap)) / (approach / (2.0 * radius))
    return BenchResult(
        test=rig.name,
        body=f"sphere of {body.name}",
        wall=rig.wall,
        quantities=(
            Quantity("effective_youngs_modulus", "Pa", e_star, effective_youngs_modulus(*materials)),
            Quantity("effective_shear_modulus", "Pa", g_star, effective_shear_modulus(*materials)),
            Quantity("youngs_modulus_paper_equation_1", "Pa", float(apparent[-1]), materials[0].youngs_modulus),
        ),
        series=(
            ("approach_m", tuple(approach.tolist())),
            ("force_N", tuple(force.tolist())),
            ("youngs_modulus_paper_equation_1_Pa", tuple(apparent.tolist())),
        ),
        note="" if friction > 0.0 else "without friction there is no tangential force: G* cannot be measured",
    )


def _squeeze(bench: Bench, rig: Compression) -> tuple[Array, Array]:
    """Approach of the plates [m] and force on the upper one [N], at up to ``MOMENTS`` moments."""
    duration = rig.strain * rig.gap / rig.speed
    number = _moments(bench, rig, duration)
    bench.batch.set_motion(0, UPPER, (0.0, 0.0, -rig.speed), (0.0, 0.0, 0.0))
    approach, force = np.zeros(number), np.zeros(number)
    for k in range(number):
        bench.run(duration / number)
        plate = bench.batch.surface_state(0)[UPPER]
        approach[k], force[k] = rig.gap - plate[2], plate[15]
    bench.batch.set_motion(0, UPPER, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    bench.run(SETTLING)
    return approach, force


def _shear(bench: Bench, rig: Compression, shift: float) -> tuple[Array, Array]:
    """Slip of a contact [m] (half of the plate's shift) and tangential force on the upper plate [N] against it."""
    origin = bench.batch.surface_state(0)[UPPER, 0]
    number = _moments(bench, rig, shift / rig.speed)
    bench.batch.set_motion(0, UPPER, (rig.speed, 0.0, 0.0), (0.0, 0.0, 0.0))
    slip, force = np.zeros(number), np.zeros(number)
    for k in range(number):
        bench.run(shift / rig.speed / number)
        plate = bench.batch.surface_state(0)[UPPER]
        slip[k], force[k] = 0.5 * (plate[0] - origin), -plate[13]
    return slip, force


def _moments(bench: Bench, rig: Compression, duration: float) -> int:
    """Number of readings in ``duration`` [s], each at least one time step long; raises ParameterError if too few."""
    number = min(MOMENTS, int(duration / bench.dt))
    if number < FEWEST:
        raise ParameterError(
            f"rig.speed: {rig.speed:g} m/s leaves {number} time steps of {bench.dt:.3g} s for the motion; at least "
            f"{FEWEST} are needed: a lower speed"
        )
    return number
