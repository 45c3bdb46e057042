"""Linear springs and dashpots in both directions, tangential history and a Coulomb cap ("Hookean").

Notation as in ``hertz_mindlin.py``; V is ``contact.characteristic_velocity``.

    stiffness     k_n = 16/15 E* √R* (15 m* V²/(16 E* √R*))^(1/5),  k_t = k_n                          [N/m]
    normal        F_n = max(0, k_n δ − γ v_n),  γ = 2 ζ √(m* k_n)                                      [N]
    tangential    T rotated with the normal, its length kept;  T ← T − k_t v_t dt, capped at μ F_n
                  F_t = T − γ v_t while sticking, T while slipping; capped at μ F_n as well

k_n is the stiffness that stores ½ m* V² at the overlap that an elastic Hertzian impact at V makes, so an impact is as
deep at V, shallower below, and lasts equally long at every speed: π √(m*/k_n) for e = 1. ζ(e) is the exact inverse for
this contact (``restitution.py``: both laws are the same oscillator in other coordinates), whereas the usual
γ = √(4 m* k_n/(1 + (π/ln e)²)) gives e only if the force may become tensile. The stiffness does not change during a
contact, so ``contact.tangential_law`` makes no difference.

R* comes from the member spheres, m* in k_n from the bodies; the mass of a dashpot follows ``contact.clump_rule``. The
law is that of LIGGGHTS-PUBLIC ``model hooke tangential history`` with ``limitForce on``, except for ζ(e) and for the
cap on spring and dashpot together, which ``contact.tangential_dashpot = "uncapped"`` removes.
Sources: Cundall & Strack 1979, Géotechnique 29:47 (doi:10.1680/geot.1979.29.1.47); never tensile: Schwager & Pöschel
2007, Granular Matter 9:465 (doi:10.1007/s10035-007-0065-z); LIGGGHTS-PUBLIC documentation, "gran model hooke".
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from solver.effects.kernel import kernel_function, ti
from solver.laws.law import ContactLaw
from solver.laws.restitution import damping_ratio
from solver.scenes.material import Material, Pair, effective_youngs_modulus

if TYPE_CHECKING:
    from solver.scenes.contact_model import ContactModel


@kernel_function
def spring_constant(law, reduced_radius, reduced_mass):
    """k_n = k_t [N/m], from the factor of the pair of materials."""
    return law.stiffness * (reduced_radius * reduced_radius * reduced_mass) ** 0.2


@kernel_function
def normal_spring_force(law, stiffness, a, overlap):
    """k_n δ [N]."""
    return stiffness * overlap


@kernel_function
def normal_damper(law, stiffness, a, mass, a_before, overlap, v_n, dt):
    """γ [kg/s].

    It acts in full from first contact on, so in the first step it is multiplied by the share of the step between first
    contact and half a step ahead.
    """
    damper = law.damping * ti.sqrt(stiffness * mass)
    if a_before == 0.0 and v_n < 0.0:
        way = -v_n * dt
        damper *= (overlap + 0.5 * way) / way
    return damper


@kernel_function
def normal_energy(law, stiffness, a, overlap):
    """½ k_n δ² [J]."""
    return 0.5 * stiffness * overlap * overlap


@kernel_function
def shear_stiffness(law, stiffness, a):
    """k_t = k_n [N/m]."""
    return stiffness


@kernel_function
def shear_modulus(law, stiffness, a):
    """k_t/(8 a) [Pa]."""
    return 0.125 * stiffness / a


@kernel_function
def shear_damper(law, stiffness, a, mass):
    """γ [kg/s]."""
    return law.damping * ti.sqrt(stiffness * mass)


@kernel_function
def unchanged(a, a_before, displaced):
    """With a constant stiffness, keeping the force is the same as keeping the displacement."""
    return 1.0


@kernel_function
def shear_energy(law, stiffness, spring2, a):
    """T²/(2 k_t) [J]; 0 when apart, where no spring is left."""
    return 0.5 * spring2 / stiffness


@kernel_function
def shear_energy_gain(law, stiffness, old2, a_before, new2, a):
    """Difference of the two spring energies [J]."""
    return 0.5 * (new2 - old2) / stiffness


class LinearSpringDashpot(ContactLaw):
    """Linear springs whose stiffness is matched to a Hertzian impact at one speed."""

    name = "linear_spring_dashpot"
    title = "linear springs and dashpots"
    reads = ("characteristic_velocity",)
    columns = ("e_star", "stiffness", "friction", "damping")
    ramped = ("e_star", "stiffness", "damping")
    spring_column = "stiffness"
    refuses = ("adhesion_jkr", "wall_adhesion", "plastic_contact", "capillary_bridge")
    """The first three replace Hertz's force by one derived from it; a bridge holds surfaces at a gap, where the contact
    radius does not switch these dashpots off."""

    landing_step = 0.7
    damped_landing = 10.0
    """Larger than with Hertz's law, because the dashpot acts in full from first contact on."""

    scale = staticmethod(spring_constant)
    normal_spring_force = staticmethod(normal_spring_force)
    normal_damper = staticmethod(normal_damper)
    normal_energy = staticmethod(normal_energy)
    shear_stiffness = staticmethod(shear_stiffness)
    shear_modulus = staticmethod(shear_modulus)
    shear_damper = staticmethod(shear_damper)
    growth = staticmethod(unchanged)
    shear_energy = staticmethod(shear_energy)
    shear_energy_gain = staticmethod(shear_energy_gain)

    @staticmethod
    def constants(one: Material, two: Material, pair: Pair, contact: ContactModel) -> tuple[float, ...]:
        """E* [Pa], k_n/(R*² m*)^(1/5), μ, 2 ζ."""
        e_star = effective_youngs_modulus(one, two)
        factor = _factor(e_star, contact.characteristic_velocity)
        return e_star, factor, pair.static_friction, 2.0 * damping_ratio(pair.restitution)

    @staticmethod
    def stiffness(e_star: float, radius: float, mass: float, speed: float, contact: ContactModel) -> float:
        """k_n [N/m], the same at every speed."""
        return _factor(e_star, contact.characteristic_velocity) * (radius**2 * mass) ** 0.2


def _factor(e_star: float, speed: float) -> float:
    """k_n/(R*² m*)^(1/5) = 16/15 E*^(4/5) (15/16 V²)^(1/5)."""
    return float(16.0 / 15.0 * e_star**0.8 * (15.0 / 16.0 * speed**2) ** 0.2)
