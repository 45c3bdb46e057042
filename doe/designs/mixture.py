"""Mixture designs: the factors are parts that add up to a whole, so that no part can be changed alone.

z_i = (x_i - low_i)/(total - sum of the lows) is the share of a part in the amount above the lows (pseudocomponent),
0 … 1 with the sum 1; with lows of zero it is the share in the whole. The simplex lattice {q, m} has every blend of q
parts in steps of 1/m; the simplex centroid has every part alone and all blends of equal shares of two, three, … parts.
Source: Scheffé 1958, J. Roy. Stat. Soc. B 20:344; Scheffé 1963, J. Roy. Stat. Soc. B 25:235; Cornell 2002, Experiments
with Mixtures.
"""

from __future__ import annotations

import math
from itertools import combinations, combinations_with_replacement

import numpy as np

from doe.designs.design import Design, DesignOptions, FloatArray, Points
from doe.errors import StatisticsError

MOST_BLENDS = 20_000


def simplex_lattice(parts: int, degree: int) -> FloatArray:
    """Return the blends in steps of 1/degree, shape (C(parts + degree - 1, degree), parts); pure parts first.

    Raises StatisticsError for fewer than two parts, a degree below 1, or more than 20 000 blends.
    """
    if parts < 2 or degree < 1:
        raise StatisticsError(
            f"lattice = {degree} of {parts} parts; allowed: a degree of at least 1 and at least 2 parts"
        )
    number = math.comb(parts + degree - 1, degree)
    if number > MOST_BLENDS:
        raise StatisticsError(f"lattice = {degree}: {number} blends of {parts} parts; allowed: up to {MOST_BLENDS}")
    counts = np.array(
        [np.bincount(chosen, minlength=parts) for chosen in combinations_with_replacement(range(parts), degree)]
    )
    return np.asarray(counts[np.argsort(-counts.max(axis=1), kind="stable")] / degree)


def simplex_centroid(parts: int) -> FloatArray:
    """Return every part alone, and all blends of equal shares of two, three, … parts, shape (2^parts - 1, parts).

    Raises StatisticsError outside 2..10 parts.
    """
    if not 2 <= parts <= 10:
        raise StatisticsError(f"{parts} parts; allowed in a simplex centroid: 2 to 10")
    blends = [chosen for size in range(1, parts + 1) for chosen in combinations(range(parts), size)]
    return np.array([[float(k in chosen) / len(chosen) for k in range(parts)] for chosen in blends])


class Mixture(Design):
    """Blends of parts that add up to a whole."""

    name = "mixture"
    title = "mixture"
    doc = "Parts that add up to a whole: the simplex centroid, or the lattice of a degree, for Scheffé's polynomials."
    options = ("centre", "lattice")
    mixture = True

    def points(self, factors: int, options: DesignOptions) -> Points:
        """Blends, then ``options.centre`` blends of equal shares; −1 is none of the amount above the lows, +1 all."""
        if options.lattice is None:
            blends, trait = simplex_centroid(factors), "simplex centroid"
        else:
            blends, trait = simplex_lattice(factors, options.lattice), f"simplex lattice of degree {options.lattice}"
        middle = np.full((options.centre or 0, factors), 1 / factors)
        return Points(2 * np.vstack([blends, middle]) - 1, traits=(trait,))
