"""The mass of the heaviest body that was poured, given by every rig that leaves a pile."""

from solver.effects.effect import Telltale
from solver.observables.observable import Observable, Value
from solver.pours.record import Record
from solver.rigs.rig import PILE


def heaviest_body(record: Record) -> Value:
    """Mass of the heaviest body [kg]."""
    return Value(float(record.bodies.mass.max()), "kg")


HEAVIEST_BODY = Observable(
    name="heaviest_body_kg",
    unit="kg",
    doc="Mass of the heaviest body.",
    function=heaviest_body,
    needs="record",
    group=PILE,
    telltales=(Telltale.PACKING,),
    label="heaviest body",
)
