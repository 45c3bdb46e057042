"""Renders the example photographs of `assets/photographs`: python -m tests.solver.photograph.examples

No camera was there: a solid of known flanks, and two scanned piles of the shipped data set trefoil_2.
"""

from pathlib import Path

import numpy as np

from solver.assets import measurement_folder
from solver.observables.silhouette import silhouette
from solver.pours.record import Spheres
from tests.solver.photograph.rendered import Look, image_cover, jpeg_bytes, photograph, solid_cover

FOLDER = Path(__file__).parents[3] / "assets/photographs"
QUALITY = 85
MM_PER_PX = 0.2
FINE = 0.1e-3
"""Pixel of the silhouettes of scanned piles [m]."""
BAR_MM = 100.0


def cone():
    """A smooth solid of 25° on the left and 30° on the right, a dark bar of 100 mm above it, slightly tilted."""
    look = Look(width=1200, tilt_deg=1.5, noise=4, slant=0.3, falloff=0.2, shadow=0.25, texture=5, seed=1)
    pile = solid_cover(25.0, 30.0, 200.0)

    def cover(u, z):
        bar = (np.abs(u + 150) < BAR_MM / MM_PER_PX / 2) & (np.abs(z - 420) < 8)
        return np.maximum(pile(u, z), bar)

    return photograph(cover, look)


def bodies(replicate, seed):
    """A scanned pile of trefoil_2 along +y, on a plate of its own grey."""
    with np.load(measurement_folder("trefoil_2") / f"piles/fit_{replicate}.npz") as scan:
        spheres = Spheres(scan["xyz"], scan["radius"], scan["body"])
    look = Look(width=1600, pile=60, backdrop=185, plate=95, noise=4, texture=9, falloff=0.2, seed=seed)
    return photograph(image_cover(silhouette(spheres, 0.0, FINE), FINE * 1e3 / MM_PER_PX), look)


EXAMPLES = {"cone_25_30": cone, "trefoil_2_fit_1": lambda: bodies(1, 2), "trefoil_2_fit_5": lambda: bodies(5, 3)}


def main():
    FOLDER.mkdir(exist_ok=True)
    for name, render in EXAMPLES.items():
        (FOLDER / f"{name}.jpg").write_bytes(jpeg_bytes(render(), QUALITY))


if __name__ == "__main__":
    main()
