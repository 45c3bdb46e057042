"""Linear springs and dashpots of a quarter of the shipped law's stiffness: impacts last twice as long.

A law of one's own overrides more of ``solver.laws.ContactLaw``: here its kernels are those of the shipped one, and its
constants are others. The restitution is kept, as the damping ratio is.
"""

from solver.laws import LinearSpringDashpot
from solver.scenes.contact_model import ContactModel
from solver.scenes.material import Material, Pair

SHARE = 0.25


class SoftSprings(LinearSpringDashpot):
    """k_n = k_t = 1/4 of those of ``linear_spring_dashpot``."""

    name = "soft_springs"
    title = "soft linear springs"

    @staticmethod
    def constants(one: Material, two: Material, pair: Pair, contact: ContactModel) -> tuple[float, ...]:
        """E* [Pa], k_n/(R*² m*)^(1/5), μ, 2 ζ."""
        e_star, stiffness, friction, damping = LinearSpringDashpot.constants(one, two, pair, contact)
        return e_star, SHARE * stiffness, friction, damping

    @staticmethod
    def stiffness(e_star: float, radius: float, mass: float, speed: float, contact: ContactModel) -> float:
        """k_n [N/m], at every speed."""
        return SHARE * LinearSpringDashpot.stiffness(e_star, radius, mass, speed, contact)
