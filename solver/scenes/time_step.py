"""The stable time step of a scene.

Two limits, the smaller one rules:

    Rayleigh    dt = f T_R,  T_R = π R √(ρ/G) / (0.1631 ν + 0.8766)   of the smallest member sphere (EDEM, LIGGGHTS)
    body        dt = b √(m_eff / k),  k the stiffness dF/dδ of the contact law at the overlap that a 2 m/s impact makes
                (Hertz: 2 E* √(R δ)), with the mass that a body shows at its far end, 1/m_eff = 1/m + reach²/I (a rod's
                tip is lighter than the rod)

f is ``numerics.rayleigh_fraction``, b ``numerics.impact_fraction``. With f = 1 and b = 2 (leapfrog: ω dt < 2), the same
two are the limit of stability. Both limits are proportional to the size of a body, so the smallest that its
distribution of sizes allows is taken, whatever the seed draws. An effect that stiffens contacts shortens both.
"""

from __future__ import annotations

import math

from solver.effects import ContactEffect
from solver.laws import CONTACT_LAWS
from solver.scenes.material import Material, effective_youngs_modulus
from solver.scenes.scene import Scene
from solver.shapes.clump import scaled

IMPACT_SPEED = 2.0
"""Speed [m/s] at which the body limit is taken; a fall of 0.2 m."""
LEAPFROG = 2.0
"""Largest ω dt of a stable leapfrog step."""


def rayleigh_time(radius: float, material: Material) -> float:
    """T_R = π R √(ρ/G) / (0.1631 ν + 0.8766) [s]."""
    wave = math.sqrt(material.density / material.shear_modulus)
    return math.pi * radius * wave / (0.1631 * material.poisson_ratio + 0.8766)


def time_step(scene: Scene) -> float:
    """Time step [s] of ``scene``: the smaller of the Rayleigh and the body limit over all components."""
    return _smallest(scene, scene.numerics.rayleigh_fraction, scene.numerics.impact_fraction)


def stability_limit(scene: Scene) -> float:
    """Time step [s] beyond which ``scene`` is unstable: T_R of the smallest sphere, or 2 √(m_eff / k) of a body."""
    return _smallest(scene, 1.0, LEAPFROG)


def _smallest(scene: Scene, of_rayleigh: float, of_body: float) -> float:
    wall, law = scene.material(scene.rig.wall), CONTACT_LAWS[scene.contact.law]
    steps = []
    for body in scene.bodies:
        clump, material = scaled(body.clump, body.sizes.low), scene.material(body.material)
        smallest = float(clump.radii.min())
        steps.append(of_rayleigh * rayleigh_time(smallest, material))
        e_star = max(effective_youngs_modulus(material, other) for other in (*scene.materials, wall))
        largest = float(clump.radii.max())
        stiffness = law.stiffness(e_star, largest, clump.mass, IMPACT_SPEED, scene.contact)
        tip = 1.0 / (1.0 / clump.mass + clump.bounding_radius**2 / float(min(clump.inertia[1:])))
        steps.append(of_body * math.sqrt(tip / stiffness))
    stiffest = max((effect.stiffening for effect in scene.effects if isinstance(effect, ContactEffect)), default=1.0)
    return min(steps) / math.sqrt(stiffest)
