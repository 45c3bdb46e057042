"""A scene: everything needed to repeat a run, except the seed. Frozen, hashable, NumPy only.

Parameter paths (the same grammar in ``--set``, study files, sliders and the store):

    material.<material>.density | shear_modulus | poisson_ratio
    pair.<a>.<b>.static_friction | restitution          (order of a and b is free)
    body.<body>.mass_fraction | thickness | …           (dimensions of the solid)
    body.<body>.size_distribution | size_spread          (of the linear size about the declared one)
    body.spheres                                         (coarse, standard, fine or a number: for all bodies)
    rig.<name>   insertion.<name>   numerics.<name>   contact.<name>
    effect.<effect>.<name>                               (of ``solver/effects/``; all off at first)

The choice of the rig (``rig.name`` in files and ``--set``) is not a parameter, because each rig has its own parameters
(:func:`with_rig`).

A scene is as declared; :func:`actual` applies its effects on material and set-up.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any, cast

from solver.effects import EFFECTS, Effect, SetUpEffect, set_up_effects
from solver.params import Parameter, ParameterError, declared
from solver.rigs import BENCH_RIGS, RIGS, Funnel, PourRig, Rig
from solver.scenes.body import SPHERES, Body, body_parameters, counts, with_body_value, with_densities, with_fractions
from solver.scenes.contact_model import ContactModel
from solver.scenes.insertion import Insertion
from solver.scenes.material import Material, Pair
from solver.scenes.numerics import Numerics

MOST_GRAVITY = 1e4
"""[m/s²], a thousand times that of the earth, as in a centrifuge."""


@dataclass(frozen=True)
class Scene:
    """Materials, pairs, bodies, rig, insertion and numerics of one pour."""

    title: str
    materials: tuple[Material, ...]
    bodies: tuple[Body, ...]
    pairs: tuple[Pair, ...]
    rig: Rig = Funnel()
    insertion: Insertion = Insertion()
    numerics: Numerics = Numerics()
    contact: ContactModel = ContactModel()
    gravity: tuple[float, float, float] = (0.0, 0.0, -9.81)
    assumed: tuple[str, ...] = ()
    effects: tuple[Effect, ...] = ()
    """Effects whose parameters differ from their defaults, in the order of ``EFFECTS``."""
    axis: tuple[float, float] = (0.0, 0.0)
    """Position of the rig's axis on the plate, as measured there [m]."""

    def effect(self, name: str) -> Effect:
        """The effect of that name; with its default parameters it is off."""
        for effect in self.effects:
            if effect.name == name:
                return effect
        return EFFECTS[name]()

    def with_effect(self, effect: Effect) -> Scene:
        """The scene with ``effect`` in place of the one of its name."""
        others = {other.name: other for other in self.effects} | {effect.name: effect}
        kept = tuple(others[name] for name in EFFECTS if name in others and others[name] != EFFECTS[name]())
        return dataclasses.replace(self, effects=kept)

    def without_effect(self, name: str) -> Scene:
        """The scene with the effect ``name`` at its defaults, off."""
        return self.with_effect(EFFECTS[name]())

    def material(self, name: str) -> Material:
        """The material of that name, or :class:`ParameterError` naming the known ones."""
        for material in self.materials:
            if material.name == name:
                return material
        raise ParameterError(f"material.{name}: no such material; known: {', '.join(m.name for m in self.materials)}")

    def pair(self, a: str, b: str) -> Pair:
        """The pair of ``a`` and ``b`` in either order, or :class:`ParameterError`."""
        for pair in self.pairs:
            if pair.joins(a, b):
                return pair
        known = ", ".join(f"{p.a}.{p.b}" for p in self.pairs)
        raise ParameterError(f"pair.{a}.{b}: no such pair; known: {known}")

    def contact_pair(self, one: Body, other: Body | str) -> Pair:
        """The pair that applies to a contact: by body names first, then by material names."""
        names = [(one.name, one.material)]
        names.append((other, other) if isinstance(other, str) else (other.name, other.material))
        for a in names[0]:
            for b in names[1]:
                for pair in self.pairs:
                    if pair.joins(a, b):
                        return pair
        return self.pair(names[0][0], names[1][0])


def pour_rig(scene: Scene) -> PourRig:
    """The rig of ``scene``, if bodies are poured into it; :class:`ParameterError` for a bench test."""
    if scene.rig.name in BENCH_RIGS:
        raise ParameterError(f"rig.name: {scene.rig.name!r} is a bench test; a pour needs one of {', '.join(RIGS)}")
    return cast(PourRig, scene.rig)


def poured_mass(scene: Scene) -> float:
    """Mass that is poured [kg]; the solid density of the mixture is 1 / Σ (mass fraction / density)."""
    specific_volume = sum(body.mass_fraction / body.density for body in scene.bodies)
    return pour_rig(scene).poured_mass(1.0 / specific_volume)


def body_counts(scene: Scene) -> tuple[int, ...]:
    """Number of bodies of each component that are poured."""
    return counts(scene.bodies, poured_mass(scene))


def with_rig(scene: Scene, name: str) -> Scene:
    """``scene`` in the rig ``name``: default dimensions, the wall as before, and the settings that suit the rig.

    The result is not checked as a whole: dimensions may have to be set before the bodies fit in.
    """
    known: dict[str, Any] = {**RIGS, **BENCH_RIGS}
    if name not in known:
        raise ParameterError(f"rig.name: {name!r} is not one of {', '.join(known)}")
    own = {"body": scene.bodies[0].name} if name in BENCH_RIGS else {}
    rig: Rig = known[name](wall=scene.rig.wall, **own)
    scene = dataclasses.replace(scene, rig=rig, insertion=Insertion())
    for path, value in rig.suits.items():
        scene = _with_value(scene, path.split("."), value)
    return scene


def parameters(scene: Scene) -> dict[str, Parameter]:
    """Every parameter of ``scene``: path → :class:`Parameter`."""
    found: dict[str, Parameter] = {}
    for material in scene.materials:
        found |= declared(material, f"material.{material.name}")
    for pair in scene.pairs:
        found |= declared(pair, f"pair.{pair.a}.{pair.b}")
    found["body.spheres"] = SPHERES
    for body in scene.bodies:
        found |= body_parameters(body)
    found |= declared(scene.rig, "rig")
    if scene.rig.name in RIGS:
        found |= declared(scene.insertion, "insertion")
    else:
        names = tuple(body.name for body in scene.bodies)
        found["rig.body"] = Parameter("rig.body", "1", 0, 0, "The component that is measured.", choices=names)
    found |= declared(scene.numerics, "numerics")
    found |= declared(scene.contact, "contact")
    for name, kind in EFFECTS.items():
        found |= declared(kind, f"effect.{name}")
    return found


def canonical(scene: Scene, path: str) -> str:
    """``path`` with the names of a pair in the order of the scene; raises if the path does not exist."""
    return _parameter(scene, path).path


def _parameter(scene: Scene, path: str) -> Parameter:
    known = parameters(scene)
    if path in known:
        return known[path]
    parts = path.split(".")
    if parts[0] == "pair" and len(parts) == 4:
        pair = scene.pair(parts[1], parts[2])
        swapped = f"pair.{pair.a}.{pair.b}.{parts[3]}"
        if swapped in known:
            return known[swapped]
    near = [name for name in known if name.split(".")[0] == parts[0]] or sorted({n.split(".")[0] for n in known})
    raise ParameterError(f"{path}: no such parameter; known: {', '.join(near)}")


def value(scene: Scene, path: str) -> Any:
    """Value of a parameter in SI (or the name of a choice)."""
    return _value(scene, canonical(scene, path))


def values(scene: Scene) -> dict[str, Any]:
    """Values of all parameters in SI (or the names of choices), by path."""
    return {path: _value(scene, path) for path in parameters(scene)}


def with_values(scene: Scene, values: dict[str, Any]) -> Scene:
    """``scene`` with parameters replaced; each value is checked against its range, and the result as a whole.

    Mass fractions that are not set scale so that all add up to one.
    """
    fractions: dict[str, float] = {}
    for path, raw in values.items():
        parameter = _parameter(scene, path)
        kind, *rest = parameter.path.split(".")
        if kind == "body" and rest[-1] == "mass_fraction":
            fractions[rest[0]] = float(parameter.check(raw))
        else:
            scene = _with_value(scene, [kind, *rest], parameter.check(raw))
    if fractions:
        scene = dataclasses.replace(scene, bodies=with_fractions(scene.bodies, fractions))
    check(scene)
    return scene


def check(scene: Scene) -> None:
    """Raise :class:`ParameterError` if the parts of a scene, after its set-up effects, do not fit together."""
    scene = actual(scene)
    for effect in scene.effects:
        if effect.on and not scene.contact.carries(effect.name):
            raise ParameterError(
                f"effect.{effect.name}.{effect.amplitudes[0]}: {effect.numbers[0]:g} does not go with contact.law "
                f"{scene.contact.law}; allowed: 0"
            )
    for body in scene.bodies:
        scene.material(body.material)
        scene.contact_pair(body, scene.rig.wall)
        for other in scene.bodies:
            scene.contact_pair(body, other)
    scene.material(scene.rig.wall)
    _check_gravity(scene)
    scene.rig.check(widest_body=max(sorted(body.largest_extents)[1] for body in scene.bodies))
    if scene.rig.name in RIGS:
        rig = pour_rig(scene)
        if rig.domain_half_width <= (opening := rig.feed().half_width):
            raise ParameterError(
                f"rig.domain_half_width: {rig.domain_half_width:g} m lies within the feed opening; allowed: more than "
                f"{opening:g} m"
            )
        if scene.insertion.protocol not in rig.protocols:
            allowed = ", ".join(rig.protocols)
            raise ParameterError(
                f"insertion.protocol: {scene.insertion.protocol!r}; allowed in the rig {rig.name}: {allowed}"
            )
        longest = max(max(body.largest_extents) for body in scene.bodies)
        if rig.running_time is not None and rig.running_time >= scene.numerics.max_time:
            raise ParameterError(
                f"numerics.max_time: {scene.numerics.max_time:g} s is not longer than the {rig.running_time:g} s for "
                f"which the {rig.name} runs; raise it, turn faster, or turn fewer times"
            )
        acting = max((one.after for one in rig.actions()), default=0.0)
        if scene.numerics.duration == 0.0 and acting >= scene.numerics.max_time:
            raise ParameterError(
                f"numerics.max_time: {scene.numerics.max_time:g} s is not longer than the {acting:g} s that the "
                f"{rig.name} takes to act; raise it, or let the rig act faster"
            )
        _check_duration(rig, scene.numerics)
        rig.feed().check(scene.insertion.region_radius, longest)


def _check_gravity(scene: Scene) -> None:
    """In a rig, refuse gravity that does not point downwards or is too large."""
    in_rig = scene.rig.name in RIGS or scene.rig.name in BENCH_RIGS
    if in_rig and not (scene.gravity[2] < 0.0 and math.hypot(*scene.gravity) <= MOST_GRAVITY):
        raise ParameterError(
            f"gravity: {list(scene.gravity)} m/s2; allowed: third number below 0, magnitude up to {MOST_GRAVITY:g} m/s2"
        )


def actual(scene: Scene) -> Scene:
    """``scene`` after its set-up effects; they are off in the result, so applying it again changes nothing."""
    for kind in set_up_effects():
        effect = scene.effect(kind.name)
        if isinstance(effect, SetUpEffect) and effect.on:
            scene = effect.applied(scene).without_effect(kind.name)
    return scene


def _value(scene: Scene, path: str) -> Any:
    kind, *rest = path.split(".")
    if kind == "material":
        return getattr(scene.material(rest[0]), rest[1])
    if kind == "pair":
        return getattr(scene.pair(rest[0], rest[1]), rest[2])
    if kind == "body":
        return scene.bodies[0].spheres if rest == ["spheres"] else _body(scene, rest[0]).value(rest[1])
    if kind == "effect":
        return getattr(scene.effect(rest[0]), rest[1])
    return getattr(getattr(scene, kind), rest[0])


def _with_value(scene: Scene, parts: list[str], new: Any) -> Scene:
    kind, *rest = parts
    if kind == "material":
        old: Any = scene.material(rest[0])
        materials = _swap(scene.materials, old, {rest[1]: new})
        return dataclasses.replace(scene, materials=materials, bodies=with_densities(scene.bodies, materials))
    if kind == "pair":
        old = scene.pair(rest[0], rest[1])
        return dataclasses.replace(scene, pairs=_swap(scene.pairs, old, {rest[2]: new}))
    if kind == "body":
        return dataclasses.replace(scene, bodies=with_body_value(scene.bodies, rest, new))
    if kind == "effect":
        return scene.with_effect(dataclasses.replace(scene.effect(rest[0]), **{rest[1]: new}))
    return dataclasses.replace(scene, **{kind: dataclasses.replace(getattr(scene, kind), **{rest[0]: new})})


def _swap(items: tuple[Any, ...], old: Any, changes: dict[str, Any]) -> tuple[Any, ...]:
    return tuple(dataclasses.replace(item, **changes) if item is old else item for item in items)


def _body(scene: Scene, name: str) -> Body:
    return next(body for body in scene.bodies if body.name == name)


def _check_duration(rig: PourRig, numerics: Numerics) -> None:
    if numerics.duration > 0.0 and rig.running_time is not None:
        raise ParameterError(
            f"numerics.duration: {numerics.duration:g} s; allowed in the rig {rig.name}, which sets its own time: 0"
        )
    if numerics.duration > numerics.max_time:
        raise ParameterError(
            f"numerics.duration: {numerics.duration:g} s is beyond numerics.max_time; "
            f"allowed: up to {numerics.max_time:g} s"
        )
