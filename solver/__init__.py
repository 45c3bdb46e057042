"""The physics: a discrete-element solver for rigid multi-sphere bodies, batched over independent worlds.

Names that other packages may use stand in ``__all__``. Those in ``_LATE`` are fetched when they are first used, so that
importing this package imports neither Taichi, which takes a second and may not happen in the page's process, nor what
reads photographs.
"""

import importlib
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from solver.assets import AssetNotFoundError, asset_path, own_path
from solver.effects import EFFECTS, SetUpEffect, Telltale
from solver.machine import available_cores, memory_limits
from solver.npz import NpzError, npz_arrays
from solver.observables import OBSERVABLES, Value, observable_names, observables_in, observe
from solver.observables.free_surface import slope_angle_deg
from solver.observables.named import Named, all_names, named, observe_named, observe_scan
from solver.observables.scan import scanned_pile
from solver.observables.surface import HeightMap, coarsened, height_map
from solver.observables.surface_features import (
    ASYMMETRY_NAMES,
    BULK_NAMES,
    HISTOGRAM_NAMES,
    PROFILE_NAMES,
    SURFACE_NAMES,
    TEXTURE_NAMES,
    Frame,
    frame_of,
    profile_features,
    surface_features,
    without_holes,
)
from solver.params import Parameter, ParameterError, parse_quantity
from solver.plugins import PluginError, Registry, instance_of, plugged_in
from solver.pours.pour_key import pour_key, pour_keys
from solver.pours.raw_pour import RawPourError, packed, unpacked
from solver.pours.record import Bodies, Entries, Outcome, Phase, Pile, Record, Spheres, Trace
from solver.rigs import RIGS
from solver.scenes.body import Body, Members
from solver.scenes.material_file import (
    EffectTables,
    InsertionTable,
    NumericsTable,
    RigTable,
    Settings,
    files_named_in,
    is_material,
    load_material,
    with_set_up,
    with_settings,
)
from solver.scenes.scene import (
    Scene,
    actual,
    body_counts,
    canonical,
    parameters,
    pour_rig,
    poured_mass,
    value,
    with_rig,
    with_values,
)
from solver.shapes.clump_error import ClumpFit
from solver.toml_file import (
    TABLE,
    Like,
    Names,
    Number,
    Quantity,
    Scalar,
    TomlTable,
    Vector,
    Whole,
    checked,
    json_schema,
    naming_file,
    one_of,
    read_toml,
)
from solver.version import PHYSICS

if TYPE_CHECKING:
    from solver.engine.world import Batch
    from solver.photograph import PhotographedPile, PhotographError, open_picture, read_photograph
    from solver.pours.executor import Executor, check_scheduler, executor
    from solver.pours.pour import Pour
    from solver.pours.run import Job, capacity_for, run_pour, run_pours, run_queue
    from solver.pours.worker_pool import PourBrokeOff, WorkerPool, begin_worker, warm_up
    from solver.single_body.plate_tests import PlateTest, plate_tests

NO_HOME = "/nonexistent"
"""As Debian calls the home of accounts that have none."""

_LATE = {
    "Batch": "solver.engine.world",
    "WorkerPool": "solver.pours.worker_pool",
    "Executor": "solver.pours.executor",
    "Job": "solver.pours.run",
    "PhotographError": "solver.photograph",
    "PhotographedPile": "solver.photograph",
    "Pour": "solver.pours.pour",
    "PlateTest": "solver.single_body.plate_tests",
    "PourBrokeOff": "solver.pours.worker_pool",
    "begin_worker": "solver.pours.worker_pool",
    "capacity_for": "solver.pours.run",
    "check_scheduler": "solver.pours.executor",
    "executor": "solver.pours.executor",
    "open_picture": "solver.photograph",
    "plate_tests": "solver.single_body.plate_tests",
    "read_photograph": "solver.photograph",
    "run_pour": "solver.pours.run",
    "run_pours": "solver.pours.run",
    "run_queue": "solver.pours.run",
    "warm_up": "solver.pours.worker_pool",
}


def _ensure_home() -> None:
    """Set ``HOME`` where it is not: Taichi aborts without, and what is kept for a user would land in a folder ``~``.

    An account without an entry, as in a container, has no home: it gets one that there is not, so that what is kept
    between commands is as in a place that cannot be written. (A folder that others may write into would be worse:
    compiled kernels are read back from it and run.)
    """
    if os.environ.get("HOME"):
        return
    try:
        # Of the account's entry: `home` would believe an empty variable.
        os.environ.pop("HOME", None)
        os.environ["HOME"] = str(Path.home())
    except RuntimeError:
        os.environ["HOME"] = NO_HOME


_ensure_home()


def __getattr__(name: str) -> Any:
    if name in _LATE:
        return getattr(importlib.import_module(_LATE[name]), name)
    raise AttributeError(f"module 'solver' has no attribute {name!r}")


__all__ = [
    "ASYMMETRY_NAMES",
    "BULK_NAMES",
    "EFFECTS",
    "HISTOGRAM_NAMES",
    "OBSERVABLES",
    "PHYSICS",
    "PROFILE_NAMES",
    "RIGS",
    "SURFACE_NAMES",
    "TABLE",
    "TEXTURE_NAMES",
    "AssetNotFoundError",
    "Batch",
    "Bodies",
    "Body",
    "ClumpFit",
    "EffectTables",
    "Entries",
    "Executor",
    "Frame",
    "HeightMap",
    "InsertionTable",
    "Job",
    "Like",
    "Members",
    "Named",
    "Names",
    "NpzError",
    "Number",
    "NumericsTable",
    "Outcome",
    "Parameter",
    "ParameterError",
    "Phase",
    "PhotographError",
    "PhotographedPile",
    "Pile",
    "PlateTest",
    "PluginError",
    "Pour",
    "PourBrokeOff",
    "Quantity",
    "RawPourError",
    "Record",
    "Registry",
    "RigTable",
    "Scalar",
    "Scene",
    "SetUpEffect",
    "Settings",
    "Spheres",
    "Telltale",
    "TomlTable",
    "Trace",
    "Value",
    "Vector",
    "Whole",
    "WorkerPool",
    "actual",
    "all_names",
    "asset_path",
    "available_cores",
    "begin_worker",
    "body_counts",
    "canonical",
    "capacity_for",
    "check_scheduler",
    "checked",
    "coarsened",
    "executor",
    "files_named_in",
    "frame_of",
    "height_map",
    "instance_of",
    "is_material",
    "json_schema",
    "load_material",
    "memory_limits",
    "named",
    "naming_file",
    "npz_arrays",
    "observable_names",
    "observables_in",
    "observe",
    "observe_named",
    "observe_scan",
    "one_of",
    "open_picture",
    "own_path",
    "packed",
    "parameters",
    "parse_quantity",
    "plate_tests",
    "plugged_in",
    "pour_key",
    "pour_keys",
    "pour_rig",
    "poured_mass",
    "profile_features",
    "read_photograph",
    "read_toml",
    "run_pour",
    "run_pours",
    "run_queue",
    "scanned_pile",
    "slope_angle_deg",
    "surface_features",
    "unpacked",
    "value",
    "warm_up",
    "with_rig",
    "with_set_up",
    "with_settings",
    "with_values",
    "without_holes",
]
