"""Observables: what is read off a finished run. NumPy and SciPy only, no kernels.

A new observable is one function and one line in ``OBSERVABLES`` (or in the table of the rigs it belongs to). Each rig
names those that it gives. Scalars stand in the tables; the curves are functions of their own: :func:`discharge_curve`,
:func:`height_profile` and :func:`surface_profile`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from solver.observables import discharge, draw_down, free_surface, packing, pile, segregation
from solver.observables.discharge import discharge_curve
from solver.observables.free_surface import surface_profile
from solver.observables.pile import height_profile
from solver.observables.reading import PileReading
from solver.observables.repose import AZIMUTHS_DEG, flank_angles_deg
from solver.observables.silhouette import largest_part, silhouette
from solver.observables.value import Value
from solver.scene import Scene, pour_rig

if TYPE_CHECKING:
    from solver.record import Pile, Record

__all__ = [
    "AZIMUTHS_DEG",
    "COMPONENT_OBSERVABLES",
    "OBSERVABLES",
    "REGISTRY",
    "ComponentObservable",
    "Observable",
    "PileReading",
    "Value",
    "discharge_curve",
    "flank_angles_deg",
    "height_profile",
    "largest_part",
    "observable_names",
    "observe",
    "observe_pile",
    "silhouette",
    "surface_profile",
]

PileFunction: TypeAlias = Callable[[PileReading], Value]
RecordFunction: TypeAlias = Callable[["Record"], Value]


@dataclass(frozen=True)
class Observable:
    """A named scalar. ``needs``: what ``function`` takes, a pile's reading or the whole record."""

    name: str
    unit: str
    doc: str
    function: Callable[..., Value]
    needs: Literal["pile", "record"]


@dataclass(frozen=True)
class ComponentObservable:
    """A scalar per component of the pile; observed as ``<name>.<component>``."""

    name: str
    unit: str
    doc: str
    function: Callable[[PileReading], dict[str, Value]]


def _of_pile(name: str, unit: str, function: PileFunction, doc: str | None = None) -> Observable:
    return Observable(name, unit, doc or _first_line(function), function, "pile")


def _of_record(name: str, unit: str, function: RecordFunction) -> Observable:
    return Observable(name, unit, _first_line(function), function, "record")


def _of_component(name: str, unit: str, function: Callable[[PileReading], dict[str, Value]]) -> ComponentObservable:
    return ComponentObservable(name, unit, _first_line(function), function)


def _first_line(function: Callable[..., object]) -> str:
    return (function.__doc__ or "").splitlines()[0]


def _of_view(azimuth_deg: int) -> Observable:
    doc = f"Silhouette flank fit, view from azimuth {azimuth_deg}°, mean of both flanks."
    return _of_pile(f"angle_of_repose_deg@{azimuth_deg}", "deg", pile.angle_of_repose_at(azimuth_deg), doc)


OBSERVABLES: tuple[Observable, ...] = (
    _of_pile("angle_of_repose_deg", "deg", pile.angle_of_repose),
    _of_pile("angle_of_repose_left_deg", "deg", pile.angle_of_repose_left),
    _of_pile("angle_of_repose_right_deg", "deg", pile.angle_of_repose_right),
    _of_view(0),
    _of_view(45),
    _of_view(90),
    _of_view(135),
    _of_pile("angle_of_repose_above_one_body_deg", "deg", pile.angle_of_repose_above_one_body),
    _of_pile("angle_of_repose_cone_deg", "deg", pile.angle_of_repose_cone),
    _of_pile("angle_of_repose_mass_cone_deg", "deg", pile.angle_of_repose_mass_cone),
    _of_pile("angle_of_repose_volume_cone_deg", "deg", pile.angle_of_repose_volume_cone),
    _of_pile("apex_height_m", "m", pile.apex_height),
    _of_pile("centre_height_m", "m", pile.centre_height),
    _of_pile("footprint_r50_m", "m", pile.footprint_r50),
    _of_pile("footprint_r90_m", "m", pile.footprint_r90),
    _of_pile("centroid_x_m", "m", pile.centroid_x),
    _of_pile("centroid_y_m", "m", pile.centroid_y),
    _of_pile("stray_fraction", "1", pile.stray_fraction),
    _of_pile("bulk_density_kg_m3", "kg/m3", packing.bulk_density),
    _of_record("solid_fraction", "1", packing.solid_fraction),
    _of_record("discharge_t10_s", "s", discharge.discharge_t10),
    _of_record("discharge_t50_s", "s", discharge.discharge_t50),
    _of_record("discharge_t90_s", "s", discharge.discharge_t90),
    _of_record("discharge_time_s", "s", discharge.discharge_time),
    _of_record("residual_mass_kg", "kg", discharge.residual_mass),
    _of_record("left_domain_fraction", "1", discharge.left_domain_fraction),
)

DRUM_OBSERVABLES: tuple[Observable, ...] = (
    _of_record("dynamic_angle_deg", "deg", free_surface.dynamic_angle),
    _of_record("slope_deg", "deg", free_surface.slope),
    _of_record("slope_core_deg", "deg", free_surface.slope_core),
)

BOX_OBSERVABLES: tuple[Observable, ...] = (
    _of_record("draw_down_angle_deg", "deg", draw_down.draw_down_angle),
    _of_record("draw_down_angle_left_deg", "deg", draw_down.draw_down_angle_left),
    _of_record("draw_down_angle_right_deg", "deg", draw_down.draw_down_angle_right),
)

REGISTRY = {observable.name: observable for observable in OBSERVABLES + DRUM_OBSERVABLES + BOX_OBSERVABLES}
"""Every scalar that some rig gives, by name."""

COMPONENT_OBSERVABLES: tuple[ComponentObservable, ...] = (
    _of_component("inner_mass_share", "1", segregation.inner_mass_share),
    _of_component("outer_mass_share", "1", segregation.outer_mass_share),
    _of_component("segregation_index", "1", segregation.segregation_index),
)


def observable_names(scene: Scene) -> tuple[str, ...]:
    """Names of the scalars that a run of ``scene`` gives; those per component (``<name>.<component>``) are not among
    them."""
    return pour_rig(scene).observables


def observe(record: Record) -> dict[str, Value]:
    """The observables of the rig by name, whatever the outcome; NaN where one cannot be measured."""
    wanted = [REGISTRY[name] for name in observable_names(record.scene)]
    of_record = {o.name: o.function(record) for o in wanted if o.needs == "record"}
    of_pile = tuple(o for o in wanted if o.needs == "pile")
    return (observe_pile(record.pile, of_pile) if of_pile else {}) | of_record


PILE_OBSERVABLES = tuple(observable for observable in OBSERVABLES if observable.needs == "pile")


def observe_pile(pile: Pile, wanted: tuple[Observable, ...] = PILE_OBSERVABLES) -> dict[str, Value]:
    """The observables that a pile alone gives (a simulated one or a scan), by name.

    Those per component are left out where there is one component. A pile with a coordinate that is not finite
    has nothing to measure: every value is NaN.
    """
    finite = bool(np.isfinite(pile.position).all() and np.isfinite(pile.spheres.centre).all())
    reading = PileReading(pile)
    values = {o.name: o.function(reading) if finite else Value(float("nan"), o.unit) for o in wanted}
    if len(pile.component_names) > 1:
        for observable in COMPONENT_OBSERVABLES:
            found = observable.function(reading) if finite else {}
            for component in pile.component_names:
                nothing = Value(float("nan"), observable.unit)
                values[f"{observable.name}.{component}"] = found.get(component, nothing)
    return values
