"""Photographs of a condition's piles → the view that they show, by the estimator of our runs.

images = ["slow_1.jpg", "slow_2.jpg"]          of replicate 1, 2, …; or, instead of a name, a table:
    file                     beside measurement.toml
    replicate                the place in the list where it is not stated
    azimuth                  of the view [°], 0 (along +y) where it is not stated
    pixel                    length of a pixel, such as "0.12mm": then the height is read as well
    base_line                [y at the left edge, y at the right edge] of the plate, in pixels from the top

A picture gives ``angle_of_repose_deg@<azimuth>``, one view as a simulated pile has it too, and with ``pixel``
``apex_height_m``. Left and right alone are not taken: they add nothing to their mean but the difference between them,
and which side is which depends on where the camera stood.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from doe.errors import MeasurementError
from doe.studies.study_table import Table, number, only, required, whole
from solver import PhotographedPile, PhotographError, open_picture, parse_quantity, read_photograph

Array = npt.NDArray[np.float64]
Values = dict[str, tuple[Array | None, Array]]

KEYS = ("file", "replicate", "azimuth", "pixel", "base_line")
HEIGHT = "apex_height_m"


def photograph_entries(given: Any) -> list[Table]:
    """``images`` of a condition as tables, each with its replicate; MeasurementError in one line."""
    if not isinstance(given, list):
        raise MeasurementError(f"images: {given!r}; allowed: a list of file names or tables")
    found = []
    for place, one in enumerate(given, start=1):
        entry: Any = {"file": one} if isinstance(one, str) else one
        if not isinstance(entry, dict):
            raise MeasurementError(f"images: {one!r}; allowed: a file name or a table of {', '.join(KEYS)}")
        only(entry, KEYS, "images")
        required(entry, ("file",), "images")
        found.append({"replicate": place, **entry})
    return found


def photograph_values(folder: Path, entries: list[Table]) -> tuple[Values, tuple[str, ...]]:
    """Name → (None, values per replicate) of every picture, and a line for each that shows no pile to read.

    Replicates without a picture are NaN. MeasurementError in one line for a picture that cannot be opened.
    """
    single: dict[tuple[str, int], float] = {}
    ignored = []
    for entry in entries:
        replicate = whole(entry["replicate"], "images.replicate", 1)
        view = f"angle_of_repose_deg@{number(entry.get('azimuth', 0), 'images.azimuth') % 360.0:g}"
        if (view, replicate) in single:
            raise MeasurementError(f"images: two of replicate {replicate} and one azimuth; allowed: one")
        read = _read(folder / str(entry["file"]), entry)
        if isinstance(read, str):
            ignored.append(read)
            single[view, replicate] = np.nan
            continue
        single[view, replicate] = read.angles.mean.value_deg
        if "pixel" in entry:
            single.setdefault((HEIGHT, replicate), read.height)
    replicates = max((replicate for _, replicate in single), default=0)
    values: Values = {}
    for (name, replicate), reading in single.items():
        values.setdefault(name, (None, np.full(replicates, np.nan)))[1][replicate - 1] = reading
    return values, tuple(ignored)


def _read(path: Path, entry: Table) -> PhotographedPile | str:
    """What the picture shows, or a line on why it shows no pile."""
    pixel = None if "pixel" not in entry else parse_quantity(entry["pixel"], "m", "images.pixel")
    if pixel is not None and pixel <= 0.0:
        raise MeasurementError(f"images.pixel: {pixel:g} m; allowed: more than 0")
    base = entry.get("base_line")
    if base is not None and (not isinstance(base, list) or len(base) != 2):
        raise MeasurementError(f"images.base_line: {base!r}; allowed: a list of 2 numbers")
    line = None if base is None else (number(base[0], "images.base_line"), number(base[1], "images.base_line"))
    try:
        read = read_photograph(open_picture(path), pixel, line)
    except PhotographError as error:
        raise MeasurementError(str(error)) from None
    return read if isinstance(read, PhotographedPile) else f"{read.name}: no angle: {read.reason}: {read.detail}"
