"""The set-up of a calibration: what was poured (material, pairs, bodies), and a drawing of the rig with its dimensions.

All of it comes from what the result holds (`doe.provenance.SetUp`). The drawing shows the rig's own surfaces cut by the
plane y = 0, so any rig, also one of a plug-in, is drawn as it is before it moves.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from html import escape
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from doe.provenance import SetUp
from explorer.report.content import Block, Drawing, Section, Table, Text
from explorer.units import enumeration, number, parameter_value
from solver import RIGS, Scene, parameters, value
from solver.params import ParameterError
from solver.rigs.surface import Plane, Revolved, Surface
from solver.scenes.scene import actual
from solver.scenes.time_step import time_step

Array = npt.NDArray[np.float64]
Stroke = tuple[Array, str]
"""Corners (n, 2) in the plane x–z [m], and the name of the surface."""

WIDTH, MARGIN, LEAST_GAP, TICK = 560.0, 130.0, 17.0, 4.0
"""Width of the drawing, margin for dimensions, gap between two of them, half the tick at their ends [px]."""
SAME = 1e-9
"""Lengths that differ by less than this are equal [m]."""
MOST_CORNERS = 64
MOST_WIDTHS = 4
MARK = " †"
"""Mark after an assumed value."""
NO_DENSITY = "–"


def set_up_of(scene: Scene) -> SetUp:
    """What a result keeps of the scene at its reference values."""
    found: dict[str, float | str] = {path: value(scene, path) for path in parameters(scene)}
    materials = {body.name: body.material for body in scene.bodies}
    return SetUp(scene.rig.name, scene.rig.wall, time_step(actual(scene)), found, materials)


def set_up(found: SetUp | None, assumed: Sequence[str], experiments: Mapping[str, SetUp]) -> Section | None:
    """Rig of the study and of each further experiment, materials, pairs, bodies; None for results without them."""
    if found is None:
        return None
    blocks = _rig("Rig", found)
    for name, other in experiments.items():
        blocks += _rig(f"Experiment {name.replace('_', ' ')}", other)
    blocks += material_tables(found, assumed)
    return Section("Set-up and material", tuple(blocks))


def _rig(words: str, found: SetUp) -> list[Block]:
    """A rig in a line, and its drawing."""
    text = (
        f"{words}: {found.rig.replace('_', ' ')}; {parameter_value('rig.mass', found.values['rig.mass'])} poured; "
        f"time step {number(1e6 * found.dt)} µs. Values at the reference setting; those of the factors are varied."
        if "rig.mass" in found.values
        else f"{words}: {found.rig.replace('_', ' ')}; time step {number(1e6 * found.dt)} µs."
    )
    drawing = rig_drawing(found)
    return [Text(text), *([] if drawing is None else [drawing])]


def material_tables(found: SetUp, assumed: Sequence[str]) -> list[Table]:
    """Materials, pairs and bodies with every number that another engine needs; † marks assumed values."""
    values, guesses = found.values, is_assumed(assumed)
    used = list(dict.fromkeys([*found.materials.values(), found.wall]))
    keys = ("density", "shear_modulus", "poisson_ratio")

    def shown(path: str) -> str:
        return parameter_value(path, values[path]) + (MARK if path in guesses else "")

    rows = []
    for name in used:
        shear, ratio = (float(values[f"material.{name}.{key}"]) for key in keys[1:])
        young = parameter_value(f"material.{name}.shear_modulus", 2.0 * shear * (1.0 + ratio))
        density = shown(f"material.{name}.density") if name in found.materials.values() else NO_DENSITY
        rows.append((name.replace("_", " "), density, *(shown(f"material.{name}.{key}") for key in keys[1:]), young))
    note = f"{MARK.strip()} assumed." if guesses else ""
    tables = [
        Table(
            ("material", "density", "shear modulus", "Poisson’s ratio", "Young’s modulus"),
            tuple(rows),
            f"E = 2 G (1 + ν). {note}".strip(),
        )
    ]
    pairs = [path.split(".")[1:3] for path in values if path.startswith("pair.")]
    pairs = [list(pair) for pair in dict.fromkeys(map(tuple, pairs)) if set(pair) <= set(used)]
    kinds = ("static_friction", "restitution")
    rolling = parameter_value("effect.rolling_resistance.rolling_friction", values.get(ROLLING, 0.0))
    tables.append(
        Table(
            ("pair", "static friction", "restitution"),
            tuple(
                ("–".join(pair).replace("_", " "), *(shown(f"pair.{pair[0]}.{pair[1]}.{kind}") for kind in kinds))
                for pair in pairs
                if all(f"pair.{pair[0]}.{pair[1]}.{kind}" in values for kind in kinds)
            ),
            f"Rolling friction of all pairs: {rolling}. {note}".strip(),
        )
    )
    rows = []
    for body, material in found.materials.items():
        own = {path.rsplit(".", 1)[-1]: path for path in values if path.startswith(f"body.{body}.")}
        sizes = [f"{key} {shown(own[key])}" for key in own if key not in NOT_A_SIZE]
        spread = values.get(f"body.{body}.size_distribution", "none")
        share = shown(own["mass_fraction"]) if "mass_fraction" in own else "1"
        scatter = "none" if spread == "none" else f"{spread}, {values[own['size_spread']]}".replace("_", " ")
        rows.append((body, material, share, enumeration(sizes), scatter))
    tables.append(Table(("body", "material", "mass fraction", "size", "spread of sizes"), tuple(rows), note))
    return [table for table in tables if table.rows]


ROLLING = "effect.rolling_resistance.rolling_friction"
NOT_A_SIZE = ("mass_fraction", "size_distribution", "size_spread")


def is_assumed(assumed: Sequence[str]) -> set[str]:
    """Paths of parameters among the assumed entries of a material file; a Young's modulus gives the shear modulus."""
    found = {name.replace("materials.", "material.", 1) for name in assumed}
    return found | {path.replace("youngs_modulus", "shear_modulus") for path in found}


# The drawing


def rig_drawing(found: SetUp) -> Drawing | None:
    """The rig from the side with its dimensions; None for a rig that this program does not know (a plug-in's)."""
    kind: Any = RIGS.get(found.rig)
    if kind is None:
        return None
    own = {path.removeprefix("rig."): one for path, one in found.values.items() if path.startswith("rig.")}
    known = {field.name for field in fields(kind)}
    try:
        rig: Any = kind(**{"wall": found.wall} | {name: one for name, one in own.items() if name in known})
        surfaces = dict(zip(rig.surface_names, rig.surfaces(), strict=True))
    except (ParameterError, TypeError, ValueError):
        return None
    strokes = [(line, name) for name, one in surfaces.items() for line in _cut(one)]
    lengths = {name: float(one) for name, one in own.items() if isinstance(one, float | int)}
    if not strokes:
        return None
    words = found.rig.replace("_", " ")
    sizes = [f"{name.replace('_', ' ')} {parameter_value(f'rig.{name}', one)}" for name, one in lengths.items()
             if name != "domain_half_width"]  # fmt: skip
    return Drawing(
        "set-up",
        _svg(strokes, [name for name, one in surfaces.items() if isinstance(one, Plane)], lengths),
        f"The {words} from the side: {enumeration(sizes)}.",
        f"The {words} from the side, cut through its middle, as it stands before it acts; dimensions in mm, to scale.",
    )


def _turned(surface: Surface, points: Array) -> Array:
    """Points (n, 3) in a surface's own frame, transformed to world coordinates."""
    w, *vector = surface.pose.quaternion
    v = np.array(vector)
    across = np.cross(v, points)
    turned: Array = points + 2.0 * (w * across + np.cross(v, across)) + np.array(surface.pose.origin)
    return turned


def _cut(surface: Surface) -> Iterator[Array]:
    """Lines (n, 2) in which a surface meets the plane y = 0; for a plane, a line across the whole drawing."""
    if isinstance(surface, Plane):
        origin, tip = _turned(surface, np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
        across, up = tip[0] - origin[0], tip[2] - origin[2]
        if math.hypot(across, up) > 0.5:  # a plane that faces along y is parallel to the drawing
            yield np.array([[origin[0] - up, origin[2] + across], [origin[0] + up, origin[2] - across]])
    elif isinstance(surface, Revolved):
        yield from _cut_revolved(surface)
    else:
        corners = np.array(surface.vertices)
        world = _turned(surface, corners)
        for face in surface.faces:
            line = _cut_triangle(world[list(face)])
            if line is not None:
                yield line


def _cut_revolved(one: Revolved) -> Iterator[Array]:
    axis = _turned(one, np.array([[0.0, 0.0, 1.0]]))[0] - np.array(one.pose.origin)
    if abs(axis[1]) > 0.7:
        # Its axis lies along y: a circle with its radius.
        angle = np.linspace(0.0, 2.0 * math.pi, MOST_CORNERS)
        for r, z in dict.fromkeys([(one.r0, one.z0), (one.r1, one.z1)]):
            ring = np.stack([r * np.cos(angle), r * np.sin(angle), np.full_like(angle, z)], axis=1)
            yield _turned(one, ring)[:, [0, 2]]
            if math.isclose(one.r0, one.r1):
                return
    else:
        for side in (-1.0, 1.0):
            profile = np.array([[side * one.r0, 0.0, one.z0], [side * one.r1, 0.0, one.z1]])
            yield _turned(one, profile)[:, [0, 2]]


def _cut_triangle(corners: Array) -> Array | None:
    """Where a triangle meets y = 0."""
    found = []
    for a, b in ((0, 1), (1, 2), (2, 0)):
        start, end = corners[a], corners[b]
        if (start[1] < 0.0) != (end[1] < 0.0):
            found.append(start + (end - start) * start[1] / (start[1] - end[1]))
    return np.array(found)[:, [0, 2]] if len(found) == 2 else None


def _svg(strokes: Sequence[Stroke], planes: Sequence[str], lengths: dict[str, float]) -> str:
    """The lines with dimensions: heights between levels on the right, widths at their own levels."""
    walls = [line for line, name in strokes if name not in planes]
    corners = np.concatenate(walls or [line for line, _ in strokes])
    grounds = [line for line, name in strokes if name in planes]
    level = [float(line[0, 1]) for line in grounds if abs(line[0, 1] - line[1, 1]) < SAME]
    low, high = min([float(corners[:, 1].min()), *level]), max([float(corners[:, 1].max()), *level])
    half = max(float(np.abs(corners[:, 0]).max()), 1e-6)
    scale = min((WIDTH - 2.0 * MARGIN) / (2.0 * half), 420.0 / max(high - low, 1e-6))
    height = (high - low) * scale + 70.0

    def at(point: Sequence[float] | Array) -> str:
        return f"{WIDTH / 2 + scale * point[0]:.1f},{height - 40.0 - scale * (point[1] - low):.1f}"

    parts = [f'<polyline points="{" ".join(map(at, line))}" stroke-width="2"/>' for line in walls]
    edge = (WIDTH / 2 - 10.0) / scale
    for line in grounds:
        (x, z), (a, b) = line[0], line[1] - line[0]
        middle = np.array([x, z]) + 0.5 * np.array([a, b])
        along = np.array([a, b]) / math.hypot(a, b)
        ends = [middle - edge * along, middle + edge * along]
        parts.append(f'<line {_ends(at(ends[0]), at(ends[1]))} stroke-width="3"/>')
    top = float(corners[:, 1].max())
    marks = [*_heights(corners, level, lengths, half, scale), *_widths(corners, lengths)]
    for (start, end), (x, z), words in marks:
        upright = abs(start[0] - end[0]) < SAME
        tick = (TICK / scale, 0.0) if upright else (0.0, TICK / scale)
        for a, b in ((start, end), *((_moved(one, tick, -1.0), _moved(one, tick, 1.0)) for one in (start, end))):
            parts.append(f'<line {_ends(at(a), at(b))} stroke-width="1" opacity="0.75"/>')
        place = at((x, z)).split(",")
        anchor, shift = ("start", 6) if upright else ("middle", 0)
        lift = 4 if upright else -5 if top - z < SAME else 15
        parts.append(
            f'<text x="{float(place[0]) + shift:.1f}" y="{float(place[1]) + lift:.1f}" text-anchor="{anchor}" '
            f'stroke="none" fill="currentColor" font-size="11">{escape(words)}</text>'
        )
    return (
        f'<svg viewBox="0 0 {WIDTH:.0f} {height:.0f}" width="{WIDTH:.0f}" height="{height:.0f}" fill="none" '
        f'stroke="currentColor" font-family="sans-serif">{"".join(parts)}</svg>'
    )


Mark = tuple[tuple[tuple[float, float], tuple[float, float]], tuple[float, float], str]
"""A dimension: its two ends, the position of its text, and the text."""


def _heights(
    corners: Array, grounds: Sequence[float], lengths: dict[str, float], half: float, scale: float
) -> list[Mark]:
    levels = sorted({round(float(z), 9) for z in [*corners[:, 1], *grounds]})
    levels = [z for k, z in enumerate(levels) if k == 0 or (z - levels[k - 1]) * scale > LEAST_GAP]
    x = half + 26.0 / scale
    return [
        (((x, low), (x, high)), (x, 0.5 * (low + high)), _dimension(high - low, lengths, "height"))
        for low, high in pairwise(levels)
        if len(levels) <= 6
    ]


def _widths(corners: Array, lengths: dict[str, float]) -> list[Mark]:
    found: dict[float, float] = {}
    for x, z in corners:
        found[round(float(z), 9)] = max(found.get(round(float(z), 9), 0.0), abs(float(x)))
    by_width = {round(r, 9): z for z, r in sorted(found.items()) if r > SAME}
    if len(by_width) > MOST_WIDTHS:
        by_width = dict([max(by_width.items())])  # for a circle, its diameter
    return [(((-r, z), (r, z)), (0.0, z), _dimension(2.0 * r, lengths, "diameter")) for r, z in by_width.items()]


def _dimension(length: float, lengths: dict[str, float], kind: str) -> str:
    """ "outlet diameter 30", by the parameter of this length, one of this kind first; else the number alone."""
    fits = [name for name, one in lengths.items() if math.isclose(one, length, rel_tol=1e-6)]
    fits.sort(key=lambda name: kind not in name)
    words = f"{fits[0].replace('_', ' ')} " if fits else ""
    return f"{words}{number(1e3 * length)}"


def _moved(place: tuple[float, float], by: tuple[float, float], times: float) -> tuple[float, float]:
    return place[0] + times * by[0], place[1] + times * by[1]


def _ends(start: str, end: str) -> str:
    (x1, y1), (x2, y2) = start.split(","), end.split(",")
    return f'x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}"'
