"""Central composite designs: a two-level factorial, two axial points per factor at ±alpha, and centre runs.

Source: Box and Wilson 1951, J. Roy. Stat. Soc. B 13:1; Box and Hunter 1957, Ann. Math. Stat. 28:195 (rotatability:
alpha = F^(1/4) with F factorial points). From 5 factors on, the factorial part is the half fraction of resolution V or
higher, in which no main effect or two-factor interaction is aliased with another.

Orthogonal blocks (Box and Hunter 1957, sec. 8): the factorial part is one block or is split by interactions of three or
more factors into 2, 4, … blocks; the axial points are one more block. With n_F centre runs among the F factorial points
and n_A among the 2 k axial ones, the squares are orthogonal to the blocks if alpha² = F (2 k + n_A)/(2 (F + n_F)).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from doe.designs.blocks import possible_blocks
from doe.designs.design import ALPHAS, Alpha, Design, DesignOptions, FloatArray, Points
from doe.designs.factorial import factor_columns, factorial, factorial_blocks, standard_generators
from doe.errors import StatisticsError

IntArray = npt.NDArray[np.int64]
FACTORS = range(2, 8)
HALVED_FROM = 5
CENTRE_RUNS = 5
"""Default number of centre runs without blocks."""
CENTRE_IN_BLOCKS = {2: (3, 3), 3: (4, 2), 4: (4, 2), 5: (6, 1), 6: (8, 2), 7: (8, 4)}
"""Factors → default number of centre runs, in all factorial blocks together and in the axial one: with them, alpha is
that of rotatability (2, 4, 5 and 7 factors) or within 3 % of it."""


def central_composite(factors: int, centre: int = CENTRE_RUNS, alpha: Alpha = "rotatable") -> FloatArray:
    """Return the design in coded units, shape (F + 2 factors + centre, factors): factorial, axial, centre points.

    alpha: "rotatable" puts the axial points at F^(1/4), outside the cube; "face-centred" on its faces; "inscribed" is
    the rotatable design scaled to fit into the cube, with its axial points at ±1.
    Raises StatisticsError for factors outside 2..7, centre < 1 or another alpha.
    """
    if factors not in FACTORS:
        raise StatisticsError(f"factors = {factors}: central composite designs are made for 2 to 7 factors")
    if centre < 1:
        raise StatisticsError(f"centre = {centre}: at least one centre run is needed")
    if alpha not in ALPHAS:
        raise StatisticsError(f"alpha = {alpha!r} is not one of {', '.join(ALPHAS)}")
    corners = factorial(factors, _generators(factors)).astype(np.float64)
    distance = 1.0 if alpha == "face-centred" else len(corners) ** 0.25
    design = np.vstack([corners, _axial(factors, distance), np.zeros((centre, factors))])
    return design / distance if alpha == "inscribed" else design


def central_composite_blocks(
    factors: int, blocks: int, centre: int | None = None, alpha: Alpha = "rotatable"
) -> tuple[FloatArray, IntArray]:
    """Return the design as `central_composite` does, and the block of each row, counted from 0: the factorial blocks
    come first, the axial block is the last.

    centre: centre runs in each block; None: as many as bring alpha near that of rotatability. alpha: "inscribed" scales
    the design to fit into the cube. Raises StatisticsError if the blocks cannot be orthogonal, for face-centred axial
    points, without centre runs, or for numbers of factors other than 2 to 7.
    """
    if factors not in FACTORS:
        raise StatisticsError(f"factors = {factors}: central composite designs are made for 2 to 7 factors")
    if alpha not in ("rotatable", "inscribed"):
        raise StatisticsError(
            f"alpha = {alpha!r}: the blocks set the axial distance; allowed: rotatable (nearly) or inscribed"
        )
    generators, parts = _generators(factors), blocks - 1
    try:
        corners = factorial(factors, generators).astype(np.float64)
        split = factorial_blocks(factors, generators, parts, clear=2).of_row if parts != 1 else np.zeros(len(corners))
    except StatisticsError:
        allowed = ", ".join(str(one + 1) for one in (1, *possible_blocks(factor_columns(factors, generators), 2)))
        raise StatisticsError(
            f"blocks = {blocks}; allowed for a central composite design of {factors} factors: {allowed} "
            "(the last block holds the axial points)"
        ) from None
    in_cube, in_axial = CENTRE_IN_BLOCKS[factors] if centre is None else (centre * parts, centre)
    if in_cube + in_axial < 1:
        raise StatisticsError(f"centre = {centre}: at least one centre run is needed")
    distance = np.sqrt(len(corners) * (2 * factors + in_axial) / (2 * (len(corners) + in_cube)))
    design = np.vstack([corners, _axial(factors, distance), np.zeros((in_cube + in_axial, factors))])
    block = [split.astype(np.int64), np.full(2 * factors, parts), np.repeat(np.arange(parts), in_cube // parts)]
    scale = distance if alpha == "inscribed" else 1.0
    return design / scale, np.concatenate([*block, np.full(in_axial, parts)])


def _generators(factors: int) -> tuple[str, ...]:
    return standard_generators(factors, 1) if factors >= HALVED_FROM else ()


def _axial(factors: int, distance: float) -> FloatArray:
    return np.repeat(np.eye(factors), 2, axis=0) * np.tile([-distance, distance], factors)[:, None]


class CentralComposite(Design):
    """Corners, axial points and centre runs."""

    name = "central-composite"
    title = "central composite"
    doc = "A full second-order model of 2 to 7 factors: corners, axial points, centre."
    options = ("centre", "alpha", "blocks")

    def points(self, factors: int, options: DesignOptions) -> Points:
        """Corners, axial points and centre runs; in blocks, their number in each or ``CENTRE_IN_BLOCKS``."""
        if options.blocks is not None:
            design, block = central_composite_blocks(factors, options.blocks, options.centre, options.alpha)
            furthest = np.abs(design[:, 0]).max() / np.abs(design[0, 0])
            rotatable = (2 ** (factors - len(_generators(factors)))) ** 0.25
            said = f"axial points at ±{furthest:.4g} of the corners (rotatable at {rotatable:.4g})"
            return Points(design, traits=(f"{options.blocks} blocks", options.alpha, said), block=block)
        design = central_composite(factors, CENTRE_RUNS if options.centre is None else options.centre, options.alpha)
        return Points(design, traits=(f"{options.alpha}, axial points at ±{np.abs(design).max():.4g}",))
