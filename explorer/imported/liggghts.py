"""LIGGGHTS's input script: materials by atom type, particle templates, contact model.

Friction, E and ν are as here. With ``limitForce on`` a restitution e' stands for the damping ratio
ζ = |ln e'| / √(ln² e' + π²), which gives back the e of `solver/laws/restitution.py`. The rolling friction epsd2 is the
law here; cdt has its torque μ_r F_n R* without the spring.
Sources: LIGGGHTS-PUBLIC, ``doc/fix_particletemplate_sphere``, ``…_multisphere``, ``doc/gran_rolling_friction_cdt``,
``…_epsd2``.
"""

from __future__ import annotations

import ast
import math
import re
import shlex
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from explorer.errors import CommandError
from explorer.imported.found import Found, number, one_rolling, restitution_of, text_of
from solver.laws import HertzMindlin, LinearSpringDashpot

LAWS = {"hertz": HertzMindlin.name, "hooke": LinearSpringDashpot.name}
"""LIGGGHTS's models that have an equal here."""


MATERIAL_OF = {"youngsModulus": "youngs_modulus", "poissonsRatio": "poisson_ratio"}
PAIR_OF = {"coefficientFriction": "static_friction", "coefficientRestitution": "restitution"}
ROLLING, SPEED = "coefficientRollingFriction", "characteristicVelocity"


def read_liggghts(file: Path) -> Found:
    """What a LIGGGHTS input script says of materials, particle templates and contact models."""
    found, names = Found(), dict[str, str]()
    rolling: dict[frozenset[str], float] = {}
    shares: list[tuple[str, list[str]]] = []
    model: list[str] = []
    walls: list[str] = []
    for line in _commands(text_of(file), names):
        match line:
            case ["units", unit, *_] if unit != "si":
                raise CommandError(f"{file}: units {unit}; allowed: si")
            case ["fix", _, _, "property/global", key, kind, *rest]:
                _property(file, found, rolling, key, kind, rest)
            case ["fix", name, _, "particletemplate/sphere" | "particletemplate/multisphere" as style, *rest]:
                _template(file, found, name, style, rest)
            case ["fix", _, _, "particletemplate/superquadric" | "particletemplate/multiplespheres" as style, *_]:
                found.notes.append(f"{style}: no counterpart, its shape is not taken")
            case ["fix", _, _, style, _, _, *weights] if style.startswith("particledistribution/discrete"):
                shares.append((style, weights))
            case ["fix", _, _, "gravity", _, way, *_] if way != "vector":
                found.notes.append(f"fix gravity {way}: only a vector is taken")
            case ["fix", _, _, "gravity", size, "vector", x, y, z, *_]:
                values = [_float(file, "fix gravity", text) for text in (size, x, y, z)]
                length = math.hypot(*values[1:]) or 1.0
                found.settings["gravity"] = [values[0] * one / length for one in values[1:]]
            case ["pair_style", "gran", *words]:
                model = words
            case ["pair_style", style, *_]:
                found.notes.append(f"pair_style {style}: no counterpart, {HertzMindlin.name} is taken")
            case ["fix", _, _, "wall/gran", *words] if "type" in words[:-1]:
                walls.append(_type(file, "wall/gran: type", words[words.index("type") + 1]))
            case ["fix", _, _, style, *words] if style.startswith("mesh/surface") and "type" in words[:-1]:
                walls.append(_type(file, f"{style}: type", words[words.index("type") + 1]))
    _shares(file, found, shares)
    poured = {body["material"] for body in found.bodies.values()}
    declared = [name for name in walls if name in found.materials]
    unpoured = [name for name in found.materials if name not in poured] if poured else []
    found.wall = next(iter([*(name for name in declared if name not in poured), *declared, *unpoured]), "")
    if found.wall and len(set(walls)) > 1:
        found.notes.append(f"walls of {', '.join(dict.fromkeys(walls))}: all are taken as {found.wall}")
    _model(found, model, rolling)
    found.notes.append("not taken: geometry, insertion, time step and output of the script")
    return found


def _commands(text: str, names: dict[str, str]) -> Iterator[list[str]]:
    """Commands as words: comments and continued lines undone, variables that are numbers put in."""
    for line in re.sub(r"&[ \t]*\n", " ", text).splitlines():
        line = re.sub(r"\$\{(\w+)\}|\$([A-Za-z])", lambda m: names.get(m[1] or m[2], m[0]), line)
        try:
            words = shlex.split(line, comments=True)
        except ValueError:
            continue
        words = [re.sub(r"\bv_(\w+)", lambda m: names.get(m[1], m[0]), word) for word in words]
        match words:
            case ["variable", name, "equal", *parts] if parts:
                try:  # fifteen digits, as LAMMPS writes them: a whole number stays one
                    names[name] = f"{_value(''.join(parts)):.15g}"
                except (ValueError, SyntaxError):
                    names[name] = "".join(parts)
            case ["variable", name, "index", value, *_]:
                names.setdefault(name, value)  # a later list does not replace an earlier one
            case ["variable", name, "string", value, *_]:
                names[name] = value
            case [_, *_]:
                yield words


def _value(text: str) -> float:
    return number(ast.parse(text.replace("^", "**"), mode="eval").body, {"PI": math.pi})


def _float(file: Path, where: str, text: str) -> float:
    try:
        value = _value(text)
    except (ValueError, SyntaxError):
        value = math.nan
    if not math.isfinite(value):
        raise CommandError(f"{file}: {where}: {text!r} is not a number; allowed: numbers, variables of numbers")
    return value


def _type(file: Path, where: str, text: str) -> str:
    """The material of an atom type."""
    value = _float(file, where, text)
    if value != int(value) or value < 1.0:
        raise CommandError(f"{file}: {where} {text}; allowed: a whole number from 1 on")
    return f"type{int(value)}"


def _property(
    file: Path, found: Found, rolling: dict[frozenset[str], float], key: str, kind: str, rest: list[str]
) -> None:
    where = f"property/global {key}"
    if key in MATERIAL_OF and kind in ("peratomtype", "atomtype"):
        for k, text in enumerate(rest, start=1):
            found.materials.setdefault(f"type{k}", {})[MATERIAL_OF[key]] = _float(file, where, text)
    elif (key in PAIR_OF or key == ROLLING) and kind in ("peratomtypepair", "atomtypepair"):
        n, values = int(_float(file, where, (rest or ["0"])[0])), [_float(file, where, text) for text in rest[1:]]
        if n < 1 or len(values) != n * n:
            raise CommandError(f"{file}: {where} {kind} {n}: {len(values)} values; allowed: {n * n}")
        for a in range(n):
            for b in range(a, n):
                pair = frozenset((f"type{a + 1}", f"type{b + 1}"))
                if key == ROLLING:
                    rolling[pair] = values[a * n + b]
                else:
                    found.pairs.setdefault(pair, {})[PAIR_OF[key]] = values[a * n + b]
    elif key == SPEED and kind == "scalar":
        found.settings.setdefault("contact", {})["characteristic_velocity"] = _float(file, where, (rest or [""])[0])
    else:
        found.notes.append(f"{key}: no counterpart, not taken")


def _template(file: Path, found: Found, name: str, style: str, rest: list[str]) -> None:
    """A particle template as a body: one sphere, or member spheres with mass and inertia."""
    where = f"{style} {name}"

    def after(key: str, count: int = 1) -> list[str]:
        return rest[rest.index(key) + 1 :][:count] if key in rest else []

    def constant(key: str) -> float | None:
        match after(key, 2):
            case ["constant", value]:
                return _float(file, f"{where}: {key}", value)
            case [random, *_]:
                found.notes.append(f"{name}: {key} {random}: only a constant is taken")
        return None

    material = _type(file, f"{where}: atom_type", (after("atom_type") or ["1"])[0])
    body: dict[str, Any] = {"material": material}
    density, radius = constant("density"), constant("radius")
    if density is not None:
        entry = found.materials.setdefault(material, {})
        if entry.setdefault("density", density) != density:
            raise CommandError(
                f"{file}: {where}: density {density:g}, but that of another template of atom {material} is "
                f"{entry['density']:g}; allowed: templates of one density, or atom types of their own"
            )
    if style.endswith("/sphere") and radius is not None:
        body["shape"] = {"sphere": 2.0 * radius}
    tensor = [_float(file, f"{where}: inertia_tensor", text) for text in after("inertia_tensor", 6)]
    if style.endswith("/multisphere"):
        if "use_volume" in rest:
            found.notes.append(
                f"{name}: a clump whose centre of mass follows from its volume (use_volume) is not taken"
            )
        elif not (after("mass") and len(tensor) == 6 and tensor[1] == tensor[2] == tensor[4] == 0.0):
            found.notes.append(f"{name}: a clump without mass and principal inertia_tensor is not taken")
        else:
            rows = _spheres(file, where, after)
            body |= {"sphere_centres": [row[:3] for row in rows], "sphere_radii": [row[3] for row in rows]}
            body |= {"mass": _float(file, where, after("mass")[0]), "inertia": [tensor[0], tensor[3], tensor[5]]}
            body |= {} if density is None else {"density": density}
    found.bodies[name] = body


def _spheres(file: Path, where: str, after: Callable[[str, int], list[str]]) -> list[list[float]]:
    """Rows x, y, z, r of a clump, in the script or in a file beside it."""
    texts, scale = after("spheres", 2), 1.0
    if texts[:1] == ["file"]:
        beside = (file.parent / texts[1]).resolve()
        # A script that somebody sent must not have the page read any other file.
        if not beside.is_relative_to(file.parent.resolve()):
            raise CommandError(f"{file}: {where}: spheres file {texts[1]}; allowed: a file beside the script")
        try:
            # As LIGGGHTS reads it: after # a comment, after four columns nothing.
            lines = [line.partition("#")[0].split() for line in text_of(beside).splitlines()]
            texts = [text for line in lines for text in line[:4]]
        except OSError as error:
            raise CommandError(f"{file}: {where}: spheres file {texts[1]}: {error.strerror}") from None
        scale = _float(file, where, (after("scale", 1) or ["1"])[0])
    else:
        texts = after("spheres", 4 * int(_float(file, where, (after("nspheres", 1) or ["0"])[0])))
    values = [scale * _float(file, f"{where}: spheres", text) for text in texts]
    if not values or len(values) % 4:
        raise CommandError(f"{file}: {where}: spheres: {len(values)} numbers; allowed: four for each sphere")
    return [values[k : k + 4] for k in range(0, len(values), 4)]


def _shares(file: Path, found: Found, shares: list[tuple[str, list[str]]]) -> None:
    """Keep the templates that are poured; their mass fractions, where there is one distribution, by mass."""
    every = [(style, dict(zip(weights[::2], weights[1::2], strict=False))) for style, weights in shares]
    named = {name for _, parts in every for name in parts} & set(found.bodies)
    for name in [name for name in found.bodies if named and name not in named]:
        del found.bodies[name]
        found.notes.append(f"{name}: in no particledistribution, so not poured")
    if len(every) > 1:
        found.notes.append(f"{len(every)} particledistributions: shares of the mass are not taken")
        return
    for style, parts in every:
        if style.endswith("numberbased") and len(parts) > 1:
            found.notes.append("particledistribution by number: shares of the mass are not taken")
        elif set(parts) == named and len(parts) > 1:
            values = {name: _float(file, style, text) for name, text in parts.items()}
            for name, value in values.items():
                found.bodies[name]["mass_fraction"] = value / sum(values.values())


def _model(found: Found, words: list[str], rolling: Mapping[frozenset[str], float]) -> None:
    """The contact model, and what restitution and rolling friction mean under it."""
    chosen = dict(zip(words[::2], words[1::2], strict=False))
    model = chosen.get("model", "hertz")
    if model in LAWS:
        found.settings.setdefault("contact", {})["law"] = LAWS[model]
    else:
        found.notes.append(f"model {model}: no counterpart, {HertzMindlin.name} is taken")
    tangential = chosen.get("tangential", "off")
    if tangential == "history":
        found.notes.append(
            "tangential history keeps the spring as a displacement and leaves the dashpot without a cap; here "
            'contact.tangential_law = "mindlin" and contact.tangential_dashpot = "uncapped" do so'
        )
    elif words:
        found.notes.append(f"tangential {tangential}: no counterpart; here friction acts with a spring")
    for key in ("cohesion", "surface"):
        if chosen.get(key, "off") not in ("off", "default", "sphere"):
            found.notes.append(f"{key} {chosen[key]}: no counterpart, not taken")
    if chosen.get("limitForce") == "on":
        for pair in found.pairs.values():
            if 0.0 < pair.get("restitution", 0.0) < 1.0:
                log = math.log(pair["restitution"])
                pair["restitution"] = restitution_of(-log / math.hypot(log, math.pi))
        found.notes.append("restitution: with limitForce on, that which the contact gives back, not the one typed in")
    of = chosen.get("rolling_friction", "off")
    if not rolling or of == "off":
        found.notes += (
            ["coefficientRollingFriction: no rolling_friction in pair_style, so not taken"] if rolling else []
        )
        return
    poured = [body["material"] for body in found.bodies.values()] or ["type1"]
    one_rolling(found, rolling, poured)
    if of != "epsd2":
        found.notes.append(
            f"rolling friction: {of} there, here a spring with the same cap mu_r R* F_n (epsd2): a start, no equal"
        )
