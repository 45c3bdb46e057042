"""The stable time step of a scene.

Limits, of which the smallest rules:

    Rayleigh    dt = f T_R,  T_R = π R √(ρ/G) / (0.1631 ν + 0.8766)   of the smallest member sphere (EDEM, LIGGGHTS)
    landing     dt = b l / (ω √(1 + d N β⁴)),  ω = √(N k/m)   of a body that lands on N member spheres at once
    tip         the same of a body that is hit at its outermost sphere: N = 1, with the mass it shows there
    slip        dt = 1.5 b √(m_eff/k)   of a body pulled sideways at its outermost point; b √(m_eff/k) of one sphere

k is the stiffness dF/dδ of the contact law at the overlap that an impact at 2 m/s makes, β = −ln e/√(π² + ln² e) of the
pair, and m_eff the mass that a body shows at r along a direction u, 1/m_eff = 1/m + (r × u)ᵀ I⁻¹ (r × u), for the
worst u. A dashpot knows its own force at the end of the step and that of the others by the last one, so of N that
act at once N − 1 are late, and many strong ones gain energy: the root keeps that off. (A dashpot at a tip damps with
the whole mass, and counts m/m_eff times.) l and d, ``landing_step`` and ``damped_landing`` of the contact law, are
fitted to landings of 1 to 38 spheres with e = 0.05 … 0.9, which all miss the exact speed by less than 0.015 of the
impact's (solver/README.md, *Time step*). That the stable step of a central difference falls with the number of
contacts and with damping: O'Sullivan & Bray 2004 (doi:10.1108/02644400410519794).

f is ``numerics.rayleigh_fraction``, b ``numerics.impact_fraction``. With f = 1 and b = 2 (leapfrog: ω dt < 2), they
are the limit of stability. All are proportional to the size of a body, so the smallest that its distribution of sizes
allows is taken, whatever the seed draws. An effect that stiffens contacts or takes more of an impact shortens them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations

import numpy as np
import numpy.typing as npt

from solver.effects import ContactEffect
from solver.laws import CONTACT_LAWS
from solver.scenes.body import Body
from solver.scenes.material import Material, effective_youngs_modulus
from solver.scenes.scene import Scene
from solver.shapes.clump import Clump, scaled

IMPACT_SPEED = 2.0
"""Speed [m/s] at which landings are taken; a fall of 0.2 m."""
LEAPFROG = 2.0
"""Largest ω dt of a stable leapfrog step."""
SLIP = 1.5
"""Step of a contact that is pulled sideways, in steps of one that is pressed, of bodies of several spheres. A single
one, which gives back the declared restitution itself, takes 1: within 0.5 % of e = 0.2 … 0.98."""
OUTERMOST = 24
"""Member spheres among which the faces of a body are looked for."""
MEETING = 3
"""Member spheres on which a body lands on another one: two bodies seldom meet face to face."""


def rayleigh_time(radius: float, material: Material) -> float:
    """T_R = π R √(ρ/G) / (0.1631 ν + 0.8766) [s]."""
    wave = math.sqrt(material.density / material.shear_modulus)
    return math.pi * radius * wave / (0.1631 * material.poisson_ratio + 0.8766)


def time_step(scene: Scene) -> float:
    """Time step [s] of ``scene``: the smallest limit of all components."""
    return _smallest(scene, scene.numerics.rayleigh_fraction, scene.numerics.impact_fraction)


def stability_limit(scene: Scene) -> float:
    """Time step [s] beyond which ``scene`` is unstable."""
    return _smallest(scene, 1.0, LEAPFROG)


def _smallest(scene: Scene, of_rayleigh: float, of_impact: float) -> float:
    steps = []
    for body in scene.bodies:
        clump, material = scaled(body.clump, body.sizes.low), scene.material(body.material)
        steps.append(of_rayleigh * rayleigh_time(float(clump.radii.min()), material))
        steps.extend(of_impact * one for one in _impacts(scene, body, clump))
    return min(steps) / math.sqrt(max((effect.stiffening for effect in _at_contacts(scene)), default=1.0))


def _at_contacts(scene: Scene) -> list[ContactEffect]:
    return [effect for effect in scene.effects if isinstance(effect, ContactEffect)]


def _impacts(scene: Scene, body: Body, clump: Clump) -> Iterator[float]:
    """Of every partner of ``body``, the steps [s] of landing, tip and slip for b = 1."""
    law, largest, mass = CONTACT_LAWS[scene.contact.law], float(clump.radii.max()), clump.mass
    at_sphere, at_surface = _mass_at(clump, np.zeros_like(clump.radii)), _mass_at(clump, clump.radii)
    partners: list[tuple[Body | str, str]] = [(other, other.material) for other in scene.bodies]
    for partner, name in (*partners, (scene.rig.wall, scene.rig.wall)):
        e_star = effective_youngs_modulus(scene.material(body.material), scene.material(name))

        def stiffness(spheres: int, e_star: float = e_star) -> float:
            """Of each of so many that share an impact: the energy of one is a part of the whole."""
            return law.stiffness(e_star, largest, mass, IMPACT_SPEED / math.sqrt(spheres), scene.contact)

        depth = IMPACT_SPEED * math.sqrt(mass / stiffness(1))
        together = landing_together(clump, depth) if partner == scene.rig.wall else min(len(clump.radii), MEETING)
        declared = scene.contact_pair(body, partner).restitution
        log = math.log(min([declared, *(one.restitution(declared, IMPACT_SPEED) for one in _at_contacts(scene))]))
        beta = -log / math.hypot(math.pi, log)
        for spheres, effective in ((together, mass), (1, at_sphere)):
            dampings = spheres * mass / effective
            omega = math.sqrt(spheres * stiffness(spheres) / effective)
            yield law.landing_step / (omega * math.sqrt(1.0 + law.damped_landing * dampings * beta**4))
        yield (SLIP if len(clump.radii) > 1 else 1.0) * math.sqrt(at_surface / stiffness(1))


def landing_together(clump: Clump, depth: float) -> int:
    """Largest number of member spheres that touch a plane at once, by half of ``depth`` [m] at least.

    Planes square to the principal axes, and through every three of the outermost centres.
    """
    outermost = np.argsort(-np.linalg.norm(clump.centres, axis=1), kind="stable")[:OUTERMOST]
    corners = clump.centres[list(combinations(outermost, 3))].reshape(-1, 3, 3)
    square = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(square, axis=1, keepdims=True)
    planes = np.concatenate([np.eye(3), (square / np.where(length > 0.0, length, 1.0))[length[:, 0] > 0.0]])
    reach = clump.centres @ np.concatenate([planes, -planes]).T + clump.radii[:, None]
    return int((reach > reach.max(axis=0) - 0.5 * depth).sum(axis=0).max())


def _mass_at(clump: Clump, beyond: npt.NDArray[np.float64]) -> float:
    """Least mass [kg] that ``clump`` shows ``beyond`` [m] the centre of any member sphere, across the way to it."""
    lever = clump.centres.copy()
    length = np.linalg.norm(lever, axis=1)
    away = np.divide(lever, length[:, None], out=np.tile([1.0, 0.0, 0.0], (len(lever), 1)), where=length[:, None] > 0.0)
    lever += beyond[:, None] * away
    cross = np.cross(lever[:, None, :], np.eye(3)[None, :, :])
    compliance = np.einsum("nik,k,njk->nij", cross, 1.0 / clump.inertia, cross)
    return float(1.0 / (1.0 / clump.mass + np.linalg.eigvalsh(compliance).max()))
