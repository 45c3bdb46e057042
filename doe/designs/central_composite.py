"""Central composite designs: a two-level factorial, two axial points per factor at ±alpha, and centre runs.

Source: Box and Wilson 1951, J. Roy. Stat. Soc. B 13:1; Box and Hunter 1957, Ann. Math. Stat. 28:195 (rotatability:
alpha = F^(1/4) with F factorial points). From 5 factors on the factorial part is the half fraction of resolution V or
higher, in which no main effect or interaction of two is confused with another.
"""

from __future__ import annotations

import numpy as np

from doe.designs.design import ALPHAS, Alpha, Design, DesignOptions, FloatArray, Points
from doe.designs.factorial import factorial, standard_generators
from doe.errors import StatisticsError

FACTORS = range(2, 8)
HALVED_FROM = 5
CENTRE_RUNS = 5
"""Where nothing else is asked for."""


def central_composite(factors: int, centre: int = CENTRE_RUNS, alpha: Alpha = "rotatable") -> FloatArray:
    """Return the design in coded units, shape (F + 2 factors + centre, factors): factorial, axial, centre points.

    alpha: "rotatable" puts the axial points at F^(1/4), outside the cube; "face-centred" on its faces; "inscribed" is
    the rotatable design shrunk into the cube, its axial points at ±1.
    Raises StatisticsError for factors outside 2..7, centre < 1 or another alpha.
    """
    if factors not in FACTORS:
        raise StatisticsError(f"factors = {factors}: central composite designs are made for 2 to 7 factors")
    if centre < 1:
        raise StatisticsError(f"centre = {centre}: at least one centre run is needed")
    if alpha not in ALPHAS:
        raise StatisticsError(f"alpha = {alpha!r} is not one of {', '.join(ALPHAS)}")
    corners = factorial(factors, standard_generators(factors, 1) if factors >= HALVED_FROM else ()).astype(np.float64)
    distance = 1.0 if alpha == "face-centred" else len(corners) ** 0.25
    axial = np.repeat(np.eye(factors), 2, axis=0) * np.tile([-distance, distance], factors)[:, None]
    design = np.vstack([corners, axial, np.zeros((centre, factors))])
    return design / distance if alpha == "inscribed" else design


class CentralComposite(Design):
    """Corners, axial points and centre runs."""

    name = "central-composite"
    title = "central composite"
    doc = "A full second-order model of 2 to 7 factors: corners, axial points, centre."
    options = ("centre", "alpha")

    def points(self, factors: int, options: DesignOptions) -> Points:
        """Corners, axial points, centre runs."""
        design = central_composite(factors, CENTRE_RUNS if options.centre is None else options.centre, options.alpha)
        return Points(design, traits=(f"{options.alpha}, axial points at ±{np.abs(design).max():.4g}",))
