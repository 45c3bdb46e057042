"""Short pours of every contact law, effect, rig, shape kind and batch size: the numbers that their bits are taken of.

The registries are walked, so that a new effect or rig is a case as soon as it is listed. Four kinds of case:

    heap     twelve clumps that touch from the first step on, placed by hand; alone, in a batch, and with every effect
             on contacts and flight
    pour     a pour into a rig, cut off after a second; of every rig, and with every effect of material and set-up
    bench    every test of a single body
    shape    member spheres, mass and inertia of a solid of every kind

Heaps and pours are of a clump declared by its spheres: no fit of spheres stands between a law and its bits.
"""

import dataclasses
import hashlib
import os
from collections.abc import Mapping
from pathlib import Path
from typing import get_args
from unittest.mock import patch

import numpy as np
import numpy.typing as npt
import trimesh

from solver.assets import measurement_folder
from solver.effects import EFFECTS, set_up_effects
from solver.engine.tables import body_tables
from solver.engine.world import SUMMARY_COLUMNS, Batch, compiled_in
from solver.laws import CONTACT_LAWS, HertzMindlin
from solver.pours.pour import Pour
from solver.pours.run import capacity_for
from solver.rigs import BENCH_RIGS, RIGS
from solver.scenes.contact_model import ContactModel
from solver.scenes.insertion import Insertion
from solver.scenes.material import Material, Pair
from solver.scenes.material_file import load_material
from solver.scenes.numerics import Numerics
from solver.scenes.scene import Scene, pour_rig, with_rig, with_values
from solver.scenes.time_step import time_step
from solver.shapes import clump
from solver.shapes.solid import Kind, Solid, mass_properties
from solver.single_body import BENCH_TESTS
from solver.single_body.free_world import ROOM, UPRIGHT
from tests.solver.effects.cases import IN_KERNELS, felt, with_effects

Array = npt.NDArray[np.float64]
Numbers = dict[str, Array]
"""Case → numbers whose bits count."""

FIRST = 200
"""Steps after which states are compared on another processor."""
CLUMPS, HEAP_STEPS = 12, 4000
"""0.1 s."""
OF_THE_LIST = ("rebuilds", "contacts")
"""Columns of a summary that say how the contact list is kept, which is no physics."""
POUR_TIME = 1.0
"""[s]; enough for every rig to begin to act, and for the drum to be watched."""
TREFOIL = with_values(
    load_material(str(measurement_folder("trefoil_1") / "material.toml")), {"material.grain.shear_modulus": 3e6}
)
"""Softer than declared: the time step is four times as long."""
ACROSS, UP = 11.19e-3, 5.995e-3
"""Distances of the clumps of a heap [m]: those beside and above each other overlap by some micrometres."""
FEW = {
    "funnel": {"rig.mass": 1.5e-3, "rig.outlet_height": 0.02},
    "mesh_funnel": {"rig.mass": 1.5e-3, "rig.outlet_height": 0.02},
    "lifting_cylinder": {"rig.mass": 1.5e-3, "rig.cylinder_height": 0.05, "rig.lift_speed": 0.1},
    "lipped_plate": {
        "rig.mass": 1.5e-3,
        "rig.cylinder_height": 0.05,
        "rig.lift_speed": 0.1,
        "rig.diameter": 0.04,
        "rig.lip_diameter": 0.05,
        "insertion.region_radius": 0.015,
    },
    "draw_down_box": {"rig.mass": 3e-3, "rig.width": 0.12, "rig.depth": 0.04, "rig.shelf_height": 0.03},
    "rotating_drum": {
        "rig.diameter": 0.06,
        "rig.axial_length": 0.03,
        "rig.filled_volume": 1.2e-5,
        "rig.speed_rpm": 60.0,
        "rig.transient_turns": 0.05,
    },
}
"""Settings of each rig in which a dozen bodies are enough; what is not listed is poured as it is."""
CONVENTIONS = {"local_mass": "clump_rule", "mindlin": "tangential_law", "uncapped": "tangential_dashpot"}
"""Choice → the parameter of ``contact`` that has it."""
SHARED = with_values(TREFOIL, {"contact.clump_rule": "local_mass_shared"})
SHAPES: Mapping[str, tuple[float, ...]] = {
    "ellipsoid": (12e-3, 8e-3, 5e-3),
    "box": (10e-3, 8e-3, 5e-3),
    "cylinder": (4e-3, 12e-3),
    "sphere": (8e-3,),
    "mesh": (),
}


def pours() -> dict[str, Scene]:
    """Scenes of the pours by name."""
    found = {}
    for name in RIGS:
        scene = with_values(with_rig(TREFOIL, name), {"insertion.rate": 0.1} | FEW.get(name, {}))
        for protocol in pour_rig(scene).protocols:
            found[f"pour, {name}, {protocol}"] = with_values(scene, {"insertion.protocol": protocol})
    funnel = found["pour, funnel, pour_through"]
    # The first bodies sleep while the last ones fall, and the contact list is built again and again.
    found["pour, half of it asleep"] = with_values(funnel, {"rig.mass": 6e-3, "insertion.rate": 0.01})
    several = {"body.spheres": "coarse", "rig.mass": 4e-3, "insertion.rate": 0.1, "insertion.lead": 0.02}
    several |= {"numerics.duration": 0.8, "body.seed.size_distribution": "uniform", "body.seed.size_spread": 0.1}
    found["pour of a mixture of solids"] = with_values(load_material("sunflower_extract"), several)
    return found | {
        f"pour with {_revised(kind.name)}": with_effects(funnel, felt(kind.name)) for kind in set_up_effects()
    }


def _revised(name: str) -> str:
    """An effect with its revision, if that is not its first: another revision is another case."""
    revision = EFFECTS[name].revision
    return f"{name}, revision {revision}" if revision > 1 else name


def heap_numbers(scenes: Mapping[str, Scene], worlds: int = 1, first: int = 0) -> tuple[Numbers, Numbers]:
    """States of heaps after ``FIRST`` and after ``HEAP_STEPS`` steps, in a batch of ``worlds`` from ``first`` on."""
    batch = Batch(dataclasses.replace(ROOM, worlds=worlds, **compiled_in(list(scenes.values()))))
    steps = np.zeros(worlds, dtype=np.int32)
    for w, scene in enumerate(scenes.values(), start=first):
        batch.load(
            w, scene, body_tables(scene, np.zeros(CLUMPS, dtype=np.int32)), time_step(scene), (True, True, False)
        )
        rng = np.random.default_rng(7)
        for b in range(CLUMPS):
            place = np.array([ACROSS * (b % 2), ACROSS * (b // 2 % 2), UP * (b // 4) + 2.998e-3])
            batch.enter(w, b, place, UPRIGHT, rng.normal(0, 0.05, 3), rng.normal(0, 5.0, 3))
        steps[w] = FIRST

    def states() -> Numbers:
        return {name: batch.bodies(w, CLUMPS).copy() for w, name in enumerate(scenes, start=first)}

    batch.advance(steps)
    early = states()
    rows = batch.advance(np.where(steps > 0, HEAP_STEPS - FIRST, 0).astype(np.int32))
    late = states()
    rows = np.delete(rows, [SUMMARY_COLUMNS.index(name) for name in OF_THE_LIST], axis=1)
    return early, {name: np.append(late[name], rows[w]) for w, name in enumerate(scenes, start=first)}


def pour_numbers(scenes: Mapping[str, Scene]) -> tuple[Numbers, Numbers]:
    """States of the pours after ``FIRST`` steps, and their states and curves after ``POUR_TIME``, side by side."""
    batch = Batch(capacity_for(list(scenes.values()), len(scenes)))
    running = {name: Pour(batch, w, scene, 5) for w, (name, scene) in enumerate(scenes.items())}
    early: Numbers = {}
    while True:
        due = [0 if p.time >= POUR_TIME else p.steps_due(None if early else FIRST) for p in running.values()]
        if not any(due):
            break
        rows = batch.advance(np.array(due, dtype=np.int32))
        for w, pour in enumerate(running.values()):
            pour.after(due[w], rows[w])
        early = early or {name: batch.bodies(pour.w, pour.entered).copy() for name, pour in running.items()}
    return early, {name: _all_of(pour) for name, pour in running.items()}


def _all_of(pour: Pour) -> Array:
    curves = [x for sample in pour.samples for name, x in sample.items() if name not in OF_THE_LIST]
    surface = [height for _, heights in pour._free_surface for height in heights]
    decided = [pour.steps, pour.gate_opened, pour.entered, *pour.ended[0].value.encode()]
    state = pour.batch.bodies(pour.w, pour.entered).ravel()
    return np.concatenate([state, curves, surface, decided, pour.record().in_pile])


def bench_numbers() -> tuple[Numbers, Numbers]:
    """What the tests of a single body measure: quantities alone, and with the series that they are read off."""
    results = {f"bench, {name}": measure(with_rig(TREFOIL, name), 1) for name, measure in BENCH_TESTS.items()}
    quantities = {name: np.array([q.value for q in result.quantities]) for name, result in results.items()}
    series = {name: [x for _, row in result.series for x in row] for name, result in results.items()}
    return quantities, {name: np.array([*quantities[name], *series[name]]) for name in results}


def shape_numbers(folder: Path) -> Numbers:
    """Centres, radii, mass and inertia of clumps fitted to a solid of every kind; ``folder``: an empty one."""
    trimesh.creation.box((12e-3, 9e-3, 5e-3)).export(folder / "box.stl")
    found = {}
    clump._fit_spheres.cache_clear()
    # A fit that is kept says nothing about the code of today.
    with patch.dict(os.environ, {"REPOSE_CACHE": str(folder / "fits")}):
        for kind in get_args(Kind):
            solid = Solid(kind, SHAPES[kind], file=str(folder / "box.stl") if kind == "mesh" else "")
            for spheres in ("coarse", "7"):
                fitted = clump.fit_clump(solid, 1000.0, spheres)
                parts = [fitted.centres.ravel(), fitted.radii, [fitted.mass], fitted.inertia]
                found[f"shape, {kind}, {spheres}"] = np.concatenate([*parts, mass_properties(solid, 1000.0).extents])
    return found


def defaults() -> dict[str, float | str]:
    """Declared default of every parameter that has one, by path: the key of a stored pour leaves these out."""
    kinds = {"insertion": Insertion, "numerics": Numerics}
    kinds |= {f"rig[{name}]": kind for name, kind in (*RIGS.items(), *BENCH_RIGS.items())}
    kinds |= {f"effect.{name}": kind for name, kind in EFFECTS.items()}
    kinds |= {"material": Material, "pair": Pair, "contact": ContactModel}
    return {
        f"{prefix}.{field.name}": field.default
        for prefix, kind in kinds.items()
        for field in dataclasses.fields(kind)
        if "parameter" in field.metadata
    }


def everything(folder: Path) -> tuple[Numbers, Numbers]:
    """Early and late numbers of all cases; those of shapes have late ones only. ``folder``: an empty one."""
    plain, beside = {"heap, alone": TREFOIL}, {"heap, second of three": TREFOIL}
    moved = {f"heap with {_revised(name)}": with_effects(TREFOIL, felt(name)) for name in IN_KERNELS}
    moved |= {f"heap, {name}": with_values(TREFOIL, {f"contact.{key}": name}) for name, key in CONVENTIONS.items()}
    poured = pours()
    # A batch with room for a mesh is another kernel.
    meshes = {name: poured.pop(name) for name in [*poured] if "mesh" in name}
    funnel, other_laws = poured["pour, funnel, pour_through"], [law for law in CONTACT_LAWS if law != HertzMindlin.name]
    early: Numbers = {}
    late: Numbers = {}
    for first, last in (
        heap_numbers(plain),
        heap_numbers(beside, worlds=3, first=1),
        heap_numbers(moved, worlds=len(moved)),
        heap_numbers({"heap, local_mass_shared": SHARED}),
        pour_numbers(poured),
        pour_numbers(meshes),
        *(heap_numbers({f"heap, {law}": with_values(TREFOIL, {"contact.law": law})}) for law in other_laws),
        *(pour_numbers({f"pour, funnel, {law}": with_values(funnel, {"contact.law": law})}) for law in other_laws),
        bench_numbers(),
    ):
        early |= first
        late |= last
    return early, late | shape_numbers(folder)


def digests(late: Numbers) -> dict[str, str]:
    """Digest of the bits of each case."""
    return {name: hashlib.sha256(np.ascontiguousarray(bits).tobytes()).hexdigest()[:16] for name, bits in late.items()}
