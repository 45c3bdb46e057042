"""The contact law of a scene, and the conventions in which programs with the same law still differ.

The defaults apply to files that name none. EDEM and LIGGGHTS use ``body_mass``; LIGGGHTS's ``tangential history`` uses
``mindlin`` and ``uncapped``.

    law                 which force acts (``laws/``)
    clump_rule          which mass of a clump of spheres acts at a contact (``engine/kernels/narrowphase.py``)
    tangential_law      what happens to the tangential spring when the contact area changes (``laws/hertz_mindlin.py``)
    tangential_dashpot  whether Coulomb's limit holds for spring and dashpot together or for the spring alone
"""

from __future__ import annotations

from dataclasses import dataclass

from solver.laws import CONTACT_LAWS, HertzMindlin
from solver.params import param

CLUMP_RULES = ("body_mass", "local_mass", "local_mass_shared")
TANGENTIAL_LAWS = ("mindlin_rescale", "mindlin")
TANGENTIAL_DASHPOTS = ("capped", "uncapped")


@dataclass(frozen=True)
class ContactModel:
    """The contact law and its conventions."""

    law: str = param(
        HertzMindlin.name,
        doc="Force between two bodies that overlap: hertz_mindlin, or linear_spring_dashpot, of constant stiffness "
        "during a contact.",
        choices=CONTACT_LAWS,
    )
    characteristic_velocity: float = param(
        1.0,
        unit="m/s",
        low=1e-3,
        high=100.0,
        doc="Impact speed at which a linear spring stores as much energy as Hertz's at the same overlap; used by "
        "linear_spring_dashpot only.",
        scale="log",
    )
    clump_rule: str = param(
        "body_mass",
        doc="Damping by the mass of the whole body (body_mass: EDEM, LIGGGHTS) or by the mass that acts at the contact "
        "(local_mass: the declared restitution at any tilt; local_mass_shared: all contacts of two bodies act as one).",
        choices=CLUMP_RULES,
    )
    tangential_law: str = param(
        "mindlin_rescale",
        doc="mindlin_rescale: the tangential force shrinks with the contact area (Thornton 2013); mindlin: the "
        "tangential displacement is kept (LIGGGHTS).",
        choices=TANGENTIAL_LAWS,
    )
    tangential_dashpot: str = param(
        "capped",
        doc="Coulomb's limit caps the tangential spring and dashpot together (capped), or the spring alone (uncapped: "
        "LIGGGHTS).",
        choices=TANGENTIAL_DASHPOTS,
    )

    @property
    def shares(self) -> bool:
        """Whether all contacts of a pair of bodies act as one, for which kernels have to be compiled separately."""
        return self.clump_rule == "local_mass_shared"

    @property
    def stated(self) -> dict[str, str]:
        """The law and the conventions that matter to it, by name: what is needed to repeat a run."""
        names = ("law", "clump_rule", *CONTACT_LAWS[self.law].reads, "tangential_dashpot")
        return {name: str(getattr(self, name)) for name in names}

    def carries(self, effect: str) -> bool:
        """Whether the effect of that name may act together with the law."""
        return effect not in CONTACT_LAWS[self.law].refuses

    @property
    def places(self) -> dict[str, int]:
        """Index of each convention in its list of choices, as the kernels take it."""
        return {
            "clump_rule": CLUMP_RULES.index(self.clump_rule),
            "tangential_law": TANGENTIAL_LAWS.index(self.tangential_law),
            "tangential_dashpot": TANGENTIAL_DASHPOTS.index(self.tangential_dashpot),
        }
