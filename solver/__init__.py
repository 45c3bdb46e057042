"""The physics: a discrete-element solver for rigid multi-sphere bodies, batched over independent worlds.

Names that other packages may use stand in ``__all__``. Importing this package does not import Taichi (which takes a
second and may not happen in the page's process): the names that need it are fetched when they are first used.
"""

import importlib
from typing import TYPE_CHECKING, Any

from solver.assets import AssetNotFoundError, asset_path
from solver.body import Body
from solver.effects import EFFECTS, SetUpEffect
from solver.material_file import load_material
from solver.observables import Value, observable_names, observe
from solver.observables.free_surface import slope_angle_deg
from solver.observables.named import Named, all_names, named, observe_named, observe_scan
from solver.params import Parameter, ParameterError, parse_quantity
from solver.photograph import PhotographedPile, PhotographError, open_picture, read_photograph
from solver.record import Bodies, Entries, Outcome, Phase, Pile, Record, Spheres, Trace
from solver.scan import scanned_pile
from solver.scene import Scene, body_counts, canonical, parameters, pour_rig, value, with_rig, with_values
from solver.set_up import with_set_up, with_settings
from solver.toml_table import read_toml
from solver.version import code_version

if TYPE_CHECKING:
    from solver.crew import Crew
    from solver.run import Job, run_pour, run_pours, run_queue

_NEEDS_TAICHI = {
    "Crew": "solver.crew",
    "Job": "solver.run",
    "run_pour": "solver.run",
    "run_pours": "solver.run",
    "run_queue": "solver.run",
}


def __getattr__(name: str) -> Any:
    if name in _NEEDS_TAICHI:
        return getattr(importlib.import_module(_NEEDS_TAICHI[name]), name)
    raise AttributeError(f"module 'solver' has no attribute {name!r}")


__all__ = [
    "EFFECTS",
    "AssetNotFoundError",
    "Bodies",
    "Body",
    "Crew",
    "Entries",
    "Job",
    "Named",
    "Outcome",
    "Parameter",
    "ParameterError",
    "Phase",
    "PhotographError",
    "PhotographedPile",
    "Pile",
    "Record",
    "Scene",
    "SetUpEffect",
    "Spheres",
    "Trace",
    "Value",
    "all_names",
    "asset_path",
    "body_counts",
    "canonical",
    "code_version",
    "load_material",
    "named",
    "observable_names",
    "observe",
    "observe_named",
    "observe_scan",
    "open_picture",
    "parameters",
    "parse_quantity",
    "pour_rig",
    "read_photograph",
    "read_toml",
    "run_pour",
    "run_pours",
    "run_queue",
    "scanned_pile",
    "slope_angle_deg",
    "value",
    "with_rig",
    "with_set_up",
    "with_settings",
    "with_values",
]
