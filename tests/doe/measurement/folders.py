"""A small measured data set of beads in a funnel, to be written anywhere and spoiled in one place."""

from __future__ import annotations

from pathlib import Path

import numpy as np

MATERIAL = """
format = 1
[materials.glass]
density = 2500.0
shear_modulus = 1.0e7
poisson_ratio = 0.25
[materials.steel]
youngs_modulus = 2.0e11
poisson_ratio = 0.30
[[body]]
name = "bead"
material = "glass"
shape = { sphere = 12e-3 }
[pair.glass.glass]
static_friction = 0.3
restitution = 0.5
[pair.glass.steel]
static_friction = 0.3
restitution = 0.5
"""

MEASUREMENT = """
format = 1
title = "beads"
source = "made up"
material = "material.toml"

[parameters]
"pair.glass.glass.static_friction" = { mean = 0.3, sd = 0.05 }

[[condition]]
name = "slow"
role = "fit"
rig = "funnel"
data = "slow.csv"
[condition.rig_parameters]
outlet_height = 0.060
mass = 0.014
[condition.insertion]
protocol = "pour_through"
rate = 0.1
region = "cylinder"
region_radius = 0.030
region_z = [0.190, 0.240]
batch_interval = 0.02
velocity = [0.0, 0.0, -0.4]
orientation = "random"
duration = 2.6
[condition.domain]
half_width = 0.3

[[condition]]
name = "fast"
role = "holdout"
rig = "funnel"
data = "fast.csv"
"""

TABLE = """# made up
replicate,observable,x,value
1,angle_of_repose_deg,,20.0
2,angle_of_repose_deg,,22.0     # a comment
1,discharged_mass_kg,0.5,0.001
1,discharged_mass_kg,1.0,0.003
2,discharged_mass_kg,0.5,0.002
"""


def write(folder: Path, files: dict[str, str] | None = None) -> Path:
    """The data set in ``folder``; ``files`` replaces whole files, None as text leaves one out."""
    texts = {
        "measurement.toml": MEASUREMENT,
        "material.toml": MATERIAL,
        "slow.csv": TABLE,
        "fast.csv": TABLE,
    } | (files or {})
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        if text is not None:
            (folder / name).write_text(text, encoding="utf-8")
    return folder


def changed(text: str, old: str, new: str) -> str:
    """``text`` with its one ``old`` replaced."""
    assert text.count(old) >= 1, old
    return text.replace(old, new, 1)


def write_pile(path: Path, beads: int = 6, **arrays: np.ndarray) -> Path:
    """A scan of ``beads`` in a row on the plate."""
    xyz = np.column_stack([0.013 * np.arange(beads), np.zeros(beads), np.full(beads, 6e-3)])
    whole = {"xyz": xyz, "radius": np.full(beads, 6e-3), "body": np.arange(beads)} | arrays
    path.parent.mkdir(exist_ok=True)
    np.savez(path, **{name: array for name, array in whole.items() if array is not None})
    return path
