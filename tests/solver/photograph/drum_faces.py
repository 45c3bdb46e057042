"""Drawn pictures of a drum's face while it turns: a bed below a given surface, as a camera shows it."""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from solver.photograph import Picture


@dataclass(frozen=True)
class Look:
    """How a drum is drawn and photographed. Grey levels 0 … 255, lengths over the radius of the drum."""

    width: int = 900
    height: int = 700
    radius: float = 280.0
    """[px]"""
    at: tuple[float, float] = (430.0, 350.0)
    bed: float = 80.0
    void: float = 190.0
    rim: float = 40.0
    rim_width: float = 0.06
    beyond: float = 150.0
    grains: float = 0.0
    """Standard deviation of the grey of a grain."""
    grain: float = 0.03
    noise: float = 2.0
    blur: float = 0.8
    """[px]"""
    slant: float = 0.0
    """Light at the right edge over that at the left edge, less 1."""
    seed: int = 0


def drawn(top, look):
    """Picture of a drum whose bed lies below ``top`` (height over place, both over the radius)."""
    rng = np.random.default_rng(look.seed)
    rows, columns = np.mgrid[: look.height, : look.width].astype(np.float64)
    x, y = (columns - look.at[0]) / look.radius, (look.at[1] - rows) / look.radius
    r = np.hypot(x, y)
    coarse = rng.standard_normal((look.height, look.width))
    coarse = ndimage.gaussian_filter(coarse, look.grain * look.radius / 2.0)
    texture = look.grains * coarse / coarse.std()
    cover = np.clip((top(x) - y) * look.radius + 0.5, 0.0, 1.0)
    grey = look.void + (look.bed + texture - look.void) * cover
    grey = np.where(r > 1.0, look.rim, grey)
    grey = np.where(r > 1.0 + look.rim_width, look.beyond, grey)
    grey = ndimage.gaussian_filter(grey * (1.0 + look.slant * (columns / look.width - 0.5)), look.blur)
    grey += look.noise * rng.standard_normal(grey.shape)
    return Picture("drum", np.clip(grey, 0, 255).astype(np.float32), look.width, look.height, 1)


def plane(angle_deg, depth=0.1):
    """Surface that rises to the left, ``depth`` below the centre."""
    return lambda x: -depth - np.tan(np.radians(angle_deg)) * x
