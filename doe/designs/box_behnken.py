"""Box–Behnken designs: three levels per factor, no corners of the cube, enough for a full second-order model.

Source: Box and Behnken 1960, Technometrics 2:455. For 3, 4 and 5 factors the design is the 2 x 2 factorial on
every pair of factors with the others at zero, plus centre runs. From 6 factors on the published blocks are
not all pairs.
"""

from __future__ import annotations

from itertools import combinations, product

import numpy as np
import numpy.typing as npt

from doe.errors import StatisticsError


def box_behnken(factors: int = 3, centre: int = 5) -> npt.NDArray[np.int64]:
    """Return the design as levels -1, 0, +1, shape (2 factors (factors - 1) + centre, factors); centre runs
    come last.

    Raises StatisticsError for factors outside 3..5 or centre < 1 (without a centre run the squares are
    singular).
    """
    if factors not in (3, 4, 5):
        raise StatisticsError(f"factors = {factors}: Box–Behnken designs are made for 3, 4 or 5 factors")
    if centre < 1:
        raise StatisticsError(f"centre = {centre}: at least one centre run is needed")
    edges = []
    for i, j in combinations(range(factors), 2):
        for level_i, level_j in product((-1, 1), repeat=2):
            point = np.zeros(factors, dtype=np.int64)
            point[i], point[j] = level_i, level_j
            edges.append(point)
    return np.vstack([*edges, np.zeros((centre, factors), dtype=np.int64)])
