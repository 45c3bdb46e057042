"""Definitive screening designs: three levels, main effects clear of all two-factor interactions and squares.

Source: Jones and Nachtsheim 2011, J. Quality Technology 43:1, doi:10.1080/00224065.2011.11917841; from conference
matrices as in Xiao, Lin and Bai 2012, J. Quality Technology 44:2, doi:10.1080/00224065.2012.11917877: the rows of C
(m × m, zero diagonal, C'C = (m − 1) I), their mirror images, and a centre run, 2 m + 1 in all. C is Paley's, of
order q + 1 for an odd q that is a prime or the square of one. If m is larger than the number of factors, the spare
columns have no factor; they estimate the error (Jones and Nachtsheim 2017, Technometrics 59:319).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from doe.designs.design import Design, DesignOptions, Points
from doe.errors import StatisticsError

IntArray = npt.NDArray[np.int64]
ORDERS = {4: 3, 6: 5, 8: 7, 10: 9, 12: 11, 14: 13, 18: 17, 20: 19, 24: 23, 26: 25, 30: 29}
"""Order of a conference matrix → q. None exists of order 22; for 16 and 28, q is no prime and no square of a prime."""
CENTRE_RUNS = 1
"""Default number of centre runs."""


def definitive_screening(factors: int, centre: int = CENTRE_RUNS) -> IntArray:
    """Return the design as levels -1, 0, +1, shape (2 m + centre, m): m ≥ factors columns, centre runs last.

    Raises StatisticsError for factors outside 3..30 or centre < 1 (without a centre run the m squares add up to a
    constant).
    """
    if not 3 <= factors <= max(ORDERS):
        raise StatisticsError(
            f"factors = {factors}: definitive screening designs are made for 3 to {max(ORDERS)} factors"
        )
    if centre < 1:
        raise StatisticsError(f"centre = {centre}: at least one centre run is needed")
    c = conference_matrix(next(order for order in ORDERS if order >= factors))
    return np.vstack([c, -c, np.zeros((centre, len(c)), dtype=np.int64)])


def conference_matrix(order: int) -> IntArray:
    """Return Paley's conference matrix for an order in ``ORDERS``, shape (order, order).

    Q_ij = χ(a_i − a_j) over the q elements of the field, bordered by a row and a column of ones (of opposite signs
    if q is 3 modulo 4, since Q is then skew-symmetric).
    """
    q = ORDERS[order]
    elements, minus, is_square = _field(q)
    c = np.zeros((order, order), dtype=np.int64)
    c[0, 1:] = 1
    c[1:, 0] = 1 if q % 4 == 1 else -1
    for i, a in enumerate(elements):
        for j, b in enumerate(elements):
            if i != j:
                c[i + 1, j + 1] = 1 if is_square(minus(a, b)) else -1
    return c


Element = tuple[int, int]


def _field(q: int) -> tuple[list[Element], Callable[[Element, Element], Element], Callable[[Element], bool]]:
    """Return the elements x + y √n of the field of order q = p or p² (n: not a square modulo p), a function for the
    difference of two elements, and one for whether an element is a square.
    """
    root = round(q**0.5)
    p = root if root * root == q else q
    squares = {x * x % p for x in range(p)}
    n = next(x for x in range(p) if x not in squares)
    elements = [(x, y) for y in range(q // p) for x in range(p)]
    powers = {((x * x + n * y * y) % p, 2 * x * y % p) for x, y in elements}
    return elements, lambda a, b: ((a[0] - b[0]) % p, (a[1] - b[1]) % p), lambda a: a in powers


class DefinitiveScreening(Design):
    """2 m + 1 runs at three levels for k ≤ m factors."""

    name = "definitive-screening"
    title = "definitive screening"
    doc = "Three levels: main effects clear of interactions and squares, and curvature, in about 2k runs for k factors."
    options = ("centre",)

    def points(self, factors: int, options: DesignOptions) -> Points:
        """Rows of C, of −C and of zeros."""
        table = definitive_screening(factors, CENTRE_RUNS if options.centre is None else options.centre)
        rows, columns = table.shape
        coded = table.astype(np.float64)
        spare = columns - factors
        traits = (f"{rows} runs", *([f"{spare} column{'s' if spare > 1 else ''} without a factor"] if spare else []))
        return Points(coded[:, :factors], coded[:, factors:], traits)
