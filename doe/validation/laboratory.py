"""A made-up laboratory: what it declares, and the folder of data that it hands out.

The model's folder holds ``head.toml`` (parameters), ``material.toml`` and one file per condition; a data set's
``measurement.toml`` is the head and the conditions that were measured.
"""

import math
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from doe.measurement import Measurement, load_measurement

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


def declared_model(model: Path = MODEL) -> Measurement:
    """The declared model with all its conditions; the values in them are placeholders, which nothing may read."""
    conditions = sorted(path.stem for path in model.glob("*.toml") if path.stem not in ("head", "material"))
    placeholders = [dict.fromkeys(OBSERVABLES, 0.0), dict.fromkeys(OBSERVABLES, 1.0)]
    with TemporaryDirectory() as folder:
        write_folder(Path(folder), model, dict.fromkeys(conditions, placeholders))
        return load_measurement(Path(folder))


def write_folder(folder: Path, model: Path, measured: Mapping[str, Sequence[Reading]]) -> None:
    """Write a data set of ``model`` into an existing ``folder``; ``measured``: condition → readings of its pours."""
    shutil.copy(model / "material.toml", folder)
    parts = ["head", *measured]
    text = "\n".join((model / f"{part}.toml").read_text(encoding="utf-8") for part in parts)
    (folder / "measurement.toml").write_text(text, encoding="utf-8")
    for condition, readings in measured.items():
        lines = ["replicate,observable,x,value"]
        for replicate, reading in enumerate(readings, start=1):
            lines += [f"{replicate},{name},,{x!r}" for name, x in reading.items() if math.isfinite(x)]
        (folder / f"{condition}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
