"""Box–Behnken designs: three levels per factor, no corners of the cube, enough for a full second-order model.

Source: Box and Behnken 1960, Technometrics 2:455. For 3, 4 and 5 factors the design is the 2 x 2 factorial on
every pair of factors with the others at zero, plus centre runs. For 6 and 7 factors it is the 2 x 2 x 2 factorial
on the published triples: for 7 a balanced incomplete block design, in which every pair occurs once, for 6 a
partially balanced one, in which every factor occurs three times.

Orthogonal blocks (same source): 4 factors have three, each with two pairs that share no factor; 5 have two, each with
pairs that form a ring; 6 and 7 have two, the halves of every 2 x 2 x 2 by the sign of the product of its levels. Every
factor then varies equally often in every block, and every two-factor product sums to zero in each. With 3 factors there
are none: a block would hold part of a 2 x 2 factorial, whose interaction would be confounded with the block.
"""

from __future__ import annotations

from itertools import combinations, product

import numpy as np
import numpy.typing as npt

from doe.designs.design import Design, DesignOptions, Points
from doe.errors import StatisticsError

TRIPLES = {
    6: ((0, 1, 3), (1, 2, 4), (2, 3, 5), (0, 3, 4), (1, 4, 5), (0, 2, 5)),
    7: ((3, 4, 5), (0, 5, 6), (1, 4, 6), (0, 1, 3), (2, 3, 6), (0, 2, 4), (1, 2, 5)),
}
"""Number of factors → indices of the factors that vary together."""
CENTRE_RUNS = 5
"""Default number of centre runs."""
BLOCKS = {4: 3, 5: 2, 6: 2, 7: 2}
"""Number of factors → number of orthogonal blocks."""
BLOCK_OF_PAIR = {4: (0, 1, 2, 2, 1, 0), 5: (0, 0, 1, 1, 1, 1, 0, 0, 1, 0)}
"""Number of factors → block of each pair, in the order AB, AC, …."""
CENTRE_IN_BLOCKS = {4: 1, 5: 3, 6: 3, 7: 3}
"""Number of factors → default number of centre runs in each block."""


def box_behnken(factors: int = 3, centre: int = CENTRE_RUNS) -> npt.NDArray[np.int64]:
    """Return the design as levels -1, 0, +1, shape (edges + centre, factors); centre runs come last.

    12, 24, 40, 48 and 56 edge points for 3 to 7 factors. Raises StatisticsError for factors outside 3..7 or
    centre < 1 (without a centre run the squares add up to a constant).
    """
    if factors not in range(3, 8):
        raise StatisticsError(f"factors = {factors}: Box–Behnken designs are made for 3 to 7 factors")
    if centre < 1:
        raise StatisticsError(f"centre = {centre}: at least one centre run is needed")
    edges = []
    for moved in TRIPLES.get(factors, tuple(combinations(range(factors), 2))):
        for levels in product((-1, 1), repeat=len(moved)):
            point = np.zeros(factors, dtype=np.int64)
            point[list(moved)] = levels
            edges.append(point)
    return np.vstack([*edges, np.zeros((centre, factors), dtype=np.int64)])


def block_of_edges(factors: int, blocks: int) -> npt.NDArray[np.int64]:
    """Return the block, from 0, of each edge point of `box_behnken`, shape (edges,).

    Raises StatisticsError, which names the allowed number of blocks, for any other number.
    """
    if blocks != BLOCKS.get(factors):
        allowed = BLOCKS.get(factors, "none, as no number of blocks is orthogonal")
        raise StatisticsError(f"blocks = {blocks}; allowed: {allowed} for a Box–Behnken design of {factors} factors")
    if factors in BLOCK_OF_PAIR:
        return np.repeat(BLOCK_OF_PAIR[factors], 4)
    signs = [np.prod(levels) for _ in TRIPLES[factors] for levels in product((-1, 1), repeat=3)]
    return (np.array(signs) > 0).astype(np.int64)


class BoxBehnken(Design):
    """Three levels per factor, no corners."""

    name = "box-behnken"
    title = "Box–Behnken"
    doc = "A full second-order model of 3 to 7 factors, without the corners of the cube."
    options = ("centre", "blocks")

    def points(self, factors: int, options: DesignOptions) -> Points:
        """Edge points, then centre runs; with blocks, each block has the same number of centre runs."""
        if options.blocks is None:
            design = box_behnken(factors, CENTRE_RUNS if options.centre is None else options.centre)
            return Points(design.astype(np.float64))
        of_edge = block_of_edges(factors, options.blocks)
        centre = CENTRE_IN_BLOCKS[factors] if options.centre is None else options.centre
        return Points(
            box_behnken(factors, centre * options.blocks).astype(np.float64),
            traits=(f"{options.blocks} blocks",),
            block=np.concatenate([of_edge, np.repeat(np.arange(options.blocks), centre)]),
        )
