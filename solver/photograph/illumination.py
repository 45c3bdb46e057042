"""The light on the backdrop: a quadratic surface through what surrounds the pile, and the noise about it.

It starts from the upper rim of the picture, where a whole pile cannot be, and grows downward over every pixel that
follows the surface, so that a slanting or falling-off light is no threshold's business any more.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Image = npt.NDArray[np.bool_]

DOWN_TO = (0.0, 0.0, 0.4, 0.55, 0.7, 0.85, 1.0, 1.0)
"""Share of the rows, from the top, over which the surface is fitted, round by round; 0: the rim alone."""
FEWEST_LEVELS = 4.0
"""Grey levels by which backdrop may miss the surface, however little noise there is."""
NORMAL = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""


@dataclass(frozen=True, eq=False)
class Illumination:
    """Grey levels of the backdrop, also where something stands before it."""

    surface: Array
    """Shape of the picture."""
    noise: float
    """Standard deviation of a pixel of the backdrop about the surface."""


def illumination(grey: Array) -> Illumination:
    """The backdrop of ``grey`` (0 … 255, row 0 on top)."""
    terms = _terms(grey.shape)
    flat, seen = grey.ravel(), _rim(grey.shape).ravel()
    surface = np.full(flat.shape, np.median(flat[seen]))
    rows = np.repeat(np.arange(grey.shape[0]) / grey.shape[0], grey.shape[1])
    scale = np.inf
    for round_, share in enumerate(DOWN_TO):
        residual = np.abs(flat - surface)
        # The first constant follows no slanting light: every pixel of the rim counts then.
        chosen = (seen | (rows < share)) & (residual <= max(3.0 * scale, FEWEST_LEVELS))
        k = 3 if round_ == 0 else terms.shape[1]
        coefficients = np.linalg.lstsq(terms[chosen, :k], flat[chosen], rcond=None)[0]
        surface = terms[:, :k] @ coefficients
        scale = NORMAL * float(np.median(np.abs(flat - surface)[chosen]))
    residual = np.abs(flat - surface)
    noise = NORMAL * float(np.median(residual[residual <= max(4.0 * scale, FEWEST_LEVELS)]))
    return Illumination(surface.reshape(grey.shape), noise)


def _terms(shape: tuple[int, ...]) -> Array:
    y, x = np.meshgrid(np.linspace(-1, 1, shape[0]), np.linspace(-1, 1, shape[1]), indexing="ij")
    return np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=-1).reshape(-1, 6)


def _rim(shape: tuple[int, ...]) -> Image:
    """The upper sixth, and the sides of the upper half."""
    rim = np.zeros(shape, dtype=bool)
    side = max(2, shape[1] // 12)
    rim[: max(2, shape[0] // 6)] = True
    rim[: shape[0] // 2, :side] = rim[: shape[0] // 2, -side:] = True
    return rim
