"""An export target: the centres of the bodies that lie on the plate, as text for any program that plots."""

from pathlib import Path

import numpy as np

from explorer.export.target import ExportOrder, ExportTarget
from solver import run_pour
from solver.scenes.scene import Scene


class Points(ExportTarget):
    """``points.csv``: x, y, z [m]."""

    name = "points"
    what = "centres of the bodies on the plate (CSV)"

    def check(self, scene: Scene) -> None:
        """Every pour has them."""

    def write(self, folder: Path, order: ExportOrder) -> str:
        """Pour, and write a line per body."""
        pile = run_pour(order.scene, order.seed).pile
        np.savetxt(folder / "points.csv", pile.position, delimiter=",", header="x_m,y_m,z_m", comments="")
        return f"{len(pile.position)} bodies in points.csv"


POINTS = Points()
