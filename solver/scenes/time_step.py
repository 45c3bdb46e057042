"""The stable time step of a scene.

The smallest of these limits applies:

    Rayleigh    dt = f T_R,  T_R = π R √(ρ/G) / (0.1631 ν + 0.8766)   for the smallest member sphere (EDEM, LIGGGHTS)
    landing     dt = b l / (ω √(1 + d N β⁴)),  ω = √(N k/m)   for a body that lands on N member spheres at once
    tip         the same for a body that is hit at its outermost sphere: N = 1, with the effective mass there
    slip        dt = 1.5 b √(m_eff/k)   for a body pulled sideways at its outermost point; b √(m_eff/k) for one sphere

k is the stiffness dF/dδ of the contact law at the overlap reached in an impact at 2 m/s, β = −ln e/√(π² + ln² e) with
the restitution e of the pair, and m_eff the effective mass of a body at r along a direction u,
1/m_eff = 1/m + (r × u)ᵀ I⁻¹ (r × u), for the worst u. A dashpot uses its own force at the end of the step but the
forces of the others from the previous step. Of N dashpots that act at once N − 1 are therefore late, and many strong
ones add energy, which the square root prevents. (A dashpot at a tip damps with the whole mass, and counts m/m_eff
times.) l and d, ``landing_step`` and ``damped_landing`` of the contact law, are fitted to landings of 1 to 38 spheres
with e = 0.05 … 0.9; in all of them the speed deviates from the exact one by less than 0.015 of the impact speed
(solver/README.md, *Time step*). The stable step of a central difference decreases with the number of contacts and with
damping: O'Sullivan & Bray 2004 (doi:10.1108/02644400410519794).

f is ``numerics.rayleigh_fraction``, b ``numerics.impact_fraction``. With f = 1 and b = 2 (leapfrog: ω dt < 2), these
steps are the limits of stability. All are proportional to the size of a body, so the smallest size that its
distribution allows is used, whatever the seed draws. An effect that stiffens contacts or dissipates more of an impact
shortens them.
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
"""Assumed speed [m/s] of an impact; that of a fall from 0.2 m."""
LEAPFROG = 2.0
"""Largest ω dt of a stable leapfrog step."""
SLIP = 1.5
"""Step of a contact that is loaded sideways over that of one that is compressed, for bodies of several spheres. For a
single sphere, which reproduces the declared restitution itself, it is 1: within 0.5 % of e = 0.2 … 0.98."""
OUTERMOST = 24
"""Number of outermost member spheres among which the faces of a body are looked for."""
MEETING = 3
"""Number of member spheres with which a body lands on another one: two bodies seldom meet face to face."""


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
    """Steps [s] of landing, tip and slip for b = 1, for every partner of ``body``."""
    law, largest, mass = CONTACT_LAWS[scene.contact.law], float(clump.radii.max()), clump.mass
    at_sphere, at_surface = _mass_at(clump, np.zeros_like(clump.radii)), _mass_at(clump, clump.radii)
    partners: list[tuple[Body | str, str]] = [(other, other.material) for other in scene.bodies]
    for partner, name in (*partners, (scene.rig.wall, scene.rig.wall)):
        e_star = effective_youngs_modulus(scene.material(body.material), scene.material(name))

        def stiffness(spheres: int, e_star: float = e_star) -> float:
            """Stiffness of each of ``spheres`` that share an impact, each with its share of the energy."""
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
    """Largest number of member spheres that touch a plane at once, each to at least half of ``depth`` [m].

    The planes are normal to the principal axes, or parallel to one through three of the outermost centres.
    """
    outermost = np.argsort(-np.linalg.norm(clump.centres, axis=1), kind="stable")[:OUTERMOST]
    corners = clump.centres[list(combinations(outermost, 3))].reshape(-1, 3, 3)
    square = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(square, axis=1, keepdims=True)
    planes = np.concatenate([np.eye(3), (square / np.where(length > 0.0, length, 1.0))[length[:, 0] > 0.0]])
    reach = clump.centres @ np.concatenate([planes, -planes]).T + clump.radii[:, None]
    return int((reach > reach.max(axis=0) - 0.5 * depth).sum(axis=0).max())


def _mass_at(clump: Clump, beyond: npt.NDArray[np.float64]) -> float:
    """Smallest effective mass [kg] of ``clump`` at ``beyond`` [m] past any sphere's centre, across the lever arm."""
    lever = clump.centres.copy()
    length = np.linalg.norm(lever, axis=1)
    away = np.divide(lever, length[:, None], out=np.tile([1.0, 0.0, 0.0], (len(lever), 1)), where=length[:, None] > 0.0)
    lever += beyond[:, None] * away
    cross = np.cross(lever[:, None, :], np.eye(3)[None, :, :])
    compliance = np.einsum("nik,k,njk->nij", cross, 1.0 / clump.inertia, cross)
    return float(1.0 / (1.0 / clump.mass + np.linalg.eigvalsh(compliance).max()))
