"""A made-up laboratory: what it declares, and the folder of data that it hands out.

The model's folder holds ``head.toml`` (parameters), ``material.toml`` and one file per condition; a data set's
``measurement.toml`` is the head and the conditions that were measured. Beside the table of numbers it hands out scans
of its piles, made by a scanner of its own (``scanner.py``).
"""

import math
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import numpy.typing as npt

from doe.measurement import Measurement, load_measurement
from doe.validation.scanner import Scanner, write_scan

Array = npt.NDArray[np.float64]

MODEL = Path(__file__).parent / "model"
OBSERVABLES = (
    "angle_of_repose_deg",
    "angle_of_repose_left_deg",
    "angle_of_repose_right_deg",
    "apex_height_m",
    "centre_height_m",
    "footprint_r50_m",
    "footprint_r90_m",
    "stray_fraction",
    "centroid_x_m",
    "centroid_y_m",
    "discharge_t10_s",
    "discharge_t90_s",
    "residual_mass_kg",
)
"""What every laboratory reads off its pours: scalars, all of them summaries or parts of one."""

Reading = Mapping[str, float]
"""Observable → value of one pour; NaN where it cannot be read."""


@dataclass(frozen=True)
class Sample:
    """One pour as the laboratory has it: its readings, and the spheres (m, 3) and (m,) [m] that a scanner sees."""

    reading: Reading
    centre: Array
    radius: Array


def declared_model(model: Path = MODEL) -> Measurement:
    """The declared model with all its conditions; the values in them are placeholders, which nothing may read."""
    conditions = sorted(path.stem for path in model.glob("*.toml") if path.stem not in ("head", "material"))
    placeholders = [dict.fromkeys(OBSERVABLES, 0.0), dict.fromkeys(OBSERVABLES, 1.0)]
    with TemporaryDirectory() as folder:
        write_folder(Path(folder), model, dict.fromkeys(conditions, placeholders))
        return load_measurement(Path(folder))


def write_folder(folder: Path, model: Path, measured: Mapping[str, Sequence[Reading]], scan_settings: str = "") -> None:
    """Write a data set of ``model`` into an existing ``folder``.

    ``measured``: condition → readings of its pours. ``scan_settings``: what stands in every condition of its scans.
    """
    shutil.copy(model / "material.toml", folder)
    parts = [(model / "head.toml").read_text(encoding="utf-8")]
    for condition in measured:
        parts += [(model / f"{condition}.toml").read_text(encoding="utf-8"), scan_settings]
    (folder / "measurement.toml").write_text("\n".join(parts), encoding="utf-8")
    for condition, readings in measured.items():
        lines = ["replicate,observable,x,value"]
        for replicate, reading in enumerate(readings, start=1):
            lines += [f"{replicate},{name},,{x!r}" for name, x in reading.items() if math.isfinite(x)]
        (folder / f"{condition}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


def hand_out(
    folder: Path, model: Path, measured: Mapping[str, Sequence[Sample]], scanner: Scanner | None, seed: Sequence[int]
) -> None:
    """Write a data set of pours into an existing ``folder``, with scans where there is a ``scanner``."""
    readings = {condition: [sample.reading for sample in samples] for condition, samples in measured.items()}
    write_folder(folder, model, readings, scanner.toml() if scanner else "")
    if scanner is None:
        return
    (folder / "scans").mkdir()
    for c, (condition, samples) in enumerate(measured.items()):
        for replicate, sample in enumerate(samples, start=1):
            rng = np.random.default_rng([*seed, c, replicate])
            write_scan(
                folder / "scans" / f"{condition}_{replicate}.npz", scanner.scan(sample.centre, sample.radius, rng)
            )
