"""A scene of few glass beads: as small a pour as there is, for tests of what surrounds the solver."""

from solver.rigs import Funnel
from solver.scenes.body import Body, Members
from solver.scenes.insertion import Insertion
from solver.scenes.material import Material, Pair
from solver.scenes.scene import Scene

RADIUS = 6e-3
GLASS = Material("glass", density=2500.0, shear_modulus=1e7, poisson_ratio=0.25)
STEEL = Material("steel", density=7800.0, shear_modulus=8e10, poisson_ratio=0.3)
MASS = 4.0 / 3.0 * 3.141592653589793 * RADIUS**3 * GLASS.density
"""Mass of a bead [kg], 2.26 g."""


def bead_scene(beads: int = 6) -> Scene:
    """``beads`` beads that fall through the funnel one after the other."""
    inertia = 0.4 * MASS * RADIUS**2
    bead = Members(((0.0, 0.0, 0.0),), (RADIUS,), MASS, (inertia,) * 3)
    return Scene(
        title="beads",
        materials=(GLASS, STEEL),
        bodies=(Body("bead", "glass", 1.0, bead, GLASS.density),),
        pairs=(Pair("bead", "bead", 0.3, 0.5), Pair("bead", "steel", 0.3, 0.5)),
        rig=Funnel(wall="steel", mass=beads * MASS),
        insertion=Insertion(rate=0.1),
    )
