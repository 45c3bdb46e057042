"""YADE's Python script, parsed and never run: FrictMat, sphere, the Ip2 functor; and decks that are exported for it.

Friction is an angle [rad]: μ = tan φ, of two materials the smaller angle unless a MatchMaker says else (YADE,
``Ip2_FrictMat_FrictMat_FrictPhys.cpp``). A damping ratio betan = c_n / 2 gives the restitution with ζ = √0.3 c_n.
"""

from __future__ import annotations

import ast
import json
import math
import re
from collections.abc import Callable, Mapping
from pathlib import Path

from explorer.errors import CommandError
from explorer.export.deck import FILE as DECK
from explorer.export.deck import read_deck
from explorer.export.yade import LAW
from explorer.imported.found import Found, Numbers, called, number, restitution_of, text_of


def read_yade(file: Path) -> Found:
    """What the calls in a YADE script say: FrictMat, sphere, the Ip2 functor. Of an exported deck: its tables."""
    text = text_of(file)
    if DECK in text and (file.parent / DECK).is_file() and (file.parent / LAW).is_file():
        return _deck(file.parent)
    try:
        tree = ast.parse(text)
    except SyntaxError as error:
        raise CommandError(f"{file}: line {error.lineno}: is not Python: {error.msg}") from None
    found, constants = Found(), _constants(tree)
    angles: Numbers = {}
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call)]
    labels = _labels(tree)
    for call in sorted(calls, key=lambda node: (node.lineno, node.col_offset)):
        kind, words = called(call.func), _words(call)
        if kind == "FrictMat":
            _frict_mat(file, found, angles, call, words, constants(call), labels)
        elif kind.endswith("Mat") and kind[:1].isupper():
            found.notes.append(f"{kind} (line {call.lineno}): only FrictMat is taken")
    if not found.materials:
        return found
    for call in calls:
        kind, words, names = called(call.func), _words(call), constants(call)
        if kind == "sphere" or kind in ("wall", "facet", "box"):
            _placed(found, kind, call, words, names)
        elif kind == "NewtonIntegrator" and isinstance(words.get("gravity"), ast.Tuple | ast.List):
            try:
                found.settings["gravity"] = [number(one, names) for one in words["gravity"].elts]  # type: ignore[attr-defined]
            except ValueError as error:
                found.notes.append(f"gravity: {error} is not known without running the script, not taken")
    _frictions(found, angles)
    for call in calls:
        if called(call.func).startswith("Ip2_"):
            _functor(found, call, constants(call))
    found.notes.append("not taken: bodies' places, geometry, engines and time step of the script")
    return found


def _words(call: ast.Call) -> dict[str, ast.expr]:
    """Keyword arguments of a call, by name."""
    return {word.arg: word.value for word in call.keywords if word.arg}


def _constants(tree: ast.Module) -> Callable[[ast.Call], dict[str, float]]:
    """Names that stand for a number where a call is made: the script's assignments above it, or for a call within a
    function, which may run later, all of them.
    """
    assigned = [node for node in tree.body if isinstance(node, ast.Assign) and len(node.targets) == 1]
    parts = [node for node in tree.body if isinstance(node, ast.FunctionDef | ast.ClassDef)]
    later = {id(inner) for part in parts for inner in ast.walk(part)}

    def known(call: ast.Call) -> dict[str, float]:
        names: dict[str, float] = {}
        for node in assigned:
            if id(call) not in later and (node.lineno, node.col_offset) >= (call.lineno, call.col_offset):
                break
            target, value = node.targets[0], node.value
            pairs = [(target, value)]
            if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple) and len(target.elts) == len(value.elts):
                pairs = list(zip(target.elts, value.elts, strict=True))
            for one, expression in pairs:
                if isinstance(one, ast.Name):
                    try:
                        names[one.id] = number(expression, names)
                    except ValueError:
                        names.pop(one.id, None)
        return names

    return known


def _labels(tree: ast.Module) -> dict[int, str]:
    """Of calls that are given a name, alone or by ``O.materials.append(…)``: that name, by the call."""
    found: dict[int, str] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.Assign) and len(node.targets) == 1 and isinstance(node.targets[0], ast.Name):
            for inner in ast.walk(node.value):
                if isinstance(inner, ast.Call):
                    found.setdefault(id(inner), node.targets[0].id)
    return found


def _frict_mat(
    file: Path,
    found: Found,
    angles: Numbers,
    call: ast.Call,
    words: Mapping[str, ast.expr],
    names: Mapping[str, float],
    labels: Mapping[int, str],
) -> None:
    label = words.get("label")
    said = label.value if isinstance(label, ast.Constant) else labels.get(id(call), "")
    name = re.sub(r"\W", "_", str(said)) or f"material{len(found.materials)}"
    while name in found.materials:
        name += "_"
    entry = found.materials.setdefault(name, {})
    keys = {"young": "youngs_modulus", "poisson": "poisson_ratio", "density": "density", "frictionAngle": ""}
    for key, ours in keys.items():
        if key not in words:
            continue
        try:
            value = number(words[key], names)
        except ValueError as error:
            raise CommandError(
                f"{file}: line {call.lineno}: FrictMat({key}={error}): cannot be evaluated without running the "
                "script; allowed: "
                "numbers, variables that hold numbers, arithmetic"
            ) from None
        if ours:
            entry[ours] = value
        else:
            angles[name] = value


def _placed(found: Found, kind: str, call: ast.Call, words: Mapping[str, ast.expr], names: Mapping[str, float]) -> None:
    """A call that makes a sphere or a wall: what it is made of, and the sphere's radius."""
    given = words.get("material")
    said = given.value if isinstance(given, ast.Constant) else given.id if isinstance(given, ast.Name) else None
    index = said if isinstance(said, int) else None
    name = list(found.materials)[index] if index is not None and 0 <= index < len(found.materials) else str(said)
    if name not in found.materials:
        return
    if kind != "sphere":
        found.wall = found.wall or name
        return
    body = found.bodies.setdefault(name, {"material": name})
    radius = words.get("radius", call.args[1] if len(call.args) > 1 else None)
    try:
        diameter = 2.0 * number(radius, names) if radius is not None else 0.0
    except ValueError:
        return
    if diameter > 0.0 and body.setdefault("shape", {"sphere": diameter}) != {"sphere": diameter}:
        found.notes.append(f"{name}: spheres of more than one radius; the first is taken")


def _frictions(found: Found, angles: Numbers) -> None:
    """μ of every pair: the tangent of the smaller angle."""
    for a, one in angles.items():
        for b, other in angles.items():
            found.pairs.setdefault(frozenset((a, b)), {})["static_friction"] = math.tan(min(one, other))
    if angles:
        found.notes.append("friction: tan(frictionAngle), of two materials the smaller angle")


def _functor(found: Found, call: ast.Call, names: Mapping[str, float]) -> None:
    """Numbers of the Ip2 functor that hold for pairs: restitution, damping ratio, angle of friction."""
    order = list(found.materials)
    ways: dict[str, tuple[str, Callable[[float], float]]] = {
        "en": ("restitution", float),
        "betan": ("restitution", lambda ratio: restitution_of(2.0 * math.sqrt(0.3) * ratio)),
        "frictAngle": ("static_friction", math.tan),
    }
    for word in call.keywords:
        key, convert = ways.get(word.arg or "", ("", float))
        values = _matched(word.value, order, names) if key else None
        if values is None:
            found.notes.append(f"{called(call.func)}: {word.arg}: not taken")
            continue
        for pair, value in values.items():
            found.pairs.setdefault(pair, {})[key] = convert(value)
        found.notes.append(f"{key.replace('_', ' ')}: from {word.arg} of {called(call.func)}")


def _matched(node: ast.expr, order: list[str], names: Mapping[str, float]) -> dict[frozenset[str], float] | None:
    """A number for pairs of materials: one for all, or ``MatchMaker(matches=((a, b, value), …))``; None if neither."""
    every = {frozenset((a, b)) for a in order for b in order}
    try:
        if not isinstance(node, ast.Call) or called(node.func) != "MatchMaker":
            return dict.fromkeys(every, number(node, names))
        words = {word.arg: word.value for word in node.keywords}
        found = dict.fromkeys(every, number(words["val"], names)) if "val" in words else {}
        matches = words.get("matches", node.args[0] if node.args else ast.Tuple(elts=[], ctx=ast.Load()))
        for match in matches.elts if isinstance(matches, ast.Tuple | ast.List) else ():
            a, b, value = match.elts  # type: ignore[attr-defined]
            ends = [order[int(number(end, names))] for end in (a, b)]
            found[frozenset(ends)] = number(value, names)
        return found
    except (ValueError, IndexError, AttributeError):
        return None


def _deck(folder: Path) -> Found:
    """What an exported folder says in ``deck.json`` and ``law.json``: classes are components and the wall."""
    found = Found()
    try:
        deck, law = read_deck(folder), json.loads((folder / LAW).read_text(encoding="utf-8"))
    except (ValueError, KeyError, TypeError):
        raise CommandError(f"{folder}: {DECK} and {LAW} are not from an export of this program") from None
    names = [clump.name for clump in deck.clumps]
    found.wall = "wall" if "wall" not in names else "wall_"
    found.materials[found.wall] = {
        "youngs_modulus": deck.wall_youngs_modulus, "poisson_ratio": deck.wall_poisson_ratio
    }  # fmt: skip
    for clump in deck.clumps:
        own = {"youngs_modulus": clump.youngs_modulus, "poisson_ratio": clump.poisson_ratio, "density": clump.density}
        found.materials[clump.name] = own
        found.bodies[clump.name] = {
            "material": clump.name,
            "mass": clump.mass,
            "inertia": clump.inertia.tolist(),
            "density": clump.density,
            "sphere_centres": clump.centres.tolist(),
            "sphere_radii": clump.radii.tolist(),
        }
    classes = [*names, found.wall]
    for a, one in enumerate(classes[:-1]):
        for b, other in enumerate(classes):
            ratio = 2.0 * math.sqrt(0.3) * law["normal_damping"][a][b]
            numbers = {"static_friction": math.tan(law["friction_angle"][a][b]), "restitution": restitution_of(ratio)}
            found.pairs[frozenset((one, other))] = numbers
    found.settings["gravity"] = list(deck.gravity)
    found.settings["contact"] = {
        "law": deck.law,
        "characteristic_velocity": deck.characteristic_velocity,
        "tangential_law": deck.tangential_law,
        "tangential_dashpot": deck.tangential_dashpot,
    }
    found.notes += [
        "friction: tan(friction_angle); restitution: of the damping ratio",
        "not taken: the pour of the deck",
    ]
    return found
