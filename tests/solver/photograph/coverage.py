"""A campaign of rendered photographs: errors of the angles that are read, and how often their intervals hold.

Every picture draws its pile, size, contrast, noise, light, shadow, tilt and codec from a seed.
"""

from dataclasses import dataclass

import numpy as np

from solver.assets import measurement_folder
from solver.observables.made_up import seeds_in_cone
from solver.observables.silhouette import largest_part, silhouette
from solver.photograph import PhotographedPile, read_photograph
from solver.pours.record import Spheres
from tests.solver.photograph.rendered import Look, fitted, image_cover, photograph, picture_of, solid_cover

HALF = 0.44
"""Most of the picture's width that a solid takes to either side of its apex."""
FINE = 0.1e-3
"""Pixel of the noise-free silhouette of bodies [m]."""


@dataclass(frozen=True)
class Trial:
    """One picture. Angles [°]: left, right."""

    look: Look
    truth: np.ndarray
    read: PhotographedPile | None
    """None: refused."""

    @property
    def errors(self):
        angles = self.read.angles
        return np.array([angles.left.value_deg, angles.right.value_deg]) - self.truth

    @property
    def held(self):
        """Whether the intervals of left, right and mean hold the truth."""
        angles = self.read.angles
        truths = (*self.truth, self.truth.mean())
        intervals = [angle.interval_deg for angle in (angles.left, angles.right, angles.mean)]
        return np.array([low <= truth <= high for truth, (low, high) in zip(truths, intervals, strict=True)])


def any_look(rng, widths):
    """A look drawn at random; contrast 35 … 170 grey levels, noise up to a sixth of it."""
    backdrop = rng.uniform(90, 220)
    contrast = rng.uniform(35, 0.85 * backdrop)
    dark = rng.random() < 0.75
    pile, backdrop = (backdrop - contrast, backdrop) if dark else (backdrop, backdrop - contrast)
    plates = (None, pile, backdrop + 25.0, max(backdrop - 0.4 * contrast, 5.0) if dark else None)
    return Look(
        width=int(rng.choice(widths)),
        pile=pile,
        backdrop=backdrop,
        plate=plates[rng.integers(len(plates))],
        tilt_deg=rng.uniform(-5, 5),
        noise=rng.uniform(0.5, min(12.0, contrast / 6)),
        blur=rng.uniform(0.4, 1.5),
        slant=rng.uniform(-0.5, 0.5),
        falloff=rng.uniform(0, 0.3),
        shading=rng.uniform(0, 0.3),
        shadow=rng.uniform(0, 0.35 * contrast / backdrop) if dark else rng.uniform(0, 0.3),
        texture=rng.uniform(0, 0.08) * contrast,
        jpeg=int(rng.choice([30, 60, 75, 92])),
        seed=int(rng.integers(1 << 30)),
    )


def solid_trial(seed, widths):
    """A solid with flanks of 12 … 45°, the whole of it in the picture, whose middle is below its apex."""
    rng = np.random.default_rng(seed)
    look = any_look(rng, widths)
    truth = rng.uniform(12, 45, 2)
    slopes = np.tan(np.radians(truth))
    base = rng.uniform(0.45, 0.7) * look.width
    height = min(base / (1.0 / slopes).sum(), 0.38 * look.width, HALF * look.width * slopes.min())
    return _trial(solid_cover(*truth, height), look, truth)


def bodies_trial(seed, widths):
    """Bodies on a plate: a shipped scanned pile from any side, or seeds that fill a cone and are cut by the plate.

    The truth is the fit of the noise-free silhouette.
    """
    rng = np.random.default_rng(seed)
    look = any_look(rng, widths)
    if rng.random() < 0.5:
        spheres = scanned_spheres(rng)
    else:
        spheres = seeds_in_cone(rng.uniform(18, 35), int(rng.integers(60, 160)), rng, 0.0).spheres
    image = largest_part(silhouette(spheres, rng.uniform(0, 180), FINE))
    ratio = min(rng.uniform(0.5, 0.8) * look.width / image.shape[1], 0.42 * look.width / image.shape[0])
    return _trial(image_cover(image, ratio), look, fitted(image))


def scanned_spheres(rng):
    """Spheres of one of the piles of ``trefoil_2``."""
    files = sorted((measurement_folder("trefoil_2") / "piles").glob("fit_*.npz"))
    with np.load(files[rng.integers(len(files))]) as scan:
        return Spheres(scan["xyz"], scan["radius"], scan["body"])


def _trial(cover, look, truth):
    read = read_photograph(picture_of(photograph(cover, look)))
    return Trial(look, truth, read if isinstance(read, PhotographedPile) else None)


def summary(trials):
    """Refused; root mean square, 95th percentile and largest |error| of the flanks [°]; share of intervals that hold
    for flanks and mean; median half width of the flanks' intervals [°]."""
    read = [trial for trial in trials if trial.read is not None]
    errors = np.abs(np.concatenate([trial.errors for trial in read]))
    held = np.array([trial.held for trial in read])
    half = [2.0 * angle.error_deg for t in read for angle in (t.read.angles.left, t.read.angles.right)]
    return {
        "pictures": len(trials),
        "refused": len(trials) - len(read),
        "rms": float(np.sqrt(np.mean(errors**2))),
        "p95": float(np.percentile(errors, 95)),
        "largest": float(errors.max()),
        "flanks_held": float(held[:, :2].mean()),
        "mean_held": float(held[:, 2].mean()),
        "half_width": float(np.median(half)),
    }
