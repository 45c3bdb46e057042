"""Columns of the effects' numbers in the arrays of a batch: one layout for NumPy and the kernels."""

from __future__ import annotations

from itertools import accumulate
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from solver.effects import body_effects, contact_effects
from solver.effects.effect import BodyEffect, ContactEffect, Effect
from solver.params import declared
from solver.scenes.material import effective_youngs_modulus

if TYPE_CHECKING:
    from solver.scenes.body import Body
    from solver.scenes.scene import Scene

Array = npt.NDArray[np.float64]

CONTACT_EFFECTS, BODY_EFFECTS = contact_effects(), body_effects()
KINDS: tuple[type[Effect], ...] = (*CONTACT_EFFECTS, *BODY_EFFECTS)
WIDTHS = tuple(len(declared(kind, "")) for kind in KINDS)
COLUMNS = (0, *accumulate(WIDTHS))
"""First column of each effect's parameters, contact effects before body effects; the last holds the restitution."""
MEMORIES = tuple(kind.memory for kind in CONTACT_EFFECTS)
MEMORY = (0, *accumulate(MEMORIES))
"""First column of what each contact effect keeps of a contact; ``COUPLE`` and ``HERTZ`` follow."""
COUPLE = MEMORY[-1]
"""First of three columns: torque of the effects on the first body at the last step [N m], for the energy account."""
HERTZ = COUPLE + 3
"""Contact radius without adhesion, √(R* δ), at the last step [m], for the energy account."""
KEPT = HERTZ + 1
"""Number of columns of a contact's memory."""


def kernel_effects(scene: Scene) -> bool:
    """Whether ``scene`` has an effect that acts in the kernels."""
    return any(effect.on for effect in scene.effects if isinstance(effect, (ContactEffect, BodyEffect)))


def effect_table(scene: Scene, walls: tuple[str, ...]) -> Array:
    """Parameters of the effects by contact class, shape (kinds, kinds, COLUMNS[-1] + 1): bodies, then wall materials.

    Zero for effects that are off or do not act between two classes.
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
        others: tuple[Body | str, ...] = (*scene.bodies, *walls)
        for b, other in enumerate(others):
            table[a, b, -1] = table[b, a, -1] = scene.contact_pair(one, other).restitution
    return table


def reach_of_pulls(scene: Scene, walls: tuple[str, ...]) -> float:
    """Distance [m] beyond which no effect of ``scene`` holds two surfaces together.

    A grip is monotonic in R*, or falls and then rises, so its values at the ends of the range of R* bound it; the ends
    are half the smallest member radius and the largest one. Grips are added, which also bounds two works of adhesion
    that act together.
    """
    pulling = [effect for effect in scene.effects if effect.on and isinstance(effect, ContactEffect)]
    if not pulling:
        return 0.0
    radii = [(body.clump.radii, body.sizes) for body in scene.bodies]
    least = min(float(radius.min()) * sizes.low for radius, sizes in radii) / 2.0
    largest = max(float(radius.max()) * sizes.high for radius, sizes in radii)
    materials = {body.material for body in scene.bodies}
    moduli = [
        effective_youngs_modulus(scene.material(one), scene.material(other))
        for one in materials
        for other in (*materials, *walls)
    ]
    return sum(max(effect.grip(e, radius) for e in moduli for radius in (least, largest)) for effect in pulling)


def _row(effect: ContactEffect, at_wall: bool, width: int) -> Array:
    row = np.zeros(width)
    numbers = effect.row(at_wall)
    row[: len(numbers)] = numbers
    return row
