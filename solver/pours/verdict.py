"""State of a pour at a moment of decision: still running, at rest, or over in another way. Pure functions.

At rest: all that counts has been slower than ``numerics.rest_speed`` for ``numerics.rest_time``. The speed of a body is
√(2 kinetic energy / mass), so one that spins on the spot is not at rest. What counts are all bodies except those that
roll away beyond the pile (``rolls_away`` of ``engine/kernels/batch.py``), and the filling of a rig while its gate is
shut.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from solver.pours.record import Outcome, Verdict
from solver.rigs.outlet import Obstruction
from solver.rigs.rig import PourRig
from solver.scenes.numerics import Numerics

RUNNING: Verdict = (Outcome.RUNNING, "")
STALL_TIME = 0.5
"""A container that has released nothing for this long [s] is done, even if bodies stuck in it still rock: twice the
time that a body needs to fall through the funnel."""


@dataclass(frozen=True)
class Moment:
    """What a verdict depends on."""

    time: float
    """[s]"""
    row: Mapping[str, float]
    """Columns of ``world.SUMMARY_COLUMNS``, and ``lost``: bodies that left where none may."""
    acting: float | None
    """Time since the rig began to act [s]; None while it is filled."""
    acted: bool
    """Whether the rig has completed its actions."""
    missing: int
    """Number of bodies that have not entered."""
    blocked: bool
    """Whether the next body has long been due and finds no place."""
    quiet: bool
    """Whether what counts has been slow for ``numerics.rest_time``."""
    stalled: bool
    """Whether nothing has left the container for long, although it could."""
    speed: float
    """Largest speed of what counts [m/s]."""
    room: int
    """Entries that the contact list holds."""
    poured_mass: float
    """The charge: mass that was to be poured [kg]."""
    across: Obstruction | None = None
    """What lies across the outlet; looked for only when the pour may be over."""
    waiting: int = 0
    """Number of bodies in the container over its outlet; counted only then."""
    spilled: float = 0.0
    """Mass that went over the rim while the gate was shut [kg]; counted only then."""


def verdict(rig: PourRig, numerics: Numerics, moment: Moment) -> Verdict:
    """Outcome and message; RUNNING while the pour goes on."""
    for judged in (_broken(numerics, moment), _overfull(rig, moment), _ended(rig, numerics, moment)):
        if judged is not RUNNING:
            return judged
    if moment.time >= numerics.max_time:
        return Outcome.TIME_LIMIT, f"still moving at {moment.speed:.3g} m/s after {numerics.max_time:g} s"
    return RUNNING


def speed_that_counts(row: Mapping[str, float], gate_shut: bool) -> float:
    """The largest speed [m/s] in a world's summary (columns of ``world.SUMMARY_COLUMNS``)."""
    return max(row["speed"], row["funnel_speed"] if gate_shut else 0.0)


def slow_moments(before: int, speed: float, disturbed: bool, numerics: Numerics) -> int:
    """Number of slow moments of decision in a row: ``before`` and this one; 0 while the plate is moved."""
    return before + 1 if speed < numerics.rest_speed and not disturbed else 0


def at_rest(slow: int, numerics: Numerics) -> bool:
    """Whether all has been slow for long enough, after ``slow`` such moments of decision in a row."""
    return slow * numerics.sample_interval >= numerics.rest_time


def stalled(samples: Sequence[Mapping[str, float]], numerics: Numerics, since: float) -> bool:
    """Whether nothing has left the container for ``STALL_TIME``, by the ``samples`` after the time ``since`` [s]."""
    back = math.ceil(STALL_TIME / numerics.sample_interval)
    if len(samples) <= back or samples[-1]["time"] - since <= STALL_TIME:
        return False
    return samples[-1 - back]["discharged"] == samples[-1]["discharged"]


def _broken(numerics: Numerics, moment: Moment) -> Verdict:
    """The numbers cannot be trusted any more."""
    row = moment.row
    if not row["finite"]:
        return Outcome.NON_FINITE, f"a position or speed is not finite at {moment.time:.3f} s"
    if row["overflow"]:
        return Outcome.BUFFER_OVERFLOW, f"more than {moment.room} entries in the contact list"
    if row["lost"]:
        return (
            Outcome.LOST_BODY,
            f"{row['lost']:.0f} left the domain without coming out of the outlet, or through the plate",
        )
    if row["overlap"] > numerics.overlap_limit:
        return Outcome.OVERLAP_LIMIT, f"overlap of {row['overlap']:.3g} radii at {moment.time:.3f} s"
    return RUNNING


def _overfull(rig: PourRig, moment: Moment) -> Verdict:
    """A rig that is filled once cannot take all of the bodies."""
    if rig.refills or moment.acting is not None:
        return RUNNING
    if moment.row["discharged"] > 0.0:
        return Outcome.JAMMED, f"the rig overflows: {1e3 * moment.row['discharged']:.3g} g lie beside it"
    if moment.blocked:
        return Outcome.JAMMED, f"the rig is full: {moment.missing} bodies find no place in it"
    return RUNNING


def _ended(rig: PourRig, numerics: Numerics, moment: Moment) -> Verdict:
    """The rig has run for its time, the moment of the reading has come, or all has come to rest."""
    # Without a time limit a person at the screen ends the run.
    limited = math.isfinite(numerics.max_time)
    if rig.running_time is not None:
        over = limited and moment.acting is not None and moment.acting >= rig.running_time
        return (Outcome.MEASURED, "") if over else RUNNING
    if numerics.duration > 0.0 and limited:
        # A small tolerance: rounding in the sum of many steps must not miss the moment.
        return (Outcome.MEASURED, "") if moment.time >= numerics.duration - 1e-9 else RUNNING
    return _come_to_rest(rig, numerics, moment)


def _come_to_rest(rig: PourRig, numerics: Numerics, moment: Moment) -> Verdict:
    """All is at rest: a pile; an outlet with a body across it that holds up others; or a jam, where more stays in the
    container than belongs there."""
    row, across = moment.row, moment.across
    empty = row["hanging"] == 0
    if not (may_be_over(moment) and (empty or moment.stalled)):
        return RUNNING
    left = f"{_grams(row['in_funnel'])}, {_share(row['in_funnel'], moment)} of the charge"
    stay = moment.blocked or row["hanging"] > numerics.hanging_bodies
    if across is not None and (across.above > 0.0 or (stay and not rig.keeps_material)):
        return Outcome.OBSTRUCTED, _across(across, rig, moment)
    if rig.keeps_material:
        if row["discharged"] == 0.0:
            return Outcome.JAMMED, f"nothing passes the outlet: {left}, stay"
        if moment.waiting > numerics.hanging_bodies:
            return Outcome.JAMMED, f"{moment.waiting} bodies stay over the outlet of the {_name(rig)}"
        return _rests(rig, moment, "")
    if stay:
        return Outcome.JAMMED, f"{row['hanging']:.0f} bodies ({left}) stay in the {_name(rig)}"
    if across is not None:
        return _rests(rig, moment, _across(across, rig, moment))
    return _rests(rig, moment, "" if empty else f"{left}, hang in the {_name(rig)}")


def may_be_over(moment: Moment) -> bool:
    """Whether the rig has received all that it can take and has completed its actions, and what counts is slow."""
    fed = moment.acting is not None and moment.acted and (moment.missing == 0 or moment.blocked)
    return fed and moment.quiet


def _rests(rig: PourRig, moment: Moment, words: str) -> Verdict:
    """At rest; a rig that is refilled may have been filled over its rim: what spilled lies in or beside the pile."""
    if moment.spilled > 0.0:
        share = _share(moment.spilled, moment)
        over = (
            f"{_grams(moment.spilled)}, {share} of the charge, went over the rim of the {_name(rig)} as it was filled"
        )
        words = f"{words}; {over}" if words else over
    return Outcome.AT_REST, words


def _name(rig: PourRig) -> str:
    return rig.name.replace("_", " ")


def _across(across: Obstruction, rig: PourRig, moment: Moment) -> str:
    """E.g. "one petiole lies across the outlet of the funnel and holds up 4.1 g, 14 % of the charge"."""
    where = f"lies across the outlet of the {_name(rig)}"
    if across.height:
        where = f"is wedged in the {_name(rig)} {1e3 * across.height:.0f} mm above the outlet"
    body = f"one {across.component} ({_grams(across.mass)}) {where}"
    if across.above == 0.0:
        return f"{body}, with nothing above it"
    return f"{body} and holds up {_grams(across.above)}, {_share(across.above, moment)} of the charge"


def _grams(mass: float) -> str:
    return f"{1e3 * mass:.3g} g"


def _share(mass: float, moment: Moment) -> str:
    percent = 100.0 * mass / moment.poured_mass
    return f"{percent:.0f} %" if percent >= 1.0 else f"{percent:.1g} %"
