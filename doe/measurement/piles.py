"""Scanned piles: ``piles/<condition>_<k>.npz`` → pile observables of replicate k, by the same estimators as our runs.

xyz (n, 3) [m], radius (n,) [m], body (n,): the member spheres of the bodies on the plate.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from doe.errors import MeasurementError
from doe.measurement.scans import replicate_files
from solver import (
    OBSERVABLES,
    HeightMap,
    NpzError,
    ParameterError,
    Pile,
    Scene,
    Spheres,
    height_map,
    named,
    npz_arrays,
    observe_scan,
    scanned_pile,
)

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PileSurface:
    """The upper surface of a pile given by its spheres, as a scanner that sees every point from above would show it."""

    spheres: Spheres
    grid: float = 0.0
    axis: tuple[float, float] | None = (0.0, 0.0)
    axis_error: float = 0.0
    noise: float = 0.0

    def height_map(self, half_width: float, pixel: float) -> HeightMap:
        """Heights of the highest spheres within ``half_width`` [m] of the axis."""
        return height_map(self.spheres, np.zeros(2), half_width, pixel)


PROFILE_PLACES = (np.arange(30) + 0.5) * 5e-3
"""Radii [m] of ``height_profile_m`` where the table lists none."""


def pile_files(folder: Path, conditions: Iterable[str]) -> tuple[dict[str, dict[int, Path]], tuple[Path, ...]]:
    """Return the files of ``folder/piles`` by condition and replicate, and those that belong to no condition."""
    return replicate_files(folder / "piles", conditions, lambda suffix: suffix == ".npz")


def read_piles(files: Mapping[int, Path], scene: Scene) -> dict[int, Pile]:
    """Read the scanned piles by replicate; they consist of the bodies of ``scene``."""
    return {replicate: read_pile(path, scene) for replicate, path in files.items()}


def read_pile(path: Path, scene: Scene) -> Pile:
    """Read one scanned pile; raises MeasurementError with one line naming file and array."""
    xyz, radius, body = _arrays(path)
    try:
        return scanned_pile(scene, xyz.astype(np.float64), radius.astype(np.float64), body)
    except ParameterError as error:
        raise MeasurementError(f"{path}: {error}") from None


def pile_surfaces(files: Mapping[int, Path]) -> dict[int, PileSurface]:
    """Return the upper surfaces of scanned piles by replicate; bodies of any kind, as a surface does not show them."""
    found = {}
    for replicate, path in files.items():
        xyz, radius, body = _arrays(path)
        if xyz.shape != (body.size, 3) or radius.shape != (body.size,):
            shapes = f"{xyz.shape}, {radius.shape}, {body.shape}"
            raise MeasurementError(f"{path}: xyz, radius, body: shapes {shapes}; allowed: (n, 3), (n,), (n,)")
        if not (np.isfinite(xyz).all() and np.isfinite(radius).all()):
            raise MeasurementError(f"{path}: xyz, radius: not finite; allowed: finite numbers")
        found[replicate] = PileSurface(Spheres(xyz.astype(np.float64), radius.astype(np.float64), body))
    return found


def _arrays(path: Path) -> tuple[npt.NDArray[Any], npt.NDArray[Any], npt.NDArray[Any]]:
    try:
        found = npz_arrays(path, ("xyz", "radius", "body"))
    except (OSError, NpzError) as error:
        raise MeasurementError(f"{path}: {error}") from None
    return found["xyz"], found["radius"], found["body"]


def pile_values(
    piles: Mapping[int, Pile], scene: Scene, replicates: int, listed: Mapping[str, Array | None]
) -> dict[str, tuple[Array | None, Array]]:
    """Return name → (places or None, values per replicate): what is read off every scan, and what the table lists.

    Of the observables ``listed`` in the table, only those of a pile are read.
    """
    wanted: dict[str, Array | None] = dict.fromkeys(name for name, known in OBSERVABLES.items() if known.scanned) | {
        "height_profile_m": PROFILE_PLACES
    }
    wanted |= {name: x for name, x in listed.items() if (known := named(name)) is not None and known.of_pile}
    values: dict[str, tuple[Array | None, Array]] = {
        name: (x, np.full(replicates if x is None else (replicates, x.size), np.nan)) for name, x in wanted.items()
    }
    for replicate, pile in piles.items():
        for name, reading in observe_scan(pile, scene, wanted).items():
            values[name][1][replicate - 1] = reading
    return values
