"""Canonical analysis: where a second-order surface is stationary and how it curves there.

Source: Box and Wilson 1951; Myers, Montgomery and Anderson-Cook 2016, Response Surface Methodology, ch. 6.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from doe.record import Record
from doe.surface import Surface, quadratic_form

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Canonical(Record):
    """Shape of the surface: y = y_s + sum eigenvalue_i w_i^2 about the stationary point.

    stationary_coded, stationary_natural: shape (k,), NaN when the squares are singular; eigenvalues: shape
    (k,), rising; eigenvectors: columns, shape (k, k). kind: "maximum", "minimum", "saddle" or "ridge".
    """

    stationary_coded: FloatArray
    stationary_natural: FloatArray
    stationary_response: float
    inside: bool
    eigenvalues: FloatArray
    eigenvectors: FloatArray
    kind: str


def canonical_analysis(surface: Surface, flat_share: float = 1e-9) -> Canonical:
    """Return stationary point -B^-1 b/2 and the eigenvalues of B.

    An eigenvalue below `flat_share` of the largest coefficient counts as zero: the surface is then a ridge
    without a stationary point.
    """
    k = len(surface.names)
    _, b, matrix = quadratic_form(surface.coefficients, k)
    eigenvalues, eigenvectors = np.linalg.eigh(matrix)
    sizes = np.abs(eigenvalues)
    if sizes.min() <= flat_share * max(sizes.max(), np.abs(b).max()):
        nowhere = np.full(k, math.nan)
        return Canonical(nowhere, nowhere, math.nan, False, eigenvalues, eigenvectors, "ridge")
    point: FloatArray = np.linalg.solve(matrix, -b / 2).astype(np.float64)
    kind = "minimum" if (eigenvalues > 0).all() else "maximum" if (eigenvalues < 0).all() else "saddle"
    return Canonical(
        point,
        surface.region.natural(point),
        float(surface.predict(point)),
        bool((np.abs(point) <= 1).all()),
        eigenvalues,
        eigenvectors,
        kind,
    )
