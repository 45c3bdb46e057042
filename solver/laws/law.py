"""Interface of a contact law: names, constants of a pair of materials, and functions for the kernels.

A law is a class with the attributes below; it is never instantiated. It is compiled into a batch, so nothing about it
is decided while a world runs. Kernels call its functions for every contact (``solver.effects.kernel``):

    law     row of the law table, by the names of ``columns``
    scale   result of :attr:`ContactLaw.scale` for the contact, evaluated before the other functions and passed to them
    a       contact radius √(R* δ) [m], from which the kernels tell whether two bodies touch; an effect may change it

This module also contains what all laws share: the damped normal force of a time step (:func:`normal_force`), and a
tangential spring that rotates with its contact and is capped by Coulomb friction (:func:`tangential_force`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar

from solver.effects.kernel import kernel_function, ti
from solver.scenes.material import Material, Pair

if TYPE_CHECKING:
    from solver.scenes.contact_model import ContactModel

KernelCall = Callable[..., Any]


class ContactLaw:
    """Base of all laws."""

    name: ClassVar[str]
    title: ClassVar[str]
    """Name in reports."""
    reads: ClassVar[tuple[str, ...]] = ()
    """Parameters ``contact.…`` that it reads in addition to ``clump_rule`` and ``tangential_dashpot``."""
    columns: ClassVar[tuple[str, ...]]
    """Constants of a pair of materials, as the kernels read them; ``e_star`` [Pa] and ``friction`` are among them."""
    ramped: ClassVar[tuple[str, ...]]
    """Columns that change gradually in a running pile (``parameter_ramp.py``); a sudden change may make it explode."""
    spring_column: ClassVar[str]
    """Column to which the stiffness of the tangential spring is proportional."""
    refuses: ClassVar[tuple[str, ...]] = ()
    """Effects that assume another law, by name."""

    landing_step: ClassVar[float] = 1.0
    """Time step for an undamped landing, as a multiple of that with Hertz's law (``scenes/time_step.py``)."""
    damped_landing: ClassVar[float] = 4.0
    """How much damping shortens that time step: by the factor (1 + ``damped_landing`` N β⁴)^-½."""

    scale: ClassVar[KernelCall]
    """``scale(law, reduced_radius, reduced_mass)``: the number that the law derives from R* [m] and m* [kg]."""
    normal_spring_force: ClassVar[KernelCall]
    """``normal_spring_force(law, scale, a, overlap)``: elastic normal force [N], 0 without overlap."""
    normal_damper: ClassVar[KernelCall]
    """``normal_damper(law, scale, a, mass, a_before, overlap, v_n, dt)``: damping force / approach speed [kg/s].

    ``mass`` [kg] is the mass that the dashpot damps; ``v_n`` [m/s] is positive while separating; ``a_before`` [m] is 0
    in the first step of a contact, which began at some time within that step.
    """
    normal_energy: ClassVar[KernelCall]
    """``normal_energy(law, scale, a, overlap)``: energy in the normal spring [J]."""
    shear_stiffness: ClassVar[KernelCall]
    """``shear_stiffness(law, scale, a)``: k_t [N/m]."""
    shear_modulus: ClassVar[KernelCall]
    """``shear_modulus(law, scale, a)``: the G* [Pa] for which k_t = 8 G* a; this is the G* that effects see."""
    shear_damper: ClassVar[KernelCall]
    """``shear_damper(law, scale, a, mass)``: tangential damping force / speed while the contact sticks [kg/s]."""
    growth: ClassVar[KernelCall]
    """``growth(a, a_before, displaced)``: factor on the tangential spring's force as the contact radius changes.

    ``displaced`` is 1 for ``contact.tangential_law = "mindlin"``.
    """
    shear_energy: ClassVar[KernelCall]
    """``shear_energy(law, scale, spring2, a)``: energy in the spring T [J], ``spring2`` = T²; 0 when apart (a = 0)."""
    shear_energy_gain: ClassVar[KernelCall]
    """``shear_energy_gain(law, scale, old2, a_before, new2, a)``: spring energy after minus before the step [J]."""

    @staticmethod
    def constants(one: Material, two: Material, pair: Pair, contact: ContactModel) -> tuple[float, ...]:
        """Row of the law table, in the order of ``columns``."""
        raise NotImplementedError

    @staticmethod
    def stiffness(e_star: float, radius: float, mass: float, speed: float, contact: ContactModel) -> float:
        """Normal stiffness dF/dδ [N/m] at the largest overlap of an impact at ``speed`` [m/s], for the time step."""
        raise NotImplementedError


@kernel_function
def normal_force(elastic, damper, v_n, v_expected, mass, dt, floor):
    """Normal force F [N], never below ``floor`` (0: never tensile).

    The damper acts on the speed in the middle of the step, v_n + dt (F/m* + A)/2. A is the acceleration due to all
    other forces, taken from the last step: dt A = v_n − ``v_expected``, where ``v_expected`` [m/s] is the speed to
    which this contact's force alone would have led. A contact at rest under the load of others is thus not damped.
    """
    middle = v_n + 0.5 * (v_n - v_expected)
    return ti.max(floor, (elastic - damper * middle) / (1.0 + 0.5 * dt * damper / mass))


@kernel_function
def tangential_force(stiffness, damper, growth, spring, n, v_t, limit, dt, uncapped):
    """New tangential spring [N] and force on i [N], within Coulomb's ``limit`` [N].

    ``spring`` is rotated with the normal, its length kept, and multiplied by ``growth``; it then changes by
    ``stiffness`` [N/m] times the tangential displacement of the step. ``damper`` [kg/s] acts while the contact sticks.
    If ``uncapped``, the limit holds for the spring alone.
    """
    length2 = spring.dot(spring)
    if length2 > 0.0:
        out_of_plane = spring.dot(n)
        # Projection takes away a share s of the squared length. The factor (1 − s)^-1/2 restores it; for small s its
        # series is exact in double precision.
        share = out_of_plane * out_of_plane / length2
        scale = 1.0 + share * (0.5 + 0.375 * share)
        if share > 1e-6:
            scale = 0.0
            if share < 1.0:
                scale = 1.0 / ti.sqrt(1.0 - share)
        spring = (spring - out_of_plane * n) * (scale * growth)
    spring -= stiffness * dt * v_t
    size2 = spring.dot(spring)
    force = spring
    if size2 > limit * limit:
        spring *= limit / ti.sqrt(size2)
        force = spring
    else:
        force = spring - damper * v_t
        total2 = force.dot(force)
        if uncapped == 0 and total2 > limit * limit:
            force *= limit / ti.sqrt(total2)
    return spring, force
