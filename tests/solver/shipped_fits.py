"""Fits the bodies of the shipped materials and of the template.

``python -m tests.solver.shipped_fits`` (`make golden`) writes them to ``assets/clumps``.
"""

import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from explorer.scene.starter_files import write_material
from solver.assets import shipped_assets, shipped_fits
from solver.scenes.material_file import load_material
from solver.shapes.clump import RESOLUTIONS, Fit, _new_fit, fit_name, read_fit, write_fit
from solver.shapes.solid import Solid
from solver.version import FITTING

SLACK = 1e-9
"""[m] The optimiser stops where it gains nothing; another processor's rounding moves that by less."""


def fitted() -> Iterator[tuple[Solid, str]]:
    """Every solid that is shipped, and at which resolution a new user's first commands ask for it."""
    with TemporaryDirectory() as folder:
        template = str(write_material(Path(folder), "template"))
        scenes = [load_material(name) for name in (*shipped_assets("materials"), template)]
    solids = dict.fromkeys(body.shape for scene in scenes for body in scene.bodies if isinstance(body.shape, Solid))
    for solid in solids:
        if solid.kind != "sphere":
            yield from ((solid, spheres) for spheres in RESOLUTIONS)


def _equal(one: Fit, other: Fit) -> bool:
    """Whether centres and radii are the same."""
    pairs = zip(one[:2], other[:2], strict=True)
    return all(a.shape == b.shape and np.allclose(a, b, rtol=0.0, atol=SLACK) for a, b in pairs)


def main() -> int:
    """Replace the shipped fits; 1 where one has changed under the same version."""
    folder = shipped_fits()
    made = {fit_name(*one): _new_fit(*one) for one in fitted()}
    known = {name: (read_fit(folder / name), fit) for name, fit in made.items()}
    changed = [name for name, (kept, fit) in known.items() if kept is not None and not _equal(kept, fit)]
    if changed:
        print(
            f"other fits under the same FITTING = {FITTING}; raise it in solver/version.py: {changed}", file=sys.stderr
        )
        return 1
    for path in folder.glob("*.npz"):
        path.unlink()
    for name, fit in made.items():
        write_fit(folder / name, fit)
    print(f"{folder}: {len(made)} fits")
    return 0


if __name__ == "__main__":
    sys.exit(main())
