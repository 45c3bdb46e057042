"""What a contact law is to everything outside it: names, constants of a pair, and functions for the kernels.

A law is a class that is never instantiated, with the attributes below. It is compiled into a batch, so nothing of it is
chosen while a world runs. Its functions of a contact are called from kernels (``solver.effects.kernel``):

    law     row of the law table, by the names of ``columns``
    scale   what :attr:`ContactLaw.scale` gave for the contact: evaluated once a step and passed on
    a       contact radius √(R* δ) [m], by which the kernels know whether two bodies touch; an effect may change it

What laws share stands here: the normal force in time (:func:`normal_force`), and a tangential spring that is turned
with its contact and capped by Coulomb (:func:`tangential_force`).
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
    """What a report calls it."""
    reads: ClassVar[tuple[str, ...]] = ()
    """Parameters ``contact.…`` that it reads beside ``clump_rule`` and ``tangential_dashpot``."""
    columns: ClassVar[tuple[str, ...]]
    """Constants of a pair of materials, as the kernels read them; ``e_star`` [Pa] and ``friction`` are among them."""
    ramped: ClassVar[tuple[str, ...]]
    """Those of them that a running pile approaches gradually (``parameter_ramp.py``): what a pile could explode by."""
    spring_column: ClassVar[str]
    """The one that the stiffness of the tangential spring is proportional to."""
    refuses: ClassVar[tuple[str, ...]] = ()
    """Effects that assume another law, by name."""

    landing_step: ClassVar[float] = 1.0
    """Step of an undamped landing, in steps of a Hertzian one (``scenes/time_step.py``)."""
    damped_landing: ClassVar[float] = 4.0
    """How much dampings shorten it: (1 + ``damped_landing`` N β⁴)^-½."""

    scale: ClassVar[KernelCall]
    """``scale(law, reduced_radius, reduced_mass)``: what the law takes of R* [m] and m* [kg]; a number."""
    normal_spring_force: ClassVar[KernelCall]
    """``normal_spring_force(law, scale, a, overlap)``: elastic normal force [N], 0 at no overlap."""
    normal_damper: ClassVar[KernelCall]
    """``normal_damper(law, scale, a, mass, a_before, overlap, v_n, dt)``: damping force over approach speed [kg/s].

    ``mass`` [kg] is what the dashpot damps; ``v_n`` [m/s] is positive while separating; ``a_before`` is 0 in the first
    step of a contact, which began somewhere within the step.
    """
    normal_energy: ClassVar[KernelCall]
    """``normal_energy(law, scale, a, overlap)``: energy in the normal spring [J]."""
    shear_stiffness: ClassVar[KernelCall]
    """``shear_stiffness(law, scale, a)``: k_t [N/m]."""
    shear_modulus: ClassVar[KernelCall]
    """``shear_modulus(law, scale, a)``: the G* [Pa] with k_t = 8 G* a, which effects see."""
    shear_damper: ClassVar[KernelCall]
    """``shear_damper(law, scale, a, mass)``: tangential damping force over speed while the contact sticks [kg/s]."""
    growth: ClassVar[KernelCall]
    """``growth(a, a_before, displaced)``: factor on the tangential spring's force as the contact radius changes.

    ``displaced`` is 1 for ``contact.tangential_law = "mindlin"``.
    """
    shear_energy: ClassVar[KernelCall]
    """``shear_energy(law, scale, spring2, a)``: energy in the spring T [J], ``spring2`` = T²; 0 apart (a = 0)."""
    shear_energy_gain: ClassVar[KernelCall]
    """``shear_energy_gain(law, scale, old2, a_before, new2, a)``: that of the new state less the old one's [J]."""

    @staticmethod
    def constants(one: Material, two: Material, pair: Pair, contact: ContactModel) -> tuple[float, ...]:
        """Row of the law table, in the order of ``columns``."""
        raise NotImplementedError

    @staticmethod
    def stiffness(e_star: float, radius: float, mass: float, speed: float, contact: ContactModel) -> float:
        """Normal stiffness dF/dδ [N/m] at the overlap that an impact at ``speed`` [m/s] makes, for the time step."""
        raise NotImplementedError


@kernel_function
def normal_force(elastic, damper, v_n, v_expected, mass, dt, floor):
    """Normal force F [N], never below ``floor`` (0: never tensile).

    The damper takes the speed in the middle of the step, v_n + dt (F/m* + A)/2.
    A is the acceleration by everything else, known from the last step: dt A = v_n − ``v_expected``, the speed that the
    contact's own force would have led to. A contact at rest, held by others, is thus not damped at all.
    """
    middle = v_n + 0.5 * (v_n - v_expected)
    return ti.max(floor, (elastic - damper * middle) / (1.0 + 0.5 * dt * damper / mass))


@kernel_function
def tangential_force(stiffness, damper, growth, spring, n, v_t, limit, dt, uncapped):
    """New tangential spring [N] and force on i [N], within Coulomb's ``limit`` [N].

    ``spring`` is turned with the normal, its length restored, and multiplied by ``growth``; it then takes up
    ``stiffness`` [N/m] times the slip of the step. ``damper`` [kg/s] acts while it sticks. If ``uncapped``, the limit
    holds for the spring alone.
    """
    length2 = spring.dot(spring)
    if length2 > 0.0:
        out_of_plane = spring.dot(n)
        # Shorter by a share s of its square: (1 − s)^-1/2, whose series is exact in double precision for small s.
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
