"""Contact laws: the force between two bodies that overlap, one file each; ``law.py`` says what one is.

To add one: a file with a class of ``ContactLaw`` here, or a package with an entry point (``solver.plugins``). A scene
names its law in ``contact.law``; kernels are compiled for it, and scenes of different laws share no batch.
"""

from solver.laws.hertz_mindlin import HertzMindlin
from solver.laws.law import ContactLaw
from solver.laws.linear_spring_dashpot import LinearSpringDashpot
from solver.plugins import Registry, derived_from

CONTACT_LAWS: Registry[type[ContactLaw]] = Registry(
    "contact_law", (HertzMindlin, LinearSpringDashpot), derived_from(ContactLaw)
)
"""Laws by name."""

__all__ = ["CONTACT_LAWS", "ContactLaw", "HertzMindlin", "LinearSpringDashpot"]
