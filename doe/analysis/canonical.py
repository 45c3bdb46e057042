"""Where a second-order surface is stationary, how it curves there, and where it is highest and lowest within a radius.

Canonical analysis: the stationary point, and the curvatures along the principal axes.
Source: Box and Wilson 1951; Myers, Montgomery and Anderson-Cook 2016, Response Surface Methodology, ch. 6.

Ridge analysis: the best reachable response on spheres of growing radius about the centre of the region.
On |x| = R the extremes of y = b0 + b'x + x'Bx solve (B - mu I) x = -b/2 (Lagrange); mu above the largest eigenvalue
of B gives the maximum, below the smallest the minimum, and |x(mu)| falls as mu leaves the spectrum.
Source: Hoerl 1959, Chem. Eng. Progress 55:69; Draper 1963, Technometrics 5:469.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import optimize

from doe.analysis.surface import Surface, quadratic_form
from doe.record import Record

FloatArray = npt.NDArray[np.float64]

STEPS = 11


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


@dataclass(frozen=True)
class RidgePath(Record):
    """The path of one extreme: radius (steps,) in coded units; coded, natural (steps, k); predicted with its standard
    error (steps,). kind: "maximum" or "minimum".
    """

    kind: str
    radius: FloatArray
    coded: FloatArray
    natural: FloatArray
    predicted: FloatArray
    standard_error: FloatArray


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


def ridge_analysis(surface: Surface, furthest: float | None = None) -> tuple[RidgePath, RidgePath]:
    """Return the paths of the maximum and of the minimum from the centre to `furthest` (coded).

    By default that is the distance of the furthest run, so that nothing is extrapolated.
    """
    if furthest is None:
        furthest = float(np.linalg.norm(surface.points, axis=1).max())
    radii = np.linspace(0.0, furthest, STEPS)
    _, b, matrix = quadratic_form(surface.coefficients, len(surface.names))
    paths = []
    for kind, sign in (("maximum", 1.0), ("minimum", -1.0)):
        coded = np.array([highest_on_sphere(sign * b, sign * matrix, radius) for radius in radii])
        paths.append(
            RidgePath(
                kind, radii, coded, surface.region.natural(coded), surface.predict(coded), surface.standard_error(coded)
            )
        )
    return paths[0], paths[1]


def highest_on_sphere(b: FloatArray, matrix: FloatArray, radius: float) -> FloatArray:
    """Return the x of |x| = radius with the largest b'x + x'Bx, shape (k,).

    In the axes of B, x_i = c_i/(2 (mu - l_i)). If b has no component along the steepest axis and the other components
    fall short of the radius, mu is the largest eigenvalue and the remainder lies along that axis (either sign will do).
    """
    if radius == 0:
        return np.zeros(b.size)
    eigenvalues, axes = np.linalg.eigh(matrix)
    pull = axes.T @ b / 2
    top = float(eigenvalues[-1])
    scale = max(float(np.abs(eigenvalues).max()), float(np.abs(pull).max()) / radius)
    if scale == 0:
        return radius * axes[:, -1]
    rest = np.abs(eigenvalues - top) > 1e-12 * scale
    if (np.abs(pull[~rest]) <= 1e-12 * scale * radius).all():
        short = np.zeros(b.size)
        short[rest] = pull[rest] / (top - eigenvalues[rest])
        length = float(np.linalg.norm(short))
        if length <= radius:
            short[-1] = np.sqrt(radius**2 - length**2)
            return np.asarray(axes @ short)

    def excess(mu: float) -> float:
        return float(np.linalg.norm(pull / (mu - eigenvalues))) - radius

    # |x| <= |pull|/(mu - top), and at least |pull_i|/(mu - top) for the steepest axes: the root lies between.
    low = top + max(float(np.linalg.norm(pull[~rest])) / radius / 2, 1e-13 * scale)
    mu = optimize.brentq(excess, low, top + 2 * float(np.linalg.norm(pull)) / radius, xtol=1e-15 * scale, rtol=1e-14)
    x = pull / (mu - eigenvalues)
    return np.asarray(axes @ (x * radius / np.linalg.norm(x)))
