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

UNKNOWN = ast.Name("a value that only a run gives")


def read_yade(file: Path) -> Found:
    """What the calls in a YADE script say: FrictMat, sphere, the Ip2 functor. Of an exported deck: its tables."""
    text = text_of(file)
    if DECK in text and (file.parent / DECK).is_file() and (file.parent / LAW).is_file():
        return _deck(file.parent)
    try:
        return _read(file, ast.parse(text))
    except SyntaxError as error:
        raise CommandError(f"{file}: line {error.lineno}: is not Python: {error.msg}") from None
    except RecursionError:
        raise CommandError(f"{file}: an expression is nested too deeply; allowed: up to some hundred terms") from None


def _read(file: Path, tree: ast.Module) -> Found:
    found, constants = Found(), _constants(tree)
    angles: Numbers = {}
    spoken: dict[str | int, str] = {}
    calls = [node for node in ast.walk(tree) if isinstance(node, ast.Call)]
    labels = _labels(tree)
    for call in sorted(calls, key=lambda node: (node.lineno, node.col_offset)):
        kind, words = called(call.func), _words(call)
        if kind == "FrictMat":
            name = _frict_mat(file, found, angles, call, words, constants(call), labels)
            label = words.get("label")
            said = str(label.value) if isinstance(label, ast.Constant) else name
            spoken |= dict.fromkeys((said, labels.get(id(call), name), name, len(found.materials) - 1), name)
        elif kind.endswith("Mat") and kind[:1].isupper():
            found.notes.append(f"{kind} (line {call.lineno}): only FrictMat is taken")
    if not found.materials:
        return found
    for call in calls:
        kind, words, names = called(call.func), _words(call), constants(call)
        if kind == "sphere" or kind in ("wall", "facet", "box"):
            _placed(found, kind, call, words, names, spoken)
        elif kind == "NewtonIntegrator" and "gravity" in words:
            _gravity(found, words["gravity"], names)
        elif kind.startswith("Law2_") and "Mindlin" not in kind:
            found.notes.append(f"{kind}: another contact law; here Hertz's is taken with the same E, ν and friction")
    _frictions(found, angles)
    for call in calls:
        if called(call.func).startswith("Ip2_"):
            _functor(found, call, constants(call))
    found.notes.append("not taken: bodies' places, geometry, engines and time step of the script")
    return found


def _gravity(found: Found, given: ast.expr, names: Mapping[str, float]) -> None:
    """Three numbers in a tuple, a list or a ``Vector3``."""
    parts = given.elts if isinstance(given, ast.Tuple | ast.List) else []
    if isinstance(given, ast.Call) and called(given.func) == "Vector3":
        parts = given.args
    try:
        if len(parts) != 3:
            raise ValueError(ast.unparse(given))
        found.settings["gravity"] = [number(one, names) for one in parts]
    except ValueError as error:
        found.notes.append(f"gravity: {error} is not known without running the script, not taken")


def _words(call: ast.Call) -> dict[str, ast.expr]:
    """Keyword arguments of a call, by name."""
    return {word.arg: word.value for word in call.keywords if word.arg}


def _constants(tree: ast.Module) -> Callable[[ast.Call], dict[str, float]]:
    """Names that stand for a number where a call is made: the script's assignments above it, or for a call within a
    function, which may run later, all of them.
    """
    parts = [node for node in tree.body if isinstance(node, ast.FunctionDef | ast.ClassDef)]
    later = {id(inner) for part in parts for inner in ast.walk(part)}

    def known(call: ast.Call) -> dict[str, float]:
        names: dict[str, float] = {}
        for node in tree.body:
            if id(call) not in later and (node.lineno, node.col_offset) >= (call.lineno, call.col_offset):
                break
            for name, expression in _bound(node):
                try:
                    names[name] = number(expression or UNKNOWN, names)
                except ValueError:
                    names.pop(name, None)
        return names

    return known


def _bound(node: ast.stmt) -> list[tuple[str, ast.expr | None]]:
    """Names that a statement of the script gives a value, with the expression; None where that has to be run."""
    match node:
        case ast.Assign(targets=[ast.Tuple(elts=targets)], value=ast.Tuple(elts=values)) if len(targets) == len(values):
            pairs = list(zip(targets, values, strict=True))
        case ast.Assign(targets=targets, value=value):
            pairs = [(target, value) for target in targets]
        case ast.AnnAssign(target=target, value=value) if value is not None:
            pairs = [(target, value)]
        case ast.AugAssign(target=ast.Name(id=name) as target, op=op, value=value):
            pairs = [(target, ast.BinOp(ast.Name(name), op, value))]
        case ast.FunctionDef() | ast.ClassDef():
            return []
        case _:  # in a loop or a condition: known only where it is run
            stored = [one for one in ast.walk(node) if isinstance(one, ast.Name) and isinstance(one.ctx, ast.Store)]
            return [(one.id, None) for one in stored]
    return [(target.id, value) for target, value in pairs if isinstance(target, ast.Name)]


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
) -> str:
    """Take a material; returns its name."""
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
    return name


def _placed(
    found: Found,
    kind: str,
    call: ast.Call,
    words: Mapping[str, ast.expr],
    names: Mapping[str, float],
    spoken: Mapping[str | int, str],
) -> None:
    """A call that makes a sphere or a wall: what it is made of, and the sphere's radius.

    ``spoken``: label, variable or number → material; without ``material`` YADE takes the last one.
    """
    given = words.get("material")
    if isinstance(given, ast.Subscript):  # O.materials["sand"]
        given = given.slice
    said = given.value if isinstance(given, ast.Constant) else given.id if isinstance(given, ast.Name) else None
    name = list(found.materials)[-1] if given is None else spoken.get(said) if isinstance(said, str | int) else None
    if name is None:
        note = f"{kind}: its material {ast.unparse(words['material'])} is not known without running the script"
        if note not in found.notes:
            found.notes.append(note)
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
