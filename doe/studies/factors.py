"""Factors in a scene: their levels within the declared ranges, and the number of bodies that they affect."""

from __future__ import annotations

import math
from collections.abc import Sequence

from solver import ParameterError, Scene, body_counts, canonical, parameters, value, with_values

MIN_BODIES = 5
"""A factor that affects fewer bodies than this cannot be tested: its effect depends on where a few bodies lie."""


def checked_levels(
    scene: Scene, name: str, path: str, levels: Sequence[float | str]
) -> tuple[str, float | str, float | str, float | str]:
    """Return (canonical path, low, high, reference [SI]) of the factor ``name``; its ends are tried on the scene."""
    path = canonical(scene, path)
    parameter = parameters(scene)[path]
    low, high, reference = (parameter.check(level) for level in levels)
    if isinstance(low, float) and isinstance(high, float) and isinstance(reference, float):
        if not low < high:
            raise ParameterError(f"{name} ({path}): low {low:g} is not below high {high:g}")
        if not low <= reference <= high:
            raise ParameterError(f"{name} ({path}): reference {reference:g} is outside {low:g} … {high:g}")
    elif low == high:
        raise ParameterError(f"{name} ({path}): low and high are both {low!r}; two different names are needed")
    for level in (low, high):
        with_values(scene, {path: level})
    return path, low, high, reference


def bodies_touched(scene: Scene, path: str) -> float:
    """Return the number of bodies whose contacts a parameter affects; infinite for rig, insertion and numerics.

    For a pair it is the smaller number of the two partners (the wall counts as infinitely many). A dimension of a body
    affects the bodies of that component. The resolution of the shapes affects every body, and so does a mass fraction,
    because it changes all the others.
    """
    number = list(zip(scene.bodies, body_counts(scene), strict=True))

    def of_end(name: str) -> float:
        of_wall = name == scene.rig.wall
        return math.inf if of_wall else sum(n for body, n in number if name in (body.name, body.material))

    kind, *names = canonical(scene, path).split(".")
    if kind == "material":
        return math.inf if names[0] == scene.rig.wall else sum(n for body, n in number if body.material == names[0])
    if kind == "pair":
        return min(of_end(names[0]), of_end(names[1]))
    if kind == "body":
        one_component = len(names) == 2 and names[1] != "mass_fraction"
        return sum(n for body, n in number if not one_component or body.name == names[0])
    return math.inf


def is_off(scene: Scene, path: str) -> bool:
    """Return whether the scene has the parameter and it is 0, like the parameters of an effect that is off."""
    return path in parameters(scene) and value(scene, path) == 0.0
