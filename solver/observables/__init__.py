"""Observables: quantities read from a finished run. NumPy and SciPy only, no kernels.

Each file lists its scalars in a table, and ``OBSERVABLES`` holds all of them (``observable.py`` explains how to add
one). A rig names the groups of observables that it gives. The curves are separate functions: :func:`discharge_curve`,
:func:`height_profile` and :func:`surface_profile`.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from solver.observables import discharge, draw_down, free_surface, packing, pile, segregation
from solver.observables.discharge import discharge_curve
from solver.observables.free_surface import surface_profile
from solver.observables.observable import ComponentObservable, Observable, Value
from solver.observables.pile import height_profile
from solver.observables.reading import PileReading
from solver.observables.repose import AZIMUTHS_DEG, flank_angles_deg
from solver.observables.silhouette import largest_part, silhouette
from solver.plugins import Registry, instance_of
from solver.rigs import PourRig
from solver.scenes.scene import Scene, pour_rig

if TYPE_CHECKING:
    from solver.pours.record import Pile, Record

__all__ = [
    "AZIMUTHS_DEG",
    "COMPONENT_OBSERVABLES",
    "OBSERVABLES",
    "ComponentObservable",
    "Observable",
    "PileReading",
    "Value",
    "discharge_curve",
    "flank_angles_deg",
    "height_profile",
    "largest_part",
    "observable_names",
    "observables_in",
    "observe",
    "observe_pile",
    "silhouette",
    "surface_profile",
]

OBSERVABLES = Registry(
    "observable",
    (
        *pile.OBSERVABLES,
        *packing.OBSERVABLES,
        *discharge.OBSERVABLES,
        *free_surface.OBSERVABLES,
        *draw_down.OBSERVABLES,
    ),
    instance_of(Observable),
)
"""Every scalar that some rig gives, by name."""
COMPONENT_OBSERVABLES = segregation.OBSERVABLES


def observables_in(rig: PourRig) -> tuple[str, ...]:
    """Names of the scalars that a run in ``rig`` gives, without those per component (``<name>.<component>``)."""
    found: list[str] = []
    for one in rig.gives:
        found += [one] if one in OBSERVABLES else [name for name, known in OBSERVABLES.items() if known.group == one]
    return tuple(dict.fromkeys(found))


def observable_names(scene: Scene) -> tuple[str, ...]:
    """Names of the scalars that a run of ``scene`` gives."""
    return observables_in(pour_rig(scene))


def observe(record: Record) -> dict[str, Value]:
    """The observables of the rig by name, whatever the outcome; NaN where one cannot be measured."""
    wanted = [OBSERVABLES[name] for name in observable_names(record.scene)]
    of_record = {o.name: o.function(record) for o in wanted if o.needs == "record"}
    of_pile = [o for o in wanted if o.needs == "pile"]
    return (observe_pile(record.pile, of_pile) if of_pile else {}) | of_record


def observe_pile(pile: Pile, wanted: Iterable[Observable] | None = None) -> dict[str, Value]:
    """Observables of a pile alone, simulated or scanned, by name; ``wanted`` None: all of them.

    Observables per component are left out if there is only one component. If any coordinate of the pile is not
    finite, every value is NaN.
    """
    finite = bool(np.isfinite(pile.position).all() and np.isfinite(pile.spheres.centre).all())
    if wanted is None:
        wanted = (o for o in OBSERVABLES.values() if o.needs == "pile")
    reading = PileReading(pile)
    values = {o.name: o.function(reading) if finite else Value(float("nan"), o.unit) for o in wanted}
    if len(pile.component_names) > 1:
        for observable in COMPONENT_OBSERVABLES:
            found = observable.function(reading) if finite else {}
            for component in pile.component_names:
                nothing = Value(float("nan"), observable.unit)
                values[f"{observable.name}.{component}"] = found.get(component, nothing)
    return values
