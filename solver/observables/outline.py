"""A pile as one view sees it: the outline of its silhouette and the lines that the angle of repose is read from.

What the image method fits and what a screen draws are the same: both come from
:func:`~solver.observables.repose.flank_lines`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from solver.observables.repose import FlankLine, flank_lines
from solver.observables.silhouette import PIXEL, Image, column_tops, largest_part, left_edge, silhouette

if TYPE_CHECKING:
    from solver.record import Spheres

Array = npt.NDArray[np.float64]

Flanks = tuple[FlankLine | None, FlankLine | None]


@dataclass(frozen=True, eq=False)
class Outline:
    """A silhouette over its horizontal axis u = x cos(azimuth) + y sin(azimuth), the plate at z = 0."""

    azimuth_deg: float
    u: Array
    """Middles of the columns of pixels [m], shape (columns,)."""
    top: Array
    """Highest covered point of the pile, the largest part of the silhouette, per column [m]; 0 beside it."""
    flanks: Flanks
    """Lines of the left and the right flank, their ``u`` on the same axis as the columns; None: no fit."""


def outline(spheres: Spheres, azimuth_deg: float, pixel: float = PIXEL) -> Outline:
    """Outline and flank lines of the pile of ``spheres`` from one azimuth [°]; ``pixel`` [m]."""
    image = largest_part(silhouette(spheres, azimuth_deg, pixel))
    return outline_of(image, left_edge(spheres, azimuth_deg, pixel), azimuth_deg, pixel)


def outline_of(image: Image, left: float, azimuth_deg: float, pixel: float = PIXEL) -> Outline:
    """The same from the pile's part of a silhouette whose left edge is at u = ``left`` [m]."""
    lines = flank_lines(image, pixel)
    middles: Array = left + pixel * (np.arange(image.shape[1], dtype=np.float64) + 0.5)
    return Outline(
        azimuth_deg,
        middles,
        (column_tops(image) * pixel).astype(np.float64),
        (_moved(lines[0], left), _moved(lines[1], left)),
    )


def flank_feet(flanks: tuple[FlankLine, FlankLine]) -> tuple[float, float]:
    """Where the lines of the left and the right flank reach the plate, on the axis of their ``u``."""
    left, right = flanks
    return left.u[1] - left.z[1] / left.slope, right.u[1] + right.z[1] / right.slope


def _moved(line: FlankLine | None, left: float) -> FlankLine | None:
    return line and FlankLine((line.u[0] + left, line.u[1] + left), line.z, line.slope)
