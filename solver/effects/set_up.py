"""The scene as it is: the declared one with its effects of material and set-up carried out."""

from __future__ import annotations

from typing import TYPE_CHECKING

from solver.effects import SetUpEffect, set_up_effects

if TYPE_CHECKING:
    from solver.scene import Scene


def actual(scene: Scene) -> Scene:
    """``scene`` after its set-up effects; they are off in the result, so doing it again changes nothing."""
    for kind in set_up_effects():
        effect = scene.effect(kind.name)
        if isinstance(effect, SetUpEffect) and effect.on:
            scene = effect.applied(scene).without_effect(kind.name)
    return scene
