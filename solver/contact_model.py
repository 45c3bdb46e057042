"""Which conventions of the Hertz–Mindlin contact a scene is calculated with: programs differ in three of them.

clump_rule          what of a clump of spheres a contact feels (``kernels/clump_rules.py``)
tangential_law      what happens to the tangential spring when the contact area changes (``laws/hertz_mindlin.py``)
tangential_dashpot  whether Coulomb's limit holds for spring and dashpot together or for the spring alone

The defaults are those of files that name none. EDEM and LIGGGHTS calculate with ``body_mass``; LIGGGHTS's ``tangential
history`` with ``mindlin`` and ``uncapped``.
"""

from __future__ import annotations

from dataclasses import dataclass

from solver.params import param

CLUMP_RULES = ("body_mass", "local_mass", "local_mass_shared")
TANGENTIAL_LAWS = ("mindlin_rescale", "mindlin")
TANGENTIAL_DASHPOTS = ("capped", "uncapped")


@dataclass(frozen=True)
class ContactModel:
    """Conventions of the contact law."""

    clump_rule: str = param(
        "body_mass",
        doc="Damping by the mass of the whole body (body_mass: EDEM, LIGGGHTS) or by the mass that acts at the contact "
        "(local_mass: the declared restitution at any tilt); local_mass_shared: the contacts of two bodies act as one.",
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
        doc="Whether Coulomb's limit holds for tangential spring and dashpot (capped) or the spring alone (uncapped: "
        "LIGGGHTS).",
        choices=TANGENTIAL_DASHPOTS,
    )

    @property
    def numbers(self) -> tuple[float, float, float]:
        """Places of the three in their lists of choices, as the kernels take them."""
        return (
            float(CLUMP_RULES.index(self.clump_rule)),
            float(TANGENTIAL_LAWS.index(self.tangential_law)),
            float(TANGENTIAL_DASHPOTS.index(self.tangential_dashpot)),
        )
