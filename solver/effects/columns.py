"""Where the numbers of effects stand in the arrays of a batch: one table for NumPy and the kernels."""

from __future__ import annotations

from itertools import accumulate
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from solver.effects import BODY_EFFECTS, CONTACT_EFFECTS
from solver.effects.effect import BodyEffect, ContactEffect, Effect
from solver.material import effective_youngs_modulus
from solver.params import declared

if TYPE_CHECKING:
    from solver.scene import Scene

Array = npt.NDArray[np.float64]

KINDS: tuple[type[Effect], ...] = (*CONTACT_EFFECTS, *BODY_EFFECTS)
WIDTHS = tuple(len(declared(kind, "")) for kind in KINDS)
COLUMNS = (0, *accumulate(WIDTHS))
"""First column of each effect's parameters, contact effects before body effects; the restitution stands in the last."""
MEMORIES = tuple(kind.memory for kind in CONTACT_EFFECTS)
MEMORY = (0, *accumulate(MEMORIES))
"""First column of what each contact effect keeps of a contact; the last entry is the number of columns."""


def kernel_effects(scene: Scene) -> bool:
    """Whether ``scene`` has an effect that acts in the kernels."""
    return any(effect.on for effect in scene.effects if isinstance(effect, (ContactEffect, BodyEffect)))


def effect_table(scene: Scene, walls: tuple[str, ...]) -> Array:
    """Parameters of the effects by contact class, shape (kinds, kinds, COLUMNS[-1] + 1): bodies, then wall materials.

    Zeros for effects that are off, or do not act between two classes.
    """
    n = len(scene.bodies)
    table = np.zeros((n + len(walls), n + len(walls), COLUMNS[-1] + 1))
    for k, kind in enumerate(KINDS):
        effect = scene.effect(kind.name)
        if not effect.on:
            continue
        columns = slice(COLUMNS[k], COLUMNS[k + 1])
        if isinstance(effect, ContactEffect):
            among, wall = _row(effect, False, WIDTHS[k]), _row(effect, True, WIDTHS[k])
            table[:n, :n, columns] = among
            table[:n, n:, columns] = table[n:, :n, columns] = wall
        else:
            table[:, :, columns] = effect.numbers
    for a, one in enumerate(scene.bodies):
        for b, other in enumerate((*scene.bodies, *walls)):
            table[a, b, -1] = table[b, a, -1] = scene.contact_pair(one, other).restitution
    return table


def reach_of_pulls(scene: Scene, walls: tuple[str, ...]) -> float:
    """Largest distance [m] at which an effect of ``scene`` may still hold two surfaces together."""
    reach = 0.0
    for effect in scene.effects:
        if not effect.on or not isinstance(effect, ContactEffect):
            continue
        for body in scene.bodies:
            radius = float(body.clump.radii.max()) * body.sizes.high
            for other in (*(b.material for b in scene.bodies), *walls):
                e_star = effective_youngs_modulus(scene.material(body.material), scene.material(other))
                reach = max(reach, effect.grip(e_star, radius), effect.grip(e_star, radius / 2.0))
    return reach


def _row(effect: ContactEffect, at_wall: bool, width: int) -> Array:
    row = np.zeros(width)
    numbers = effect.row(at_wall)
    row[: len(numbers)] = numbers
    return row
