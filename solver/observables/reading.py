"""A pile with the intermediate results that several observables use, each computed once and only on demand."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from solver.observables import surface
from solver.observables.repose import AZIMUTHS_DEG, Outline, flank_angles_deg, flank_lines, outline_of
from solver.observables.silhouette import PIXEL, Image, largest_part, left_edge, silhouette, top_bodies
from solver.observables.surface import HeightMap, height_map

if TYPE_CHECKING:
    from solver.pours.record import Pile

Array = npt.NDArray[np.float64]

SURFACE_PIXELS = 160
"""Pixels of the height map along half its width; the half width is three times r50."""


@dataclass(frozen=True)
class PileReading:
    """Views and integrals of one pile. Its angles are NaN if it has fewer than two bodies."""

    pile: Pile

    @property
    def is_pile(self) -> bool:
        """True for two bodies or more."""
        return self.pile.mass.size >= 2

    @cached_property
    def silhouettes(self) -> tuple[Image, ...]:
        """Largest part of the silhouette from each of ``AZIMUTHS_DEG``."""
        return tuple(largest_part(silhouette(self.pile.spheres, azimuth)) for azimuth in AZIMUTHS_DEG)

    @cached_property
    def front(self) -> Outline:
        """Outline and flank lines of the first view, along +y: what the left and the right angle are read from."""
        azimuth = AZIMUTHS_DEG[0]
        return outline_of(self.silhouettes[0], left_edge(self.pile.spheres, azimuth), azimuth)

    @cached_property
    def flanks_deg(self) -> Array:
        """Angles of the left and the right flank [°], shape (azimuths, 2)."""
        return self._flanks_deg(0.0)

    @cached_property
    def flanks_above_one_body_deg(self) -> Array:
        """The same with the floor of the window above a body that lies flat (its thickness plus one pixel)."""
        return self._flanks_deg(self.thickness + PIXEL)

    def view_deg(self, azimuth_deg: float) -> tuple[float, float]:
        """Angles of the left and the right flank [°] from one azimuth [°], among ``AZIMUTHS_DEG`` or not."""
        if azimuth_deg in AZIMUTHS_DEG:
            left, right = self.flanks_deg[AZIMUTHS_DEG.index(azimuth_deg)]
            return float(left), float(right)
        if not self.is_pile:
            return float("nan"), float("nan")
        return flank_angles_deg(largest_part(silhouette(self.pile.spheres, azimuth_deg)), PIXEL)

    @cached_property
    def flank_grains(self) -> Array:
        """Number of bodies whose tops a flank's line is fitted to, shape (azimuths, 2); NaN for a flank without one."""
        counts = np.full((len(AZIMUTHS_DEG), 2), np.nan)
        if not self.is_pile:
            return counts
        for k, (azimuth, image) in enumerate(zip(AZIMUTHS_DEG, self.silhouettes, strict=True)):
            tops = top_bodies(self.pile.spheres, azimuth, image)
            for side, line in enumerate(flank_lines(image, PIXEL)):
                if line is not None:
                    first, last = sorted(int(u / PIXEL) for u in line.u)
                    within = tops[first : last + 1]
                    counts[k, side] = np.unique(within[within >= 0]).size
        return counts

    @cached_property
    def thickness(self) -> float:
        """Thickness of a body [m]."""
        return surface.body_thickness(self.pile)

    @cached_property
    def grain_thickness(self) -> float:
        """Thickness of a body, averaged by mass over the pile [m]: the scale for the height of a heap."""
        return surface.grain_thickness(self.pile)

    @cached_property
    def centre(self) -> Array:
        """Centre of mass [m], shape (3,)."""
        return surface.centre_of_mass(self.pile)

    @cached_property
    def radii(self) -> Array:
        """Distances of the bodies from the centre of mass in the plane of the plate [m], shape (n,)."""
        return surface.mass_radii(self.pile)

    @cached_property
    def r50(self) -> float:
        """Radius that holds half of the mass [m]."""
        return surface.radius_holding(0.5, self.radii, self.pile.mass)

    @cached_property
    def surface(self) -> HeightMap | None:
        """Top surface out to 3 r50; None for a pile whose r50 is below the radius of its largest sphere."""
        if not self.r50 > self.pile.spheres.radius.max(initial=0.0):
            return None
        half_width = 3.0 * self.r50
        return height_map(self.pile.spheres, self.centre[:2], half_width, half_width / SURFACE_PIXELS)

    def _flanks_deg(self, lowest: float) -> Array:
        if not self.is_pile:
            return np.full((len(AZIMUTHS_DEG), 2), np.nan)
        return np.array([flank_angles_deg(image, PIXEL, lowest) for image in self.silhouettes])
