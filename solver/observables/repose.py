"""Angle of repose by the image method: silhouette → outline → least-squares line per flank.

The window of a flank goes from the outermost column that reaches the floor (20 % of the height) to the
outermost column that reaches the ceiling (80 %). The line is fitted through the tops of *all* columns
between the two, height on position. "A least-squares line from the outermost point at 20 % to the outermost
point at 80 %" can be read in other ways; this one reproduces the angles that an independent program gave
for 24 piles of 262 three-sphere bodies: mean difference 0.02°, standard deviation 0.09°. Lines through the
outermost point of every row differ from it by 1.1 ± 1.4° (height on position) and 2.7 ± 1.8° (position on
height).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from solver.observables.silhouette import Image, column_tops

Array = npt.NDArray[np.float64]

AZIMUTHS_DEG = tuple(float(azimuth) for azimuth in range(0, 180, 15))
FLOOR = 0.20
CEILING = 0.80


def flank_angles_deg(image: Image, pixel: float, lowest: float = 0.0) -> tuple[float, float]:
    """Angles of the left and the right flank of a silhouette [°]; NaN for a flank that cannot be fitted.

    ``image``: the pile alone (see :func:`~solver.observables.silhouette.largest_part`), row 0 on the plate;
    ``pixel`` [m]; ``lowest`` [m] raises the floor of the window to max(20 % of the height, ``lowest``), so
    that a skirt one body thick stays out of the fit.
    """
    tops = (column_tops(image) * pixel).astype(np.float64)
    return _right_flank_deg(tops[::-1], pixel, lowest), _right_flank_deg(tops, pixel, lowest)


def _right_flank_deg(tops: Array, pixel: float, lowest: float) -> float:
    """Angle of the flank on the right of an outline ``tops`` [m], shape (columns,)."""
    if tops.size == 0:
        return float("nan")
    height = tops.max()
    # Tops are whole pixels: a billionth of the height keeps rounding from deciding whether a column is in.
    slack = 1e-9 * height
    floor, ceiling = max(FLOOR * height, lowest) - slack, CEILING * height - slack
    if not floor < ceiling:
        return float("nan")
    outer = int(np.flatnonzero(tops >= floor)[-1])
    inner = int(np.flatnonzero(tops >= ceiling)[-1])
    if outer - inner < 2:  # fewer than three columns: no line
        return float("nan")
    z = tops[inner : outer + 1]
    x = pixel * np.arange(z.size)
    x -= x.mean()
    return float(np.degrees(np.arctan(-(x @ z) / (x @ x))))
