"""Contact laws: the force between two overlapping bodies, one law per file; ``law.py`` defines the interface.

To add one, write a file here with a class of ``ContactLaw`` and add it to the list below, or provide a package with an
entry point (``solver.plugins``). A scene names its law in ``contact.law``; a batch is compiled for one law, so scenes
with different laws cannot share a batch.
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
