"""Bodies are heavier or lighter than declared, for instance by moisture.

    ρ → (1 + x) ρ,   mass and inertia in proportion;   the poured mass is kept, with 1/(1 + x) times as many bodies

Vanishes for x → 0. x = M − M₀ represents a moisture content (dry basis) of M instead of M₀ without swelling.
"""

from dataclasses import dataclass, replace
from typing import Any

from solver.effects.effect import SetUpEffect, Telltale
from solver.params import param
from solver.scenes.body import Body, Members


@dataclass(frozen=True)
class DensityError(SetUpEffect):
    """Relative error of the bodies' density; ``excess`` is the amplitude.

    The poured mass stays, and with it goes the number of bodies; in a drum the filled volume stays, and the number.
    """

    excess: float = param(0.0, low=-0.5, high=1.0, doc="Relative excess x of the density.")

    name = "density_error"
    amplitudes = ("excess",)
    strongest = 0.3
    literature = "moisture of stored seeds 5–25 % dry basis; density by displacement within 5 %"
    lever = "weigh a counted number of bodies"
    telltales = (Telltale.PACKING,)

    def applied(self, scene: Any) -> Any:
        """``scene`` with a changed density of all materials of which bodies are made."""
        factor = 1.0 + self.excess
        made_of = {body.material for body in scene.bodies}
        materials = tuple(
            replace(material, density=factor * material.density) if material.name in made_of else material
            for material in scene.materials
        )
        return replace(scene, materials=materials, bodies=tuple(_heavier(body, factor) for body in scene.bodies))


def _heavier(body: Body, factor: float) -> Body:
    if isinstance(body.shape, Members) and body.shape.density is None:
        x, y, z = (factor * moment for moment in body.shape.inertia)
        shape = replace(body.shape, mass=factor * body.shape.mass, inertia=(x, y, z))
        return replace(body, shape=shape, density=factor * body.density)
    return replace(body, density=factor * body.density)
