"""What was measured as curves in the picture of a pile: silhouettes of scans, height profiles, free surfaces."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from doe.measurement.load import load_measurement
from doe.measurement.measurement import Condition
from doe.measurement.piles import pile_files, read_pile
from explorer.errors import CommandError
from solver.assets import measurement_folder
from solver.observables.repose import AZIMUTHS_DEG, Flanks, outline
from solver.rigs.rotating_drum import RotatingDrum

Array = npt.NDArray[np.float64]
NO_FLANKS: Flanks = (None, None)


@dataclass(frozen=True, eq=False)
class MeasuredCurve:
    """A measured line in the plane that a camera looks at along +y: u [m] to the right, z [m] above the plate."""

    name: str
    u: Array
    """Shape (n,), ascending [m]."""
    z: Array
    """Shape (n,) [m]."""
    flanks: Flanks = NO_FLANKS
    """Lines of the flanks, fitted as to a simulated pile, where a scan gives them."""


def measured_curves(name: str) -> dict[str, MeasuredCurve]:
    """Curves of the data set ``name``, shipped or a folder, by what they are called in a list.

    Raises:
        MeasurementError, AssetNotFoundError, CommandError: in one line, for data that cannot be read or show no pile.
    """
    folder = measurement_folder(name)
    measurement = load_measurement(folder)
    scans, _ = pile_files(folder, [condition.name for condition in measurement.conditions])
    found: dict[str, MeasuredCurve] = {}
    for condition in measurement.conditions:
        for curve in (*_scanned(condition, scans[condition.name]), *_observed(condition)):
            found[curve.name] = curve
    if not found:
        raise CommandError(f"{name}: holds no scanned pile, height profile or free surface to draw")
    return found


def _scanned(condition: Condition, scans: dict[int, Path]) -> Iterator[MeasuredCurve]:
    """The silhouette of every scan, in the view that the left and the right angle are read in."""
    for replicate in sorted(scans):
        seen = outline(read_pile(scans[replicate], condition.scene).spheres, AZIMUTHS_DEG[0])
        yield MeasuredCurve(f"{condition.name}: scan {replicate}", seen.u, seen.top, seen.flanks)


def _observed(condition: Condition) -> Iterator[MeasuredCurve]:
    """Curves that stand for a condition: means over its replicates."""
    for name, observation in condition.offered.items():
        if observation.x is None:
            continue
        measured = np.isfinite(observation.values).any(axis=0)
        place, height = observation.x[measured], np.nanmean(observation.values[:, measured], axis=0)
        if name == "height_profile_m":
            # About the axis of the pile, so the same on both sides.
            both = np.concatenate([-place[::-1], place]), np.concatenate([height[::-1], height])
            yield MeasuredCurve(f"{condition.name}: mean height profile", *both)
        elif name == "surface_profile_m" and isinstance(condition.scene.rig, RotatingDrum):
            yield MeasuredCurve(f"{condition.name}: free surface", place, height + condition.scene.rig.radius)
