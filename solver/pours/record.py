"""What a run leaves behind: outcome, curves and the final state. NumPy only; everything here is immutable."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import numpy.typing as npt

from solver.scenes.scene import Scene

Array = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int32]


class Outcome(StrEnum):
    """How a run ended and what it left.

    Valid are ``AT_REST``, a pile, and ``MEASURED``: a rig that keeps moving has run for its time, or a pour was read
    after ``numerics.duration``. If the angle of repose of the rig's heap is to be read, but what came to rest is not a
    heap, the outcome is ``NO_HEAP`` (``observables/heap.py``).
    """

    RUNNING = "running"
    AT_REST = "at_rest"
    MEASURED = "measured"
    NO_HEAP = "no_heap"
    JAMMED = "jammed"
    OBSTRUCTED = "obstructed"
    TIME_LIMIT = "time_limit"
    LOST_BODY = "lost_body"
    NON_FINITE = "non_finite"
    OVERLAP_LIMIT = "overlap_limit"
    BUFFER_OVERFLOW = "buffer_overflow"

    @property
    def valid(self) -> bool:
        """True if readings of the run count."""
        return self in (Outcome.AT_REST, Outcome.MEASURED)

    @property
    def unstable(self) -> bool:
        """True if the numbers of the run cannot be trusted: it diverged, or lost something that it should hold."""
        return self in (Outcome.NON_FINITE, Outcome.OVERLAP_LIMIT, Outcome.BUFFER_OVERFLOW, Outcome.LOST_BODY)


Verdict = tuple[Outcome, str]
"""Outcome and message; the message is empty where the outcome says everything."""


class Phase(StrEnum):
    """Phase of a pour."""

    FILL = "fill"
    DISCHARGE = "discharge"
    PILE = "pile"
    RUN = "run"
    AT_REST = "at rest"


@dataclass(frozen=True)
class Bodies:
    """State of all bodies that have entered, in order of entry (n of them)."""

    component: Ints
    """Index into ``component_names``, shape (n,)."""
    component_names: tuple[str, ...]
    mass: Array
    """[kg], shape (n,)."""
    scale: Array
    """Linear size relative to the declared one, shape (n,)."""
    position: Array
    """Centres of mass [m], shape (n, 3)."""
    quaternion: Array
    """Orientation of the principal frame, wxyz, shape (n, 4)."""
    velocity: Array
    """[m/s], shape (n, 3)."""
    inside: npt.NDArray[np.bool_]
    """False for bodies that rolled out of the domain and were taken out, shape (n,)."""


@dataclass(frozen=True)
class Spheres:
    """Member spheres of a set of bodies, in world coordinates (m of them)."""

    centre: Array
    """[m], shape (m, 3)."""
    radius: Array
    """[m], shape (m,)."""
    body: Ints
    """Index of the body that a sphere belongs to, shape (m,)."""


@dataclass(frozen=True)
class Pile:
    """Bodies that lie on the plate (centres below the container), the only input of the pile's observables.

    Single bodies that still roll outward, beyond the container's radius, are strays and not among them.

    ``axis`` is the rig's axis (x, y) [m]; the plate is z = 0.
    """

    spheres: Spheres
    position: Array
    """Centres of mass of the bodies [m], shape (n, 3)."""
    mass: Array
    """[kg], shape (n,)."""
    component: Ints
    component_names: tuple[str, ...]
    axis: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Trace:
    """Curves of a run, one row per ``numerics.sample_interval`` (k of them)."""

    time: Array
    """[s] since the first body entered."""
    entered_mass: Array
    """[kg]."""
    discharged_mass: Array
    """Mass outside the container [kg], bodies taken out of the domain included."""
    kinetic_energy: Array
    """Translation and rotation [J]."""
    contacts: Ints
    """Number of pairs of member spheres, or sphere and surface, that touch or that a liquid bridge holds together."""
    max_overlap: Array
    """Largest overlap since the last sample, as a fraction of the member sphere's radius."""
    potential_energy: Array
    """− m g·x of the bodies that are in the world [J]; 0 at the plate."""
    elastic_energy: Array
    """In the normal and tangential springs of the contacts [J]."""
    dissipated_energy: Array
    """Energy dissipated so far in contacts, and by bodies falling asleep [J]."""
    wall_work: Array
    """Work done by moving surfaces on the bodies so far [J]."""
    taken_out_energy: Array
    """Kinetic and potential energy that bodies had when they were taken out of the domain [J]."""
    supplied_energy: Array
    """Kinetic and potential energy of the bodies as they entered, and energy put in by changes of stiffness [J]."""

    @property
    def energy_error(self) -> Array:
        """Error of the energy balance, as a fraction of the energy put in; NaN where none was.

        (kinetic + potential + elastic + dissipated + taken out − supplied − wall work) / (supplied + |wall work|)
        """
        held = self.kinetic_energy + self.potential_energy + self.elastic_energy
        missing = held + self.dissipated_energy + self.taken_out_energy - self.supplied_energy - self.wall_work
        put_in = self.supplied_energy + np.abs(self.wall_work)
        return np.divide(missing, put_in, out=np.full_like(put_in, np.nan), where=put_in > 0.0)


@dataclass(frozen=True)
class FreeSurface:
    """The free surface of a moving bed at k moments, seen along +y: top of the bed over c columns of pixels."""

    time: Array
    """[s], shape (k,)."""
    x: Array
    """Middles of the columns [m], shape (c,)."""
    height: Array
    """Height above the rig's centre [m], shape (k, c); NaN over a column without bed."""


@dataclass(frozen=True)
class Entries:
    """How the bodies of a run entered, in order of entry (n of them): what another program needs to repeat the feed.

    A body is at its place after ``step`` steps and takes part from the next one on; it enters without rotating.
    """

    time: Array
    """[s], shape (n,)."""
    step: Ints
    """Steps done by then, shape (n,)."""
    component: Ints
    """Index into the scene's bodies, shape (n,)."""
    position: Array
    """Centres of mass [m], shape (n, 3)."""
    quaternion: Array
    """Orientation of the principal frame, wxyz, shape (n, 4)."""
    velocity: Array
    """[m/s], shape (n, 3)."""


@dataclass(frozen=True)
class Record:
    """One finished run."""

    scene: Scene
    seed: int
    outcome: Outcome
    """The outcome to report: that of ``ended``, or ``NO_HEAP``."""
    message: str
    ended: Verdict
    """How the motion ended, whatever it left. A raw pour keeps only this; the rest is read from the pile."""
    bodies: Bodies
    spheres: Spheres
    in_pile: npt.NDArray[np.bool_]
    """Which of ``bodies`` belong to ``pile``, shape (n,)."""
    pile: Pile
    trace: Trace
    entries: Entries
    gate_opened: float
    """Time [s] at which the rig began to act (the gate opened); 0 for ``pour_through``."""
    poured_mass: float
    """Mass that was to be poured, from the integer counts of bodies [kg]."""
    dt: float
    """Time step [s]."""
    steps: int
    wall_s: float
    free_surface: FreeSurface | None = None
    """Only of rigs that ask for it (``PourRig.watch``)."""
