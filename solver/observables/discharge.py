"""Observables of the flow through the outlet, read from a record's curves.

The clock starts when the gate opens; without a gate, when the first body enters.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from solver.effects.effect import Telltale
from solver.observables.observable import AT_LEAST_0, SHARE, Value, of_record
from solver.rigs.rig import DISCHARGE

if TYPE_CHECKING:
    from solver.pours.record import Record

Array = npt.NDArray[np.float64]

ROUNDING = 1e-9
"""Relative tolerance for sums of the mass that are taken in different orders."""


def discharge_curve(record: Record) -> tuple[Array, Array]:
    """``discharged_mass_kg``: times on the module's clock [s], mass below the outlet [kg]; shape (k,) each."""
    return record.trace.time - record.gate_opened, record.trace.discharged_mass


def time_of_share(share: float, time: Array, discharged_mass: Array, poured_mass: float) -> float:
    """Time [s] at which ``share`` of ``poured_mass`` [kg] has passed the outlet, linear between samples.

    ``time`` [s] and ``discharged_mass`` [kg], shape (k,) each. NaN if it never has.
    """
    # The tolerance keeps rounding of the sum from hiding the last body.
    wanted = (share - ROUNDING) * poured_mass
    reached = np.flatnonzero(discharged_mass >= wanted)
    if reached.size == 0 or not poured_mass > 0.0:
        return float("nan")
    last = int(reached[0])
    if last == 0:
        return float(time[0])
    samples = slice(last - 1, last + 1)
    return float(np.interp(wanted, discharged_mass[samples], time[samples]))


def discharge_t10(record: Record) -> Value:
    """Time at which 10 % of the poured mass has passed the outlet."""
    return Value(_time_of_share(0.1, record), "s")


def discharge_t50(record: Record) -> Value:
    """Time at which 50 % of the poured mass has passed the outlet."""
    return Value(_time_of_share(0.5, record), "s")


def discharge_t90(record: Record) -> Value:
    """Time at which 90 % of the poured mass has passed the outlet."""
    return Value(_time_of_share(0.9, record), "s")


def discharge_time(record: Record) -> Value:
    """t90 - t10: the duration without the first and the last bodies, and independent of the clock's start."""
    return Value(_time_of_share(0.9, record) - _time_of_share(0.1, record), "s")


def residual_mass(record: Record) -> Value:
    """Mass that entered and did not pass the outlet by the end."""
    trace = record.trace
    if trace.time.size == 0:
        return Value(float("nan"), "kg")
    entered, left = float(trace.entered_mass[-1]), float(trace.entered_mass[-1] - trace.discharged_mass[-1])
    # The two sums add the bodies in different orders: a difference below a billionth of the mass is rounding.
    return Value(left if abs(left) > ROUNDING * entered else 0.0, "kg")


def left_domain_fraction(record: Record) -> Value:
    """Mass fraction of the bodies that rolled out of the domain and were taken out."""
    bodies = record.bodies
    if bodies.mass.size == 0:
        return Value(float("nan"), "1")
    return Value(float(bodies.mass[~bodies.inside].sum() / bodies.mass.sum()), "1")


def _time_of_share(share: float, record: Record) -> float:
    return time_of_share(share, *discharge_curve(record), record.poured_mass)


FLOW, PACKING = Telltale.FLOW, Telltale.PACKING
OBSERVABLES = (
    of_record("discharge_t10_s", "s", discharge_t10, FLOW, PACKING, group=DISCHARGE, possible=AT_LEAST_0),
    of_record("discharge_t50_s", "s", discharge_t50, FLOW, PACKING, group=DISCHARGE, possible=AT_LEAST_0),
    of_record("discharge_t90_s", "s", discharge_t90, FLOW, PACKING, group=DISCHARGE, possible=AT_LEAST_0),
    of_record("discharge_time_s", "s", discharge_time, FLOW, PACKING, group=DISCHARGE, possible=AT_LEAST_0),
    of_record("residual_mass_kg", "kg", residual_mass, FLOW, PACKING, group=DISCHARGE, possible=AT_LEAST_0),
    of_record("left_domain_fraction", "1", left_domain_fraction, FLOW, group=DISCHARGE, possible=SHARE),
)
