"""How many spheres for a mesh: the numbers that are shown, and the fewest that are good enough."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from solver.shapes.clump import DEMANDS
from solver.shapes.clump_error import SphereError, sphere_error
from solver.shapes.solid import Solid, mass_properties
from solver.shapes.sphere_number import doubling, fitted

Array = npt.NDArray[np.float64]

QUARTERS = 4


@dataclass(frozen=True, eq=False)
class Fitted:
    """Member spheres in the principal frame [m] and what they get wrong."""

    centres: Array
    radii: Array
    error: SphereError


def fits(solid: Solid, numbers: list[int], least_radius: float) -> Iterator[Fitted]:
    """Fits for ascending ``numbers`` of spheres, one after the other."""
    for centres, radii in fitted(solid, numbers, least_radius):
        yield Fitted(centres, radii, sphere_error(solid, centres, radii))


def shown_numbers(most: int, wanted: int | None) -> list[int]:
    """1, 2, 4, … ``most``, and the number that is ``wanted``."""
    return sorted({*doubling(most)} | ({wanted} if wanted is not None else set()))


def standard_limit(solid: Solid) -> float:
    """RMS distance [m] that ``spheres = "standard"`` asks for: 3.1 % of the diameter of the ball of equal volume."""
    volume = mass_properties(solid, 1.0).volume
    return float(DEMANDS["standard"].rms * np.cbrt(6.0 * volume / np.pi))


def fewest(
    solid: Solid, rows: dict[int, Fitted], limit: float, least_radius: float, show: Callable[[Fitted], None]
) -> Fitted | None:
    """The fit of fewest spheres with an RMS distance of at most ``limit`` [m]; None if none of ``rows`` has it.

    ``rows`` are fits by the number asked for. Between the first that is good enough and the one before it, the numbers
    at the quarters are tried as well, and handed to ``show``.
    """
    good = next((number for number in sorted(rows) if rows[number].error.rms <= limit), None)
    if good is None:
        return None
    below = max((number for number in rows if number < good), default=good)
    between = sorted({below + (good - below) * k // QUARTERS for k in range(1, QUARTERS)} - {below, good})
    if not between:
        return rows[good]
    asked = [number for number in sorted(rows) if number <= below] + between
    for number, (centres, radii) in zip(asked, fitted(solid, asked, least_radius), strict=True):
        if number in between:
            found = Fitted(centres, radii, sphere_error(solid, centres, radii))
            show(found)
            if found.error.rms <= limit:
                return found
    return rows[good]
