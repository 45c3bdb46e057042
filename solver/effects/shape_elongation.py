"""Bodies are longer than declared, at the same volume and mass.

    x → (1 + ε) x,   y, z → y, z/√(1 + ε)        along the principal axes, x the longest

A cylinder that is wider than long becomes wider: d → (1 + ε) d, l → l/(1 + ε)².
The dimensions of a solid change in this way; in a body that is declared by spheres, the centres move and the radii stay
the same. Vanishes for ε → 0. The inertia of a solid is computed anew from its dimensions, that of a body of spheres
from its stretched second moments.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from solver.effects.effect import SetUpEffect, Telltale
from solver.params import ParameterError, param
from solver.scenes.body import DIMENSIONS, Body, Members


@dataclass(frozen=True)
class ShapeElongation(SetUpEffect):
    """Elongation at equal volume; ``elongation`` is the amplitude."""

    elongation: float = param(0.0, low=-0.4, high=1.0, doc="Relative elongation ε of the longest axis.")

    name = "shape_elongation"
    amplitudes = ("elongation",)
    strongest = 0.4
    literature = "aspect ratios within a variety scatter by 5–15 %; a mean from few bodies may be off by 0.1–0.4"
    lever = "measure the outline of more bodies; packing density"
    telltales = (Telltale.PACKING,)

    def applied(self, scene: Any) -> Any:
        """``scene`` with every component stretched."""
        return replace(scene, bodies=tuple(self._stretched(body) for body in scene.bodies))

    def _stretched(self, body: Body) -> Body:
        along, across = 1.0 + self.elongation, (1.0 + self.elongation) ** -0.5
        if isinstance(body.shape, Members):
            return replace(body, shape=_stretched_members(body.shape, along, across))
        solid = body.shape
        if solid.kind not in DIMENSIONS or not DIMENSIONS[solid.kind]:
            raise ParameterError(
                f"effect.shape_elongation.elongation: body {body.name} is a mesh, which cannot be stretched; "
                "allowed: 0, or a mesh file of the elongated shape"
            )
        if solid.kind == "sphere":
            size = solid.dimensions[0]
            ellipsoid = replace(solid, kind="ellipsoid", dimensions=(size * along, size * across, size * across))
            return replace(body, shape=ellipsoid)
        longest = int(np.argmax(solid.dimensions))
        if solid.kind == "cylinder" and longest == DIMENSIONS["cylinder"].index("diameter"):
            across = along**-2.0
        stretched = tuple(size * (along if k == longest else across) for k, size in enumerate(solid.dimensions))
        return replace(body, shape=replace(solid, dimensions=stretched))


def _stretched_members(members: Members, along: float, across: float) -> Members:
    moments = np.array(members.inertia)
    squares = moments.sum() / 2.0 - moments  # ∫ x², ∫ y², ∫ z² over the mass
    longest = int(np.argmax(squares))
    scale = np.full(3, across)
    scale[longest] = along
    squares = squares * scale**2
    centres = np.array(members.centres) * scale
    x, y, z = (float(moment) for moment in squares.sum() - squares)
    return replace(
        members,
        centres=tuple((float(a), float(b), float(c)) for a, b, c in centres),
        inertia=(x, y, z),
        drawn=None,
    )
