"""A deck: everything that another engine needs to repeat a pour, in SI and in no engine's terms.

``deck.json`` holds it in every exported folder; LIGGGHTS's input is written from it, YADE's script reads it.
"""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from solver import Entries

Array = npt.NDArray[np.float64]
FILE = "deck.json"


@dataclass(frozen=True)
class Clump:
    """One component: member spheres in the principal frame about the centre of mass, mass, inertia and material."""

    name: str
    centres: Array
    """[m], shape (m, 3)."""
    radii: Array
    """[m], shape (m,)."""
    mass: float
    """[kg]."""
    inertia: Array
    """Principal moments about x, y, z [kg m²], shape (3,)."""
    density: float
    """Of the material [kg/m³]; the mass does not follow from it."""
    youngs_modulus: float
    poisson_ratio: float


@dataclass(frozen=True)
class Mesh:
    """A thin wall of triangles, which pushes from either side."""

    name: str
    triangles: Array
    """Corners [m], shape (t, 3, 3)."""
    until_step: int = -1
    """The wall is taken away when this many steps are done; −1: never."""


@dataclass(frozen=True)
class Deck:
    """A pour. The wall's contact class is the last one, after the components."""

    title: str
    seed: int
    dt: float
    """[s]."""
    steps: int
    gravity: tuple[float, float, float]
    """[m/s²]."""
    clumps: tuple[Clump, ...]
    wall_youngs_modulus: float
    wall_poisson_ratio: float
    friction: Array
    """μ, shape (classes, classes)."""
    restitution: Array
    """e of a single contact, shape (classes, classes)."""
    rolling_friction: float
    """μ_r of all contacts: a torque spring k_t R*² with its cap at μ_r R* F_n; 0: nothing resists rolling."""
    law: str
    """Name of the law here (``solver.laws``)."""
    characteristic_velocity: float
    """Of linear springs [m/s]; Hertz–Mindlin does not read it."""
    tangential_law: str
    tangential_dashpot: str
    """Conventions that the pour was calculated with here (``solver.scenes.material``); an engine has its own."""
    entries: Entries
    plate: float | None
    """Height of the infinite plate [m]; None: there is none."""
    meshes: tuple[Mesh, ...]
    box: Array
    """Corners (low, high) of the room in which bodies are expected [m], shape (2, 3)."""

    @property
    def bodies(self) -> int:
        """Number of bodies that enter."""
        return len(self.entries.step)

    def members(self, body: int) -> Array:
        """Centres of the member spheres of a body in its principal frame [m], shape (m, 3)."""
        return self.clumps[int(self.entries.component[body])].centres


def write_deck(folder: Path, deck: Deck) -> None:
    """Write ``deck.json`` into ``folder``."""
    text = json.dumps(dataclasses.asdict(deck), indent=1, default=lambda array: array.tolist(), allow_nan=False)
    (folder / FILE).write_text(text + "\n", encoding="utf-8")


def read_deck(folder: Path) -> Deck:
    """The deck in ``folder``; OSError where there is none."""
    table: dict[str, Any] = json.loads((folder / FILE).read_text(encoding="utf-8"))
    table["clumps"] = tuple(Clump(**_arrays(entry, "centres", "radii", "inertia")) for entry in table["clumps"])
    table["meshes"] = tuple(Mesh(**_arrays(entry, "triangles")) for entry in table["meshes"])
    entries = table["entries"]
    whole = {key: np.array(entries[key], dtype=np.int32) for key in ("step", "component")}
    table["entries"] = Entries(**(_arrays(entries, "time", "position", "quaternion", "velocity") | whole))
    table["gravity"] = tuple(table["gravity"])
    return Deck(**_arrays(table, "friction", "restitution", "box"))


def _arrays(table: dict[str, Any], *keys: str) -> dict[str, Any]:
    return table | {key: np.array(table[key], dtype=float) for key in keys}
