"""Silhouette of a pile: what a camera at plate height sees from far away.

An image is a boolean array, shape (rows, columns): row 0 lies on the plate and rows go up, columns go from
left to right. Simulated piles and photographs share this form; a photograph, stored from the top down, is
flipped first.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from solver.pours.record import Spheres

Array = npt.NDArray[np.float64]
Image = npt.NDArray[np.bool_]

PIXEL = 0.25e-3
"""Side of a pixel [m]."""
EIGHT_NEIGHBOURS = np.ones((3, 3), dtype=bool)


@dataclass(frozen=True, eq=False)
class _Strips:
    """Spheres cut into the columns of an image of ``rows`` and ``columns`` pixels (k strips)."""

    rows: int
    columns: int
    sphere: npt.NDArray[np.int64]
    """Index of the sphere that a strip belongs to, shape (k,)."""
    column: npt.NDArray[np.int64]
    first: npt.NDArray[np.int64]
    """Lowest covered row, shape (k,)."""
    past: npt.NDArray[np.int64]
    """Row above the highest covered one, shape (k,)."""
    top: Array
    """Upper end in pixels, not rounded, shape (k,)."""


def silhouette(spheres: Spheres, azimuth_deg: float, pixel: float = PIXEL) -> Image:
    """Image of the union of ``spheres`` on a grid of ``pixel`` [m], shape (rows, columns).

    The image's horizontal axis is u = x cos(azimuth) + y sin(azimuth): azimuth 0 looks along +y and has +x
    on its right. A pixel is covered where its centre lies in the projection of a sphere, so the outline is
    within half a pixel of the exact one. What lies below the plate (z < 0) is cut off. No spheres: an image
    of shape (0, 0).
    """
    if spheres.radius.size == 0:
        return np.zeros((0, 0), dtype=bool)
    cut = _strips(spheres, azimuth_deg, pixel)
    # A sphere covers the rows first <= row < past of a column: mark +1 and -1 there, then sum up the column.
    strip = cut.column * (cut.rows + 1)
    size = cut.columns * (cut.rows + 1)
    edges = np.bincount(strip + cut.first, minlength=size) - np.bincount(strip + cut.past, minlength=size)
    covered: Image = np.cumsum(edges.reshape(cut.columns, cut.rows + 1), axis=1)[:, : cut.rows] > 0
    return covered.T


def top_bodies(spheres: Spheres, azimuth_deg: float, image: Image, pixel: float = PIXEL) -> npt.NDArray[np.int64]:
    """Body whose surface is the top of ``image`` in each of its columns, shape (columns,); -1 over an empty column.

    ``image``: the silhouette of ``spheres`` from that azimuth, or a part of it.
    """
    found = np.full(image.shape[1], -1, dtype=np.int64)
    if spheres.radius.size == 0:
        return found
    cut = _strips(spheres, azimuth_deg, pixel)
    # What sticks out above the image's own part belongs to another part of the silhouette.
    on_top = np.flatnonzero(cut.past == column_tops(image)[cut.column])
    on_top = on_top[np.argsort(cut.top[on_top], kind="stable")]
    found[cut.column[on_top]] = spheres.body[cut.sphere[on_top]]
    return np.where(image.any(axis=0), found, -1)


def _strips(spheres: Spheres, azimuth_deg: float, pixel: float) -> _Strips:
    u = _across(spheres, azimuth_deg) / pixel
    z = spheres.centre[:, 2] / pixel
    radius = spheres.radius / pixel
    u -= _left_column(u, radius)

    columns = int(np.ceil((u + radius).max()))
    rows = max(int(np.ceil((z + radius).max())), 1)
    first_column = np.ceil(u - radius - 0.5).astype(np.int64)
    column = first_column[:, None] + np.arange(int(np.ceil(2.0 * radius.max())) + 1)
    half_chord_squared = radius[:, None] ** 2 - (column + 0.5 - u[:, None]) ** 2
    sphere, _ = hit = np.nonzero((half_chord_squared >= 0.0) & (column < columns))
    half_chord = np.sqrt(half_chord_squared[hit])
    first = np.clip(np.ceil(z[sphere] - half_chord - 0.5), 0, rows).astype(np.int64)
    past = np.clip(np.floor(z[sphere] + half_chord + 0.5), first, rows).astype(np.int64)
    return _Strips(rows, columns, sphere, column[hit], first, past, z[sphere] + half_chord)


def left_edge(spheres: Spheres, azimuth_deg: float, pixel: float = PIXEL) -> float:
    """Where on its horizontal axis u the left edge of :func:`silhouette` is [m]; 0 without spheres."""
    if spheres.radius.size == 0:
        return 0.0
    return pixel * float(_left_column(_across(spheres, azimuth_deg) / pixel, spheres.radius / pixel))


def _across(spheres: Spheres, azimuth_deg: float) -> Array:
    """u of the spheres' centres [m], shape (m,)."""
    angle = np.radians(azimuth_deg)
    across: Array = spheres.centre[:, 0] * np.cos(angle) + spheres.centre[:, 1] * np.sin(angle)
    return across


def _left_column(u: Array, radius: Array) -> float:
    """Left edge of the image of spheres at ``u`` with ``radius``, all in pixels."""
    return float(np.floor((u - radius).min()))


def largest_part(image: Image) -> Image:
    """The largest 8-connected part of ``image``, everything else cleared; same shape."""
    if not image.any():
        return image
    from scipy import ndimage  # here: a pour that is cut off has no pile, and this takes 0.3 s to load

    # A silhouette is stored column by column; labelling it in that order takes half as long.
    labels, _ = ndimage.label(image.T, structure=EIGHT_NEIGHBOURS)
    pixels = np.bincount(labels.ravel())
    pixels[0] = 0
    part: Image = labels == pixels.argmax()
    return part.T


def column_tops(image: Image) -> npt.NDArray[np.int64]:
    """Pixels from the plate to the top of the highest covered one, per column; shape (columns,)."""
    if image.size == 0:
        return np.zeros(image.shape[1], dtype=np.int64)
    tops = image.shape[0] - image[::-1].argmax(axis=0)
    return np.where(image.any(axis=0), tops, 0)
