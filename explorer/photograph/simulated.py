"""A simulated pile beside a photographed one: the same outline and flank lines, from every view of it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from doe.record import Record
from explorer.errors import CommandError
from explorer.outcomes import outcome_text
from explorer.scene.file import load_scene
from solver.observables.repose import AZIMUTHS_DEG, Outline, flank_feet, outline
from solver.pours.record import Spheres

Array = npt.NDArray[np.float64]
SEED = 1


@dataclass(frozen=True)
class Spread(Record):
    """Mean over views, and their standard deviation; NaN of one view."""

    mean: float
    sd: float = math.nan


@dataclass(frozen=True, kw_only=True)
class SimulatedViews(Record):
    """What ``views`` of ``piles`` of one source show: "simulation" in what ``explorer measure --json`` prints."""

    source: str
    piles: int
    views: int
    left_deg: Spread
    right_deg: Spread
    mean_deg: Spread
    height_mm: Spread
    half_width_mm: Spread


@dataclass(frozen=True, eq=False)
class SimulatedPiles:
    """Views of the piles of one source. Lengths [m]."""

    source: str
    piles: int
    left_deg: Array
    """One per pile and azimuth, as all the following; views in which a flank cannot be fitted are left out."""
    right_deg: Array
    height: Array
    half_width: Array
    front: Outline
    """The first view, to be drawn."""

    @property
    def summary(self) -> SimulatedViews:
        """Over all views."""
        return SimulatedViews(
            source=self.source,
            piles=self.piles,
            views=int(self.height.size),
            left_deg=_spread(self.left_deg),
            right_deg=_spread(self.right_deg),
            mean_deg=_spread(0.5 * (self.left_deg + self.right_deg)),
            height_mm=_spread(1e3 * self.height),
            half_width_mm=_spread(1e3 * self.half_width),
        )


def simulated_piles(source: str) -> SimulatedPiles:
    """Piles of a ``pile_*.npz``, of a folder of them (`simulate --out`), or of a fresh pour of what ``source`` names.

    CommandError in one line where there is no pile to see; what is wrong with a scene raises as in `simulate`.
    """
    views = [outline(spheres, azimuth) for spheres in _spheres(source) for azimuth in AZIMUTHS_DEG]
    fitted = [(view, left, right) for view in views for left, right in [view.flanks] if left and right]
    sloping = [(view, (left, right)) for view, left, right in fitted if min(left.slope, right.slope) > 0.0]
    if not sloping:
        raise CommandError(f"--from-simulation {source}: none of its views has two flanks to fit")
    feet = np.array([flank_feet(flanks) for _, flanks in sloping])
    return SimulatedPiles(
        source=source,
        piles=len(views) // len(AZIMUTHS_DEG),
        left_deg=np.array([left.angle_deg for _, (left, _) in sloping]),
        right_deg=np.array([right.angle_deg for _, (_, right) in sloping]),
        height=np.array([view.top.max() for view, _ in sloping]),
        half_width=0.5 * (feet[:, 1] - feet[:, 0]),
        front=sloping[0][0],
    )


def _spread(values: Array) -> Spread:
    return Spread(float(values.mean()), float(values.std(ddof=1)) if values.size > 1 else math.nan)


def _spheres(source: str) -> list[Spheres]:
    path = Path(source)
    if path.is_dir():
        files = sorted(path.glob("*.npz")) or sorted((path / "piles").glob("*.npz"))
        if not files:
            raise CommandError(f"--from-simulation {source}: no pile (*.npz) in this folder")
        return [_read(file) for file in files]
    if path.suffix == ".npz":
        return [_read(path)]
    scene = load_scene(source)
    # Taichi takes a second to import, and a scene that cannot be read needs none of it.
    from solver import run_pour

    record = run_pour(scene, SEED)
    if not record.outcome.valid:
        raise CommandError(
            f"--from-simulation {source}: the pour gave no pile: {outcome_text(record.outcome, record.message)}"
        )
    return [record.pile.spheres]


def _read(path: Path) -> Spheres:
    from explorer.files.measured_curves import scanned_spheres

    if not path.is_file():
        raise CommandError(f"--from-simulation: {path}: no such file")
    try:
        return scanned_spheres(path.read_bytes())
    except CommandError as error:
        raise CommandError(f"--from-simulation: {path}: {error}") from None
