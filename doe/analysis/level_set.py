"""Where a second-order model takes a given value inside the coded cube, for many models at once.

On a line parallel to an axis the model is a quadratic in one unknown, so its crossings with the target are
exact roots. A grid of such lines samples the whole surface {x : model(x) = target}, and finer grids around
the best point find the one nearest to a reference. The extremes of the model over the cube lie at stationary
points of its faces, which are solutions of linear systems. Everything is deterministic and needs no starting values.
`models` = leading axis, one entry per coefficient set.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
import numpy.typing as npt

from doe.analysis.surface import quadratic_form, second_order_terms

FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

COARSE_LINES = 15
COARSE_LINES_4 = 9
"""The same for four or more factors, whose lines form a grid of three or more dimensions."""
FINE_LINES = 7
REFINEMENTS = 19
BLOCK = 5_000_000
"""Number of coordinates held in memory at once; more models are processed in blocks."""


@dataclass(frozen=True)
class Extremes:
    """Lowest and highest value of each model over the cube, shape (models,), and where, shape (models, k)."""

    low: FloatArray
    low_at: FloatArray
    high: FloatArray
    high_at: FloatArray


def extremes(coefficients: FloatArray, k: int) -> Extremes:
    """Return the exact extremes over [-1, 1]^k of models with coefficients of shape (models, p).

    On a face some coordinates are fixed at -1 or +1; the free ones F solve 2 B_FF x_F = -(b_F + 2 B_FX x_X).
    A singular face has no isolated extremum: its extreme values also occur on its boundary, which is another
    face.
    """
    _, b, matrix = quadratic_form(coefficients, k)
    candidates = []
    for face in product((-1.0, 0.0, 1.0), repeat=k):
        point = np.tile(np.array(face), (coefficients.shape[0], 1))
        free = np.flatnonzero(np.array(face) == 0)
        if free.size:
            block = 2 * matrix[:, free][:, :, free]
            pull = b[:, free] + 2 * np.einsum("mfx,mx->mf", matrix[:, free], point)
            singular = np.abs(np.linalg.det(block)) <= 1e-14 * np.abs(block).max(axis=(1, 2)) ** free.size
            block[singular] = np.eye(free.size)
            point[:, free] = np.linalg.solve(block, -pull[..., None])[..., 0]
            # Any point of the cube is a harmless candidate: a corner replaces a missing stationary point.
            outside = singular | (np.abs(point) > 1).any(axis=1)
            point[outside] = 1.0
        candidates.append(point)
    points = np.stack(candidates, axis=1)
    values = np.einsum("mcp,mp->mc", second_order_terms(points), coefficients)
    models, least, most = np.arange(len(values)), values.argmin(axis=1), values.argmax(axis=1)
    return Extremes(values[models, least], points[models, least], values[models, most], points[models, most])


def nearest_points(
    coefficients: FloatArray,
    target: float | FloatArray,
    reference: FloatArray,
    scale: FloatArray,
    refinements: int = REFINEMENTS,
) -> tuple[FloatArray, BoolArray]:
    """Return, per model, the point of {model = target} nearest to the reference, and whether the target is
    reached.

    coefficients: shape (models, p). target: one for all models, or shape (models,). reference: coded, shape
    (k,), may lie outside the cube. scale: shape (k,); the distance is sum ((x_i - reference_i)/scale_i)^2.
    If the model cannot reach the target, the point is that of the extreme nearest in value. Returns shapes (models,
    k) and (models,). Accuracy about 1e-6 in coded units; each refinement less doubles the error.
    """
    k = reference.size
    block = max(1, BLOCK // (2 * k * k * _coarse_lines(k) ** (k - 1)))
    targets = np.broadcast_to(np.asarray(target, dtype=np.float64), len(coefficients))
    parts = [
        _nearest_of_block(
            coefficients[start : start + block], targets[start : start + block], reference, scale, refinements
        )
        for start in range(0, len(coefficients), block)
    ]
    return np.concatenate([points for points, _ in parts]), np.concatenate([reached for _, reached in parts])


def _coarse_lines(k: int) -> int:
    return COARSE_LINES if k < 4 else COARSE_LINES_4


def _nearest_of_block(
    coefficients: FloatArray, target: FloatArray, reference: FloatArray, scale: FloatArray, refinements: int
) -> tuple[FloatArray, BoolArray]:
    k = reference.size
    bounds = extremes(coefficients, k)
    reached = (bounds.low <= target) & (target <= bounds.high)
    low_is_nearer = np.abs(bounds.low - target) < np.abs(bounds.high - target)
    best = np.where(low_is_nearer[:, None], bounds.low_at, bounds.high_at)
    distance = np.full(len(best), np.inf)
    centre, radius, lines = np.zeros_like(best), 1.0, _coarse_lines(k)
    for _ in range(refinements):
        points, valid = crossings(coefficients, target, centre, radius, lines)
        lengths = np.where(valid, (((points - reference) / scale) ** 2).sum(axis=-1), np.inf)
        nearest = lengths.argmin(axis=1)
        models = np.arange(len(best))
        closer = lengths[models, nearest] < distance
        best[closer] = points[models, nearest][closer]
        distance[closer] = lengths[models, nearest][closer]
        # The next grid reaches one and a half lines of this one to each side of the best point.
        centre, radius, lines = best, 3 * radius / (lines - 1), FINE_LINES
    return best, reached


def crossings(
    coefficients: FloatArray, target: float | FloatArray, centre: FloatArray, radius: float, lines: int
) -> tuple[FloatArray, BoolArray]:
    """Return the points where lines parallel to each axis meet {model = target} within the cube.

    target: one for all models, or shape (models,). The lines stand on a grid of `lines` per other axis, centre
    +- radius cut to [-1, 1]. centre: shape (models, k). Returns points, shape (models, 2 k lines^(k-1), k), and
    which of them are real crossings inside the cube.
    """
    k = centre.shape[1]
    b0, b, matrix = quadratic_form(coefficients, k)
    offsets = radius * np.array(list(product(np.linspace(-1, 1, lines), repeat=k - 1)))
    points, valid = [], []
    for axis in range(k):
        others = [j for j in range(k) if j != axis]
        stand = np.zeros((len(centre), len(offsets), k))
        stand[..., others] = np.clip(centre[:, None, others] + offsets, -1, 1)
        curve = matrix[:, axis, axis][:, None]
        slope = b[:, axis, None] + 2 * np.einsum("mj,mgj->mg", matrix[:, axis], stand)
        level = b0[:, None] + ((stand @ matrix + b[:, None]) * stand).sum(axis=-1) - np.reshape(target, (-1, 1))
        for root in _real_roots(curve, slope, level):
            point = stand.copy()
            point[..., axis] = root
            points.append(point)
            valid.append(np.abs(root) <= 1)
    return np.concatenate(points, axis=1), np.concatenate(valid, axis=1)


def _real_roots(a: FloatArray, b: FloatArray, c: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return both real roots of a x^2 + b x + c, free of cancellation; NaN or infinite where there is none."""
    with np.errstate(invalid="ignore", divide="ignore"):
        q = -(b + np.copysign(np.sqrt(b**2 - 4 * a * c), b)) / 2
        return q / a, c / q
