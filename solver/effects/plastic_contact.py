"""Plastic contacts: unloading is stiffer than loading, and leaves a dent (Walton & Braun, in Hertzian form).

    loading     F = k δ^{3/2}                                        k = 4/3 E* √R*
    unloading   F = k/(1 − λ) (δ^{3/2} − λ δ_max^{3/2}) ≥ 0

λ = 1 − k/k₂ is the plasticity; δ_max the largest overlap of this contact, forgotten when the surfaces part. Vanishes
for λ → 0. The force ends at δ = λ^{2/3} δ_max. Without other damping, the share of the energy put in,
2/5 k δ_max^{5/2}, that is recovered is

    e² = (1 − 5/2 λ + 3/2 λ^{5/3})/(1 − λ)

at any speed (with forces linear in δ it would be 1 − λ): e = 0.84, 0.67, 0.41 for λ = 0.25, 0.5, 0.8.
Unloading is 1/(1 − λ) times as stiff, but needs no shorter time step: the force is continuous where the branches meet,
and unloading takes fewer steps but also returns less energy. Impacts are as exact as without the effect
(``tests/solver/effects``).
Source: Walton & Braun 1986, Journal of Rheology 30:949; the exponent 3/2 and λ as in the Edinburgh elasto-plastic
adhesion model (Morrissey 2013, thesis, Edinburgh), without its adhesive branch.
"""

from dataclasses import dataclass

from solver.effects.effect import ContactEffect, Stage, Telltale
from solver.effects.kernel import kernel_function, ti
from solver.params import param


@kernel_function
def unload_stiffer(p, m, c):
    """p: λ; m: δ_max."""
    if c.before == 0.0:
        m[0] = 0.0
    if c.overlap > 0.0:
        m[0] = ti.max(m[0], c.overlap)
        hertz = 4.0 / 3.0 * c.e_star * c.radius * c.overlap
        past = 4.0 / 3.0 * c.e_star * ti.sqrt(c.reduced_radius * m[0]) * m[0]
        c.elastic += c.part * (ti.max(0.0, (hertz - p[0] * past) / (1.0 - p[0])) - hertz)
    return c, m


@dataclass(frozen=True)
class PlasticContact(ContactEffect):
    """Elastic–plastic normal contact; ``plasticity`` is the amplitude."""

    plasticity: float = param(0.0, low=0.0, high=0.9, doc="Plasticity λ = 1 − k/k₂.", live=True)

    name = "plastic_contact"
    amplitudes = ("plasticity",)
    strongest = 0.8
    literature = "λ = 0.2–0.8 for food and soft plant material in EEPA calibrations"
    lever = "drop test at several heights: a rebound lower than the damping explains, by the same factor at every speed"
    telltales = (Telltale.SHAPE, Telltale.FLOW)
    revision = 3
    stage = Stage.NORMAL
    act = staticmethod(unload_stiffer)
    memory = 1
