"""Messages between the page's process and the solver process, apart from frames.

Commands go in, statuses and events come out. All are frozen and hold only numbers, texts and the scene.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from solver.observables.observable import Value
from solver.observables.repose import Outline
from solver.pours.disturbance import PlateMotion, Pull
from solver.pours.record import Outcome, Phase
from solver.scenes.scene import Scene


class SessionState(StrEnum):
    """What the solver process is doing."""

    STARTING = "starting"
    RUNNING = "running"
    PAUSED = "paused"
    ENDED = "ended"
    """The pour reached an outcome; a change of a live parameter can wake a pile at rest."""
    FAILED = "failed"
    """The solver raised an error and stopped."""
    DIED = "died"
    """The process ended without a message (killed, out of memory)."""
    CLOSED = "closed"


@dataclass(frozen=True)
class Start:
    """Drop the present pour and pour ``scene`` with ``seed``; ``generation`` numbers the pours of a session."""

    scene: Scene
    seed: int
    generation: int


@dataclass(frozen=True)
class Play:
    """Let time run."""


@dataclass(frozen=True)
class Pause:
    """Stop time; parameters can still be changed."""


@dataclass(frozen=True)
class Step:
    """Pause after ``duration`` [s] of simulated time."""

    duration: float


@dataclass(frozen=True)
class RunTo:
    """Pause at the first step that reaches simulated ``time`` [s]."""

    time: float


@dataclass(frozen=True)
class StepBack:
    """Go back by ``duration`` [s] of simulated time, or to the earliest moment that is kept, and pause there."""

    duration: float


@dataclass(frozen=True)
class BackTo:
    """Go back to ``time`` [s], or to the earliest moment that is kept, and pause there; a later moment is ignored."""

    time: float


@dataclass(frozen=True)
class SetParameters:
    """New values (SI, or text with a unit) of live parameters by path, applied together."""

    values: Mapping[str, float | str]


@dataclass(frozen=True)
class MovePlate:
    """Tap or shake the plate; it ends where it began."""

    motion: PlateMotion


@dataclass(frozen=True)
class SetPull:
    """Pull one body from now on, or none."""

    pull: Pull | None


@dataclass(frozen=True)
class SetSpeed:
    """Wanted ratio of simulated to wall time; the solver runs as fast as it can up to that."""

    factor: float


@dataclass(frozen=True)
class Watch:
    """Whether velocities, loads and contacts are shown: otherwise they are not read."""

    wanted: bool
    body: int | None = None
    """A body, by its order of entry, whose contacts are all wanted."""


@dataclass(frozen=True)
class Close:
    """End the process."""


Command = (
    Start
    | Play
    | Pause
    | Step
    | RunTo
    | StepBack
    | BackTo
    | SetParameters
    | MovePlate
    | SetPull
    | SetSpeed
    | Watch
    | Close
)


@dataclass(frozen=True)
class Status:
    """State of the live pour, as known to the solver process. SI units."""

    state: SessionState
    message: str
    scene: Scene
    """The scene in force: with every parameter that was changed since the start."""
    seed: int
    generation: int
    speed: float
    """Wanted ratio of simulated to wall time."""
    real_time_factor: float = 0.0
    """Measured ratio of simulated to wall time over the last second; 0 while time is stopped."""
    capped: bool = False
    """The solver cannot keep the wanted speed."""
    phase: Phase = Phase.FILL
    outcome: Outcome = Outcome.RUNNING
    time: float = 0.0
    dt: float = 0.0
    """Time step [s]."""
    dt_limit: float = math.nan
    """Time step above which the motion is unstable [s] (``solver.scenes.time_step.stability_limit``)."""
    earliest: float = math.nan
    """Earliest simulated time [s] to which the pour can be brought back."""
    bodies: int = 0
    """Bodies that have entered."""
    bodies_planned: int = 0
    entered_mass: float = 0.0
    """Mass of the bodies that have entered [kg]."""
    discharged_mass: float = 0.0
    """Mass below the outlet [kg]."""
    poured_mass: float = 0.0
    """Mass that is to be poured [kg]."""
    kinetic_energy: float = 0.0
    """Of translation and rotation, over all bodies [J]."""
    contacts: int = 0
    """Pairs of spheres, and of sphere and wall, that touch."""
    gate_shut: bool = False
    energy_put_in: float | None = None
    """Elastic energy that the last change of parameters put into the contacts [J]; None before the first change."""
    disturbance: str = ""
    """What is being done to the pile, in words: the plate is shaken, a body is pulled; empty if nothing."""
    disturbed: bool = False
    """Whether such a thing was done since the pour began."""
    observables: Mapping[str, Value] = field(default_factory=dict)
    """Angles of the pile as it is now, renewed about every 0.1 s of simulated time; empty until there is a pile."""
    outline: Outline | None = None
    """Silhouette of the first view, with the lines that give the left and right angles; read together with them."""


@dataclass(frozen=True)
class Event:
    """Something that happened at simulated ``time`` [s] of pour ``generation``: a parameter changed, a pour ended."""

    generation: int
    time: float
    text: str
    is_change: bool = False
    """Whether a parameter was changed; ``text`` is then ``path: old → new``."""
    is_order: bool = False
    """Whether the user asked for something else: another pour, a study."""


@dataclass(frozen=True)
class Failure:
    """The last message of a solver process that met an error."""

    message: str


Report = Status | Event | Failure
