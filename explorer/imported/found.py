"""What another program's input says of a material, and the scene that it makes.

What a file does not say is that of the starter material, and stands under ``assumed``.
"""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

from doe.table_file import decoded
from explorer.errors import CommandError
from explorer.scene.starter_files import starter_scene
from solver import Scene
from solver.laws.restitution import exponent
from solver.scenes.material_file import scene_from
from solver.shapes.solid import Solid

Numbers = dict[str, float]


@dataclass
class Found:
    """What a file says, in the keys of a material file; gaps are filled by :func:`scene_of`."""

    materials: dict[str, Numbers] = field(default_factory=dict)
    pairs: dict[frozenset[str], Numbers] = field(default_factory=dict)
    """By the names of two materials; one name for a material with itself."""
    bodies: dict[str, dict[str, Any]] = field(default_factory=dict)
    """Name → keys of a ``[[body]]``, ``material`` among them."""
    wall: str = ""
    rolling: float | None = None
    settings: dict[str, Any] = field(default_factory=dict)
    """More of the file: gravity, contact."""
    notes: list[str] = field(default_factory=list)
    """How a number was converted, and what has no counterpart."""


def scene_of(found: Found, path: Path) -> Scene:
    """The scene that ``found`` says; what it leaves open is the starter material's, and assumed."""
    starter, assumed = starter_scene(path), list[str]()
    usual = {name: starter.material(name) for name in ("grain", "steel")}
    bodies: dict[str, dict[str, Any]] = found.bodies or {name: {"material": name} for name in grains(found)}
    poured = list(dict.fromkeys(body["material"] for body in bodies.values()))
    wall = found.wall or next((name for name in found.materials if name not in poured), poured[-1])
    if left := [name for name in found.materials if name not in (*poured, wall)]:
        found.notes.append(f"materials not taken: {', '.join(left)}")
    if not found.bodies:
        found.notes.append(f"no bodies are named: {', '.join(poured)} are poured, and the walls are of {wall}")
    materials = {}
    for name in dict.fromkeys([*poured, wall]):
        entry, like = dict(found.materials.get(name, {})), usual["grain" if name in poured else "steel"]
        moduli = [key for key in ("youngs_modulus", "shear_modulus") if key in entry]
        gaps = {"poisson_ratio": like.poisson_ratio} if len(moduli) < 2 else {}
        gaps |= {} if moduli else {"youngs_modulus": like.youngs_modulus}
        gaps |= {"density": like.density} if name in poured else {}
        assumed += [f"materials.{name}.{key}" for key in gaps if key not in entry]
        materials[name] = gaps | entry
    pairs: dict[str, dict[str, Numbers]] = {}
    for k, a in enumerate(poured):
        for b in dict.fromkeys([*poured[k:], wall]):
            said, usually = found.pairs.get(frozenset((a, b)), {}), starter.pairs[0]
            gaps = {key: getattr(usually, key) for key in ("static_friction", "restitution") if key not in said}
            assumed += [f"pair.{a}.{b}.{key}" for key in gaps]
            pairs.setdefault(a, {})[b] = gaps | said
    rows = []
    for name, body in bodies.items():
        row = {"name": name, "mass_fraction": 1.0 / len(bodies)} | body
        if "shape" not in row and "sphere_centres" not in row:
            row["shape"] = cast(Solid, starter.bodies[0].shape).to_toml()
            assumed.append(f"body.{name}.shape")
        if "mass_fraction" not in body and len(bodies) > 1:
            assumed.append(f"body.{name}.mass_fraction")
        rows.append(row)
    effect = {"effect": {"rolling_resistance": {"rolling_friction": found.rolling}}} if found.rolling else {}
    table = {"format": 1, "title": path.stem, "materials": materials, "body": rows, "pair": pairs, "wall": wall}
    return scene_from(table | {"assumed": assumed} | effect | found.settings, path)


def grains(found: Found) -> list[str]:
    """Materials of bodies where a file names none: all but the wall, which is the last where nothing says else."""
    names = list(found.materials)
    if not found.wall:
        return names[: max(1, len(names) - 1)]
    # Where there is one material only, the wall is made of it as well.
    # A material that meets others but never itself is a wall too.
    meets_itself = {next(iter(pair)) for pair in found.pairs if len(pair) == 1}
    others = [name for name in names if name != found.wall]
    return [name for name in others if name in meets_itself] or others or names


def restitution_of(zeta: float) -> float:
    """The restitution of a contact that never pulls and has the damping ratio ``zeta``."""
    return math.exp(-exponent(zeta)) if zeta > 0.0 else 1.0


def one_rolling(found: Found, rolling: Mapping[frozenset[str], float], poured: Iterable[str]) -> None:
    """The number of the first poured material with itself; here one number holds for all contacts."""
    found.rolling = rolling.get(frozenset((next(iter(poured)),)), next(iter(rolling.values())))
    if len(set(rolling.values())) > 1:
        every = ", ".join(f"{' and '.join(sorted(pair))} {value:g}" for pair, value in rolling.items())
        found.notes.append(f"rolling friction: one number here for all contacts, {found.rolling:g}; there {every}")


def text_of(file: Path) -> str:
    """The text of an input, in whatever characters it was saved."""
    text = decoded(file.read_bytes())
    if text is None:
        raise CommandError(f"{file}: is not text")
    return text


# Arithmetic without running anything.

OPERATORS: Mapping[type[ast.AST], Callable[..., float]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
    ast.Pow: operator.pow, ast.UAdd: operator.pos, ast.USub: operator.neg,
}  # fmt: skip
FUNCTIONS: Mapping[str, Callable[..., float]] = {
    "radians": math.radians, "deg2rad": math.radians, "atan": math.atan, "arctan": math.atan, "tan": math.tan,
    "sqrt": math.sqrt, "exp": math.exp, "log": math.log, "float": float, "int": float,
}  # fmt: skip


def number(node: ast.expr, names: Mapping[str, Any]) -> float:
    """Value of an expression of numbers, known names and the functions above; ValueError for anything else."""
    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            return float(value)
        case ast.Name(id=name) if isinstance(names.get(name), float):
            return float(names[name])
        case ast.Name(id="pi") | ast.Attribute(attr="pi"):
            return math.pi
        case ast.UnaryOp(op=op, operand=operand) if type(op) in OPERATORS:
            return OPERATORS[type(op)](number(operand, names))
        case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATORS:
            try:
                return float(OPERATORS[type(op)](number(left, names), number(right, names)))
            except (ArithmeticError, TypeError) as error:
                raise ValueError(str(error)) from None
        case ast.Call(func=func, args=[argument]) if (name := called(func)) in FUNCTIONS:
            try:
                return FUNCTIONS[name](number(argument, names))
            except ArithmeticError as error:
                raise ValueError(str(error)) from None
    raise ValueError(ast.unparse(node))


def called(func: ast.expr) -> str:
    """Name of what a call calls: of a method its last part; empty for anything else."""
    return func.attr if isinstance(func, ast.Attribute) else func.id if isinstance(func, ast.Name) else ""
