"""A grain given by its shape, sizes, density and friction, in the starter material of `explorer new material`."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from explorer.scene.starter_files import new_path, starter_scene, write_new
from explorer.scene.text import material_toml
from solver import Scene, value, with_values
from solver.shapes.solid import Kind, Solid

SHAPES: dict[str, tuple[Kind, tuple[str, ...]]] = {
    "seed (ellipsoid)": ("ellipsoid", ("Length", "Width", "Thickness")),
    "sphere": ("sphere", ("Diameter",)),
    "plate (box)": ("box", ("Length", "Width", "Thickness")),
    "rod (cylinder)": ("cylinder", ("Diameter", "Length")),
}
"""Shape → solid and the names of its full lengths, in order."""
DENSITY, FRICTION, WALL_FRICTION = (
    "material.grain.density",
    "pair.grain.grain.static_friction",
    "pair.grain.steel.static_friction",
)
"""Paths of the parameters of the starter material that a grain sets."""
ASSUMED_AS = {DENSITY: "materials.grain.density"}
"""Path → its name in the list of assumed values, if that differs."""
SHAPE = "body.grain.shape"


@dataclass(frozen=True)
class Grain:
    """One kind of grain, and how many of it are poured."""

    name: str
    shape: str
    """One of ``SHAPES``."""
    lengths: tuple[float, ...]
    """Full lengths [m], in the order of ``SHAPES``."""
    density: float
    """Density of one grain [kg/m³]."""
    friction: float
    """Static friction, grain on grain."""
    wall_friction: float
    """Static friction, grain on funnel and plate."""
    number: int


def grain_scene(grain: Grain) -> Scene:
    """The starter material with ``grain`` as its body; the poured mass is that of ``grain.number`` grains.

    Values that differ from the starter are no longer listed as assumed. Raises ShapeError or ParameterError, in one
    line.
    """
    starter = starter_scene(Path(f"{grain.name}.toml"))
    body = replace(starter.bodies[0], shape=Solid(SHAPES[grain.shape][0], grain.lengths))
    given = {DENSITY: grain.density, FRICTION: grain.friction, WALL_FRICTION: grain.wall_friction}
    known = {ASSUMED_AS.get(path, path) for path, number in given.items() if number != value(starter, path)}
    known |= {SHAPE} if body.shape != starter.bodies[0].shape else set()
    scene = replace(starter, bodies=(body,), assumed=tuple(path for path in starter.assumed if path not in known))
    scene = with_values(scene, dict(given))
    return with_values(scene, {"rig.mass": grain.number * scene.bodies[0].mass})


def write_grain(folder: Path, grain: Grain) -> Path:
    """Write ``NAME.toml`` into ``folder``. Raises CommandError if the file exists or the name is not allowed."""
    path = new_path(folder, grain.name)
    lengths = " × ".join(f"{1e3 * length:.4g}" for length in grain.lengths)
    heading = f"{grain.name}: {grain.shape}, {lengths} mm. SI; what nobody has measured yet stands under assumed."
    return write_new(path, material_toml(grain_scene(grain), heading))
