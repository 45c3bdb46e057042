"""Observables by the names used in measured data: scalars and curves, from runs and scanned piles alike.

A scalar is one of ``OBSERVABLES`` or a view ``angle_of_repose_deg@AZ`` from any azimuth. The curves:

    discharged_mass_kg    over time [s]         0 before the first sample, held after the last
    height_profile_m      over radius [m]       rings 5 mm wide, linear between their middles
    surface_profile_m     over x [m]            linear between columns of pixels, NaN beyond the middle 60 % of the drum
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from solver.effects.effect import Telltale
from solver.observables import OBSERVABLES, Observable, discharge_curve, height_profile, surface_profile
from solver.observables.packing import solid_fraction_of
from solver.observables.pile import PROFILE_RING, view
from solver.observables.reading import PileReading

if TYPE_CHECKING:
    from solver.pours.record import Pile, Record
    from solver.scenes.scene import Scene

Array = npt.NDArray[np.float64]
Readings = dict[str, float | Array]
"""Value of a scalar, or values of a curve at the requested places, by name."""

VIEW = re.compile(r"angle_of_repose_deg@(\d+(?:\.\d+)?)")


@dataclass(frozen=True)
class Named:
    """What a name stands for."""

    name: str
    unit: str
    x_unit: str | None
    """Unit of a curve's abscissa; None for a scalar."""
    of_pile: bool
    """True if a scanned pile gives it."""
    telltales: tuple[Telltale, ...]
    """Classes of observables that it belongs to."""


SHAPE, FLOW, PACKING = Telltale.SHAPE, Telltale.FLOW, Telltale.PACKING
CURVES = (
    Named("discharged_mass_kg", "kg", "s", of_pile=False, telltales=(FLOW, PACKING)),
    Named("height_profile_m", "m", "m", of_pile=True, telltales=(SHAPE, PACKING)),
    Named("surface_profile_m", "m", "m", of_pile=False, telltales=(SHAPE, FLOW, PACKING)),
)


def named(name: str) -> Named | None:
    """What ``name`` stands for; None for one that is not known."""
    for curve in CURVES:
        if curve.name == name:
            return curve
    scalar = _scalar(name)
    if scalar is None:
        return None
    of_pile = scalar.needs == "pile" or name == "solid_fraction"
    return Named(name, scalar.unit, None, of_pile, scalar.telltales)


def all_names() -> tuple[str, ...]:
    """Every name except views from azimuths that are not listed."""
    return (*OBSERVABLES, *(curve.name for curve in CURVES))


def observe_named(record: Record, wanted: Mapping[str, Array | None]) -> Readings:
    """Observables of a run; ``wanted``: name → places of a curve, None for a scalar. Unknown names raise KeyError."""
    readings = _of_pile(PileReading(record.pile), record.scene, _pile_part(wanted))
    for name, x in wanted.items():
        if name in readings:
            continue
        if x is None:
            readings[name] = OBSERVABLES[name].function(record).value
        else:
            readings[name] = RECORD_CURVES[name](record, x)
    return readings


def observe_scan(scan: Pile, scene: Scene, wanted: Mapping[str, Array | None]) -> Readings:
    """The same for a scanned pile of the bodies of ``scene``; names that a pile does not give are left out."""
    return _of_pile(PileReading(scan), scene, _pile_part(wanted))


def _pile_part(wanted: Mapping[str, Array | None]) -> dict[str, Array | None]:
    return {name: x for name, x in wanted.items() if (known := named(name)) is not None and known.of_pile}


def _of_pile(reading: PileReading, scene: Scene, wanted: Mapping[str, Array | None]) -> Readings:
    if not (np.isfinite(reading.pile.position).all() and np.isfinite(reading.pile.spheres.centre).all()):
        return {name: math.nan if x is None else np.full(x.shape, np.nan) for name, x in wanted.items()}
    readings: Readings = {}
    for name, x in wanted.items():
        if x is not None:
            rings = math.ceil(float(x.max()) / PROFILE_RING) + 1
            radius, height = height_profile(reading, rings=rings)
            readings[name] = np.interp(x, radius, height)
        elif name == "solid_fraction":
            readings[name] = solid_fraction_of(reading, scene).value
        else:
            scalar = _scalar(name)
            assert scalar is not None
            readings[name] = scalar.function(reading).value
    return readings


def _scalar(name: str) -> Observable | None:
    if name in OBSERVABLES:
        return OBSERVABLES[name]
    match = VIEW.fullmatch(name)
    if match is None:
        return None
    # The mean of both flanks is the same from behind.
    return view("angle_of_repose_deg", float(match[1]) % 180.0)


def _discharged(record: Record, x: Array) -> Array:
    time, mass = discharge_curve(record)
    return np.interp(x, time, mass, left=0.0) if time.size else np.full(x.shape, np.nan)


def _free_surface(record: Record, x: Array) -> Array:
    place, height = surface_profile(record)
    return np.interp(x, place, height, left=np.nan, right=np.nan) if place.size else np.full(x.shape, np.nan)


RECORD_CURVES: dict[str, Callable[[Record, Array], Array]] = {
    "discharged_mass_kg": _discharged,
    "surface_profile_m": _free_surface,
}
"""Curves that need a whole run, at given places."""
