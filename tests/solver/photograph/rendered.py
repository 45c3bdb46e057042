"""Rendered photographs of piles whose silhouette is known: a solid of given flanks, or any silhouette image.

A pixel is a weighted mean of pile and backdrop by how much of it the pile covers, so edges lie between pixels. Then
come shading, a cast shadow on the backdrop, light that slants and falls off, blur, noise, and the codec.
"""

import io
from dataclasses import dataclass

import numpy as np
from PIL import Image
from scipy import ndimage

from solver.observables.repose import flank_angles_deg
from solver.photograph.picture import LONGEST, Picture


@dataclass(frozen=True)
class Look:
    """How a photograph is taken. Grey levels 0 … 255; lengths are shares of the picture's width."""

    width: int = 1000
    pile: float = 70.0
    backdrop: float = 190.0
    plate: float | None = None
    """Grey level of the plate; None: that of the backdrop."""
    tilt_deg: float = 0.0
    noise: float = 2.0
    blur: float = 0.7
    """Pixels."""
    slant: float = 0.0
    """Light at the right edge over light at the left edge, less 1."""
    falloff: float = 0.0
    """Light that the corners lack."""
    shading: float = 0.0
    """Grey that the pile's right half lacks, as a share."""
    shadow: float = 0.0
    """Light that the backdrop lacks where the pile's shadow falls on it."""
    shadow_shift: tuple[float, float] = (0.05, 0.02)
    """To the right, and up."""
    shadow_blur: float = 0.01
    texture: float = 0.0
    """Standard deviation of the pile's grey levels, in grains of 1 % of the width."""
    jpeg: int | None = None
    """Quality; None: no codec."""
    base: float = 0.82
    """Where the base line crosses the middle of the picture, over its height."""
    seed: int = 0


def solid_cover(left_deg, right_deg, height, rounding=0.0):
    """Cover of a solid with straight flanks: function of place along the base and above it [px], apex above u = 0."""
    left, right = np.tan(np.radians([left_deg, right_deg]))

    def cover(u, z):
        slope = np.where(u < 0, left, right)
        below = height - slope * np.abs(u)
        if rounding:
            # A round top of the same flanks: a hyperbola that they are the asymptotes of.
            below = height + rounding - np.sqrt((slope * u) ** 2 + rounding**2)
        return np.clip(0.5 + (below - z) / np.hypot(1.0, slope), 0.0, 1.0) * np.clip(0.5 + z, 0.0, 1.0)

    return cover


def image_cover(image, pixel):
    """Cover by a silhouette ``image`` (row 0 on the plate) whose pixels are ``pixel`` [px] of the photograph wide."""
    soft = ndimage.gaussian_filter(np.pad(image, 2).astype(float), 0.35 / pixel if pixel < 0.5 else 0.0)
    middle = image.shape[1] / 2

    def cover(u, z):
        inside = ndimage.map_coordinates(soft, [z / pixel + 1.5, u / pixel + middle + 1.5], order=1, cval=0.0)
        return inside * np.clip(0.5 + z, 0.0, 1.0)

    return cover


def photograph(cover, look):
    """Grey levels (rows, columns), 8 bit, of what ``cover`` (u, z) covers."""
    rng = np.random.default_rng(look.seed)
    columns, rows = look.width, round(0.62 * look.width)
    x, y = np.meshgrid(np.arange(columns) - (columns - 1) / 2, np.arange(rows) - look.base * rows)
    tilt = np.radians(look.tilt_deg)
    u, z = x * np.cos(tilt) + y * np.sin(tilt), x * np.sin(tilt) - y * np.cos(tilt)
    pile = cover(u, z)
    ground = np.full(pile.shape, look.backdrop)
    if look.shadow:
        shift = np.array(look.shadow_shift) * columns
        shade = ndimage.gaussian_filter(cover(u - shift[0], z - shift[1]), look.shadow_blur * columns)
        ground = ground * (1.0 - look.shadow * shade)
    if look.plate is not None:
        on_plate = np.clip(0.5 - z, 0.0, 1.0)
        ground = ground * (1.0 - on_plate) + look.plate * on_plate
    body = look.pile * (1.0 - look.shading * np.clip(0.5 + 4.0 * u / columns, 0.0, 1.0)) + texture(look, rng)
    return developed(pile * body + (1.0 - pile) * ground, look, rng)


def texture(look, rng):
    """Grey levels of the pile's own pattern, shape of the picture."""
    columns, rows = look.width, round(0.62 * look.width)
    grain = rng.normal(size=(rows // max(1, columns // 100) + 2, columns // max(1, columns // 100) + 2))
    return look.texture * ndimage.zoom(grain, max(1, columns // 100), order=1)[:rows, :columns]


def developed(grey, look, rng):
    """``grey`` as it comes out of the camera: the light on it, blur, noise, 8 bit, the codec."""
    rows, columns = grey.shape
    x, y = np.meshgrid(np.arange(columns) - (columns - 1) / 2, np.arange(rows) - look.base * rows)
    light = (1.0 + look.slant * x / columns) * (1.0 - look.falloff * ((x / columns) ** 2 + (y / columns) ** 2) * 2.0)
    grey = ndimage.gaussian_filter(grey * light, look.blur)
    grey = np.clip(grey + rng.normal(scale=look.noise, size=grey.shape), 0, 255).round().astype(np.uint8)
    return grey if look.jpeg is None else np.asarray(Image.open(io.BytesIO(jpeg_bytes(grey, look.jpeg))))


def jpeg_bytes(grey, quality):
    file = io.BytesIO()
    Image.fromarray(grey).save(file, "JPEG", quality=quality)
    return file.getvalue()


def save(path, grey):
    """``grey`` as the PNG ``path``, which is given back."""
    Image.fromarray(grey).save(path)
    return path


def picture_of(grey, name="rendered"):
    """``grey`` as if it had been opened from a file."""
    reduced = max(1, -(-max(grey.shape) // LONGEST))
    small = Image.fromarray(grey.astype(np.float32)).reduce(reduced)
    return Picture(name, np.array(small, dtype=np.float32), grey.shape[1], grey.shape[0], reduced)


def fitted(image):
    """Angles [°] of the flanks of a silhouette, by the estimator of simulated piles."""
    return np.array(flank_angles_deg(image, 1.0))
