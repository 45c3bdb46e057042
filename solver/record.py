"""What a run leaves behind: outcome, curves and the final state. NumPy only; nothing here can be changed."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import numpy.typing as npt

from solver.scene import Scene

Array = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int32]


class Outcome(StrEnum):
    """How a run ended. Only ``AT_REST`` gives a valid pile."""

    RUNNING = "running"
    AT_REST = "at_rest"
    JAMMED = "jammed"
    TIME_LIMIT = "time_limit"
    LOST_BODY = "lost_body"
    NON_FINITE = "non_finite"
    OVERLAP_LIMIT = "overlap_limit"
    BUFFER_OVERFLOW = "buffer_overflow"


class Phase(StrEnum):
    """Where a pour is."""

    FILL = "fill"
    DISCHARGE = "discharge"
    PILE = "pile"
    AT_REST = "at rest"


@dataclass(frozen=True)
class Bodies:
    """State of all bodies that have entered, in order of entry (n of them)."""

    component: Ints
    """Index into ``component_names``, shape (n,)."""
    component_names: tuple[str, ...]
    mass: Array
    """[kg], shape (n,)."""
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
    """Bodies that lie on the plate (centres below the outlet), the only input of the pile's observables.

    Single bodies that still roll outward, beyond the feed opening's radius, are strays and not among them.

    ``axis`` is the funnel's axis (x, y) [m]; the plate is z = 0.
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
    """Mass below the outlet [kg], bodies taken out of the domain included."""
    kinetic_energy: Array
    """Translation and rotation [J]."""
    contacts: Ints
    """Number of touching pairs of member spheres or sphere and surface."""
    max_overlap: Array
    """Largest overlap since the last sample, as a fraction of the member sphere's radius."""


@dataclass(frozen=True)
class Entries:
    """How the bodies of a run entered, in order of entry (n of them): what another program needs to repeat the feed.

    A body is at its place when ``step`` steps are done and takes part from the next one on; it does not turn.
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
    message: str
    bodies: Bodies
    spheres: Spheres
    pile: Pile
    trace: Trace
    entries: Entries
    gate_opened: float
    """Time [s] at which the gate opened; 0 for ``pour_through``."""
    poured_mass: float
    """Mass that was to be poured, from the integer counts of bodies [kg]."""
    dt: float
    """Time step [s]."""
    steps: int
    wall_s: float
