"""How densely the bodies of a pile lie."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from solver.effects.effect import Telltale
from solver.observables.observable import AT_LEAST_0, SHARE, Value, of_pile, of_record
from solver.observables.reading import PileReading
from solver.rigs.rig import PILE

if TYPE_CHECKING:
    from solver.pours.record import Record
    from solver.scenes.scene import Scene


def bulk_density(reading: PileReading) -> Value:
    """Mass of the bodies with centres within r50 over the volume under the top surface there."""
    return Value(_inner_density(reading, np.ones(len(reading.pile.component_names))), "kg/m3")


def solid_fraction(record: Record) -> Value:
    """Solid volume (mass over the body's density) over the volume under the top surface, within r50."""
    return solid_fraction_of(PileReading(record.pile), record.scene)


def solid_fraction_of(reading: PileReading, scene: Scene) -> Value:
    """:func:`solid_fraction` of a pile, simulated or scanned, of bodies of ``scene``."""
    density = {body.name: body.density for body in scene.bodies}
    solid_volume_per_mass = np.array([1.0 / density[name] for name in reading.pile.component_names])
    return Value(_inner_density(reading, solid_volume_per_mass), "1")


def _inner_density(reading: PileReading, per_mass: npt.NDArray[np.float64]) -> float:
    """Sum of mass × ``per_mass`` of its component within r50, over the volume under the surface there."""
    if not reading.is_pile or reading.surface is None:
        return float("nan")
    pile = reading.pile
    inner = reading.radii <= reading.r50
    volume = reading.surface.volume(reading.r50)
    return float(pile.mass[inner] @ per_mass[pile.component[inner]]) / volume if volume > 0.0 else float("nan")


OBSERVABLES = (
    of_pile("bulk_density_kg_m3", "kg/m3", bulk_density, Telltale.PACKING, group=PILE, possible=AT_LEAST_0),
    of_record("solid_fraction", "1", solid_fraction, Telltale.PACKING, group=PILE, scanned=True, possible=SHARE),
)
