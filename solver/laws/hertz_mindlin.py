"""Hertz–Mindlin (no slip) with viscous damping, tangential history and a Coulomb cap.

Notation: grain i is pushed by j; normal n from j to i; overlap δ > 0 when touching; a = √(R* δ) contact radius.

    normal        F_n = max(0, 4/3 E* a δ − c_n √(2 E* a m*) v_n)            [N]
    tangential    k_t = 8 G* a; elastic force T (stored in the world frame):
                  rotated with the normal, its length kept; scaled by a/a_prev on unloading;
                  T ← T − k_t v_t dt, capped at μ F_n
                  F_t = T − c_t √(k_t m*) v_t while sticking, T while slipping; capped at μ F_n as well

Two options of ``scenes/contact_model.py`` are conventions of other programs: ``mindlin`` scales T by a/a_prev on
loading too, which keeps the displacement T/k_t (LIGGGHTS ``tangential history``), and ``uncapped`` exempts the dashpot
from the limit μ F_n.

R* comes from the member spheres, m* from the bodies. c_n(e) is the exact inverse for this contact (`restitution.py`),
so an impact reproduces the declared restitution; c_t = 2 √(5/6) |β|, β = ln e / √(ln² e + π²) (Tsuji 1992 as used in
LIGGGHTS).
Sources: Hertz 1882; Mindlin & Deresiewicz 1953; rescaling on unloading: Thornton, Cummins & Cleary 2013, Powder
Technology 233:30.
"""

import math

from solver.effects.kernel import kernel_function, ti
from solver.laws.law import ContactLaw
from solver.laws.restitution import normal_damping
from solver.scenes.material import Material, Pair, effective_shear_modulus, effective_youngs_modulus


def tangential_damping(restitution: float) -> float:
    """c_t = 2 √(5/6) |ln e| / √(ln² e + π²), dimensionless."""
    log = math.log(restitution)
    return 2.0 * math.sqrt(5.0 / 6.0) * abs(log) / math.sqrt(log * log + math.pi**2)


@kernel_function
def nothing_more(law, reduced_radius, reduced_mass):
    """Unused by this law: the contact radius contains R*, and the dashpots receive their mass as an argument."""
    return 0.0


@kernel_function
def normal_spring_force(law, scale, a, overlap):
    """4/3 E* a δ [N]."""
    return 4.0 / 3.0 * law.e_star * a * overlap


@kernel_function
def normal_damper(law, scale, a, mass, a_before, overlap, v_n, dt):
    """c_n √(2 E* a m*) [kg/s].

    It is ∝ δ^(1/4), which rises steeply at the start of a contact. In the first step the value at δ is therefore
    replaced by the mean over the step, 4/5 δ₊^(5/4)/(|v_n| dt), where δ₊ is the overlap half a step ahead.
    """
    damper = law.normal_damping * ti.sqrt(a * mass)
    if a_before == 0.0 and v_n < 0.0:
        way = -v_n * dt
        ahead = overlap + 0.5 * way
        damper *= 0.8 * ahead / way * ti.sqrt(ti.sqrt(ahead / overlap))
    return damper


@kernel_function
def normal_energy(law, scale, a, overlap):
    """8/15 E* a δ² [J]."""
    return 8.0 / 15.0 * law.e_star * a * overlap * overlap


@kernel_function
def shear_stiffness(law, scale, a):
    """8 G* a [N/m]."""
    return 8.0 * law.g_star * a


@kernel_function
def shear_modulus(law, scale, a):
    """G* [Pa] itself."""
    return law.g_star


@kernel_function
def shear_damper(law, scale, a, mass):
    """c_t √(8 G* a m*) [kg/s]."""
    return law.shear_damping * ti.sqrt(a * mass)


@kernel_function
def growth(a, a_before, displaced):
    """a/a_prev on unloading; on loading too if the spring keeps its displacement instead of its force."""
    factor = 1.0
    if a_before > 0.0:
        factor = a / a_before
        if displaced == 0:
            factor = ti.min(1.0, factor)
    return factor


@kernel_function
def shear_energy(law, scale, spring2, a):
    """T²/(16 G* a) [J]; 0 when apart."""
    energy = 0.0
    if a > 0.0:
        energy = spring2 / (16.0 * law.g_star * a)
    return energy


@kernel_function
def shear_energy_gain(law, scale, old2, a_before, new2, a):
    """Difference of the two spring energies [J], computed with a single division."""
    numerator, denominator = new2, 16.0 * law.g_star * a
    if a_before > 0.0:
        numerator = new2 * a_before - old2 * a
        denominator *= a_before
    return numerator / denominator


class HertzMindlin(ContactLaw):
    """Nonlinear springs of elastic spheres; the default."""

    name = "hertz_mindlin"
    title = "Hertz–Mindlin"
    reads = ("tangential_law",)
    columns = ("e_star", "g_star", "friction", "normal_damping", "shear_damping")
    ramped = ("e_star", "g_star", "normal_damping", "shear_damping")
    spring_column = "g_star"

    scale = staticmethod(nothing_more)
    normal_spring_force = staticmethod(normal_spring_force)
    normal_damper = staticmethod(normal_damper)
    normal_energy = staticmethod(normal_energy)
    shear_stiffness = staticmethod(shear_stiffness)
    shear_modulus = staticmethod(shear_modulus)
    shear_damper = staticmethod(shear_damper)
    growth = staticmethod(growth)
    shear_energy = staticmethod(shear_energy)
    shear_energy_gain = staticmethod(shear_energy_gain)

    @staticmethod
    def constants(one: Material, two: Material, pair: Pair, contact: object) -> tuple[float, ...]:
        """E* [Pa], G* [Pa], μ, c_n √(2 E*), c_t √(8 G*).

        Both dashpots are ∝ √(a m*), so the kernel takes one square root for both.
        """
        e_star, g_star = effective_youngs_modulus(one, two), effective_shear_modulus(one, two)
        return (
            e_star,
            g_star,
            pair.static_friction,
            normal_damping(pair.restitution) * math.sqrt(2.0 * e_star),
            tangential_damping(pair.restitution) * math.sqrt(8.0 * g_star),
        )

    @staticmethod
    def stiffness(e_star: float, radius: float, mass: float, speed: float, contact: object) -> float:
        """2 E* √(R* δ) [N/m] at δ = (15 m* v²/(16 E* √R*))^(2/5)."""
        overlap = (15.0 * mass * speed**2 / (16.0 * e_star * math.sqrt(radius))) ** 0.4
        return 2.0 * e_star * math.sqrt(radius * overlap)
