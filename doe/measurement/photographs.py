"""Photographs of a condition's piles → the view that they show, read by the same estimator as our runs.

``images`` of a condition lists a file name for replicate 1, 2, …, or a :class:`PhotographTable` in its place.

A picture gives ``angle_of_repose_deg@<azimuth>``, a view that a simulated pile has as well, and with ``pixel`` also
``apex_height_m``. The left and right angles are not used separately: beyond their mean they add only the difference
between them, and which side is which depends on where the camera stood.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import numpy.typing as npt

from doe.errors import MeasurementError
from solver import (
    Number,
    PhotographedPile,
    PhotographError,
    Quantity,
    TomlTable,
    Vector,
    Whole,
    open_picture,
    read_photograph,
)

Array = npt.NDArray[np.float64]
Values = dict[str, tuple[Array | None, Array]]

HEIGHT = "apex_height_m"


class PhotographTable(TomlTable):
    """One picture."""

    file: str
    """File name, beside measurement.toml."""
    replicate: Annotated[int, Whole(1)] | None = None
    """Number of the replicate; by default the place in the list."""
    azimuth: Annotated[float, Number()] = 0.0
    """Azimuth of the view [°]; 0 looks along +y."""
    pixel: Annotated[float, Quantity("m", above=0.0)] | None = None
    """Size of a pixel; needed to read heights."""
    base_line: Annotated[tuple[float, float], Vector(2)] | None = None
    """Rows of the plate's surface at the left and right edges, in pixels from the top."""


def photograph_values(folder: Path, images: Sequence[PhotographTable]) -> tuple[Values, tuple[str, ...]]:
    """Return name → (None, values per replicate) over all pictures, and a line for each without a readable pile.

    Replicates without a picture are NaN. Raises MeasurementError with one line for a picture that cannot be opened.
    """
    single: dict[tuple[str, int], float] = {}
    ignored = []
    for place, image in enumerate(images, start=1):
        replicate = image.replicate or place
        view = f"angle_of_repose_deg@{image.azimuth % 360.0:g}"
        if (view, replicate) in single:
            raise MeasurementError(
                f"images: two photographs of replicate {replicate} at azimuth {image.azimuth:g}; allowed: one"
            )
        read = _read(folder / image.file, image)
        if isinstance(read, str):
            ignored.append(read)
            single[view, replicate] = np.nan
            continue
        single[view, replicate] = read.angles.mean.value_deg
        if image.pixel is not None:
            single.setdefault((HEIGHT, replicate), read.height)
    replicates = max((replicate for _, replicate in single), default=0)
    values: Values = {}
    for (name, replicate), reading in single.items():
        values.setdefault(name, (None, np.full(replicates, np.nan)))[1][replicate - 1] = reading
    return values, tuple(ignored)


def _read(path: Path, image: PhotographTable) -> PhotographedPile | str:
    """The pile in the picture, or a line on why none can be read."""
    try:
        read = read_photograph(open_picture(path), image.pixel, image.base_line)
    except PhotographError as error:
        raise MeasurementError(str(error)) from None
    return read if isinstance(read, PhotographedPile) else f"{read.name}: no angle: {read.reason}: {read.detail}"
