"""A made-up scanner, which turns a pile into a file with a grid of heights, with the errors that real scanners make.

A scan holds the highest point of the member spheres over every node of a grid, as seen from above and by an oblique
camera: nodes that the pile hides from the camera are missing (shadow), and so are a few round patches (a reflecting
grain). Heights have noise, and the stated axis is off by a millimetre or two, equally in all scans of a data set, but
to the other side in the frame of a rig that was turned. This module shares no code with the reader of the file.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
import numpy.typing as npt
from pydantic import ConfigDict

from solver import TABLE, Vector

Array = npt.NDArray[np.float64]

ELEVATION = (math.radians(50.0), math.radians(80.0))
"""Range of the camera's elevation above the plate [rad]."""
PATCHES, PATCH_RADIUS = 6, 3.0e-3
"""Largest number of missing patches in a scan, and their largest radius [m]."""
PLATE_MARGIN = 0.03
"""Width of bare plate [m] that is scanned around the pile."""
FARTHEST = 0.15
"""Bodies farther than this from the axis [m] are outside the scanner's table."""


@dataclass(frozen=True)
class ScannerRanges:
    """Ranges of a scanner's properties: ``[laboratory.scanner]``, lengths in metres or with a unit."""

    __pydantic_config__: ClassVar[ConfigDict] = TABLE

    grid: Annotated[tuple[float, ...], Vector(unit="m")] = (0.5e-3, 0.75e-3, 1.0e-3, 1.5e-3, 2.0e-3)
    """Grid spacings that scanners may have."""
    noise: Annotated[tuple[float, float], Vector(2, "m")] = (0.05e-3, 0.3e-3)
    """Range of the standard deviation of a height."""
    axis_off: Annotated[tuple[float, float], Vector(2, "m")] = (1.0e-3, 2.0e-3)
    """Range of the error of the stated axis, in any direction."""


@dataclass(frozen=True)
class Scanner:
    """One laboratory's scanner, SI."""

    grid: float
    noise: float
    axis_x: float
    axis_y: float
    elevation: float
    azimuth: float

    @staticmethod
    def drawn(rng: np.random.Generator, ranges: ScannerRanges = ScannerRanges()) -> Scanner:
        """A random scanner within ``ranges``."""
        off, towards = rng.uniform(*ranges.axis_off), rng.uniform(0.0, 2.0 * math.pi)
        return Scanner(
            grid=float(rng.choice(ranges.grid)),
            noise=float(rng.uniform(*ranges.noise)),
            axis_x=off * math.cos(towards),
            axis_y=off * math.sin(towards),
            elevation=float(rng.uniform(*ELEVATION)),
            azimuth=float(rng.uniform(0.0, 2.0 * math.pi)),
        )

    def of_turned_rig(self) -> Scanner:
        """The same scanner, which stays on the bench, in the frame of a rig that was turned by 180° under it."""
        return replace(self, axis_x=-self.axis_x, axis_y=-self.axis_y, azimuth=self.azimuth + math.pi)

    def scan(self, centre: Array, radius: Array, rng: np.random.Generator) -> dict[str, Array]:
        """``height`` (n, n), ``x``, ``y`` (n,) [m] of spheres with centres (m, 3), radii (m,); NaN at unseen nodes."""
        near = np.hypot(centre[:, 0], centre[:, 1]) < FARTHEST
        centre, radius = centre[near], radius[near]
        reach = PLATE_MARGIN + (float(np.abs(centre[:, :2]).max()) if len(centre) else 0.0)
        # The grid has a random offset from the axis.
        nodes = np.arange(-math.ceil(reach / self.grid), math.ceil(reach / self.grid) + 1) * self.grid
        x, y = (np.asarray(nodes + rng.uniform(0.0, self.grid), dtype=np.float64) for _ in range(2))
        height = tops(centre, radius, x, y)
        unseen = self._shadow(height)
        for _ in range(int(rng.integers(0, PATCHES + 1))):
            px, py = rng.uniform(x[0], x[-1]), rng.uniform(y[0], y[-1])
            unseen |= np.hypot(x[:, None] - px, y[None, :] - py) < rng.uniform(0.3, 1.0) * PATCH_RADIUS
        height = height + self.noise * rng.standard_normal(height.shape)
        height[unseen] = np.nan
        # The file's origin is where the laboratory believes the axis to be.
        believed = (np.asarray(x + self.axis_x), np.asarray(y + self.axis_y))
        return {"height": height, "x": believed[0], "y": believed[1]}

    def _shadow(self, height: Array) -> npt.NDArray[np.bool_]:
        """Mask of the nodes whose line of sight to the camera is blocked by the pile."""
        away = np.array([math.cos(self.azimuth), math.sin(self.azimuth)])
        rise = math.tan(self.elevation) * self.grid
        blocked = np.zeros(height.shape, dtype=bool)
        for step in range(1, math.ceil(float(height.max(initial=0.0)) / rise) + 1):
            i, j = (round(step * part) for part in away)
            moved = np.zeros_like(height)
            to = tuple(slice(max(0, -k), height.shape[a] - max(0, k)) for a, k in enumerate((i, j)))
            come = tuple(slice(max(0, k), height.shape[a] - max(0, -k)) for a, k in enumerate((i, j)))
            moved[to] = height[come]
            blocked |= moved > height + step * rise
        return blocked

    def table(self) -> dict[str, Any]:
        """The ``[condition.scan]`` that the laboratory writes: its axis is the origin, which it believes is right."""
        return {
            "axis": [0.0, 0.0],
            "plate": [0.0, 0.0, 0.0],
            "grid": f"{1e3 * self.grid:g}mm",
            "noise": f"{1e3 * self.noise:.3g}mm",
        }


def tops(centre: Array, radius: Array, x: Array, y: Array) -> Array:
    """Height [m] of the highest sphere over every node, 0 on the plate, (n, m)."""
    height = np.zeros((len(x), len(y)))
    for (cx, cy, cz), r in zip(centre, radius, strict=True):
        i = slice(*np.searchsorted(x, [cx - r, cx + r]))
        j = slice(*np.searchsorted(y, [cy - r, cy + r]))
        square = r**2 - (x[i, None] - cx) ** 2 - (y[None, j] - cy) ** 2
        cap = cz + np.sqrt(np.maximum(square, 0.0))
        height[i, j] = np.where(square > 0.0, np.maximum(height[i, j], cap), height[i, j])
    return height


def write_scan(path: Path, arrays: dict[str, Array]) -> None:
    """Write one scan to an ``.npz`` file."""
    np.savez_compressed(path, allow_pickle=False, **{name: one.astype(np.float32) for name, one in arrays.items()})
