"""What crosses the border between the page's process and the solver process, apart from frames.

Commands go in, statuses and events come out. All are frozen and hold no more than numbers, texts and the
scene.
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
    """The process went away without a word (killed, out of memory)."""
    CLOSED = "closed"


@dataclass(frozen=True)
class Start:
    """Drop what there is and pour ``scene`` with ``seed``; ``generation`` numbers the pours of a session."""

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
class SetParameters:
    """New values (SI, or text with a unit) of live parameters by path, taken over together."""

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
    """Wanted ratio of simulated to wall time; the solver goes as fast as it can up to that."""

    factor: float


@dataclass(frozen=True)
class Watch:
    """Whether velocities, loads and contacts are looked at: nothing is read of them otherwise."""

    wanted: bool
    body: int | None = None
    """A body, by its order of entry, all of whose contacts are wanted."""


@dataclass(frozen=True)
class Close:
    """End the process."""


Command = (
    Start | Play | Pause | Step | RunTo | StepBack | SetParameters | MovePlate | SetPull | SetSpeed | Watch | Close
)


@dataclass(frozen=True)
class Status:
    """State of the live pour, as the solver process knows it. SI units."""

    state: SessionState
    message: str
    scene: Scene
    """The scene as it is in force: with every parameter that was changed since the start."""
    seed: int
    generation: int
    speed: float
    """Wanted ratio of simulated to wall time."""
    real_time_factor: float = 0.0
    """Measured ratio of simulated to wall time over the last second; 0 while time stands."""
    capped: bool = False
    """The solver cannot keep the wanted speed."""
    phase: Phase = Phase.FILL
    outcome: Outcome = Outcome.RUNNING
    time: float = 0.0
    dt: float = 0.0
    """Time step [s]."""
    dt_limit: float = math.nan
    """Time step from which on the motion is unstable [s] (``solver.scenes.time_step.stability_limit``)."""
    earliest: float = math.nan
    """Simulated time [s] to which the pour can be brought back."""
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
    """Of translation and rotation, all bodies [J]."""
    contacts: int = 0
    """Pairs of spheres, and of sphere and wall, that touch."""
    gate_shut: bool = False
    energy_put_in: float | None = None
    """Elastic energy that the last change of parameters put into the contacts [J]; None before the first change."""
    disturbance: str = ""
    """What is done to the pile now, in words: the plate is shaken, a body is pulled; empty where nothing is."""
    disturbed: bool = False
    """Something of the kind was done since the pour began."""
    observables: Mapping[str, Value] = field(default_factory=dict)
    """Angles of the pile as it is now, renewed about every 0.1 s of simulated time; empty until there is a pile."""
    outline: Outline | None = None
    """Silhouette of the first view with the lines that the left and the right angle are those of, read with them."""


@dataclass(frozen=True)
class Event:
    """Something that happened at simulated ``time`` [s] of pour ``generation``: a parameter changed, a pour ended."""

    generation: int
    time: float
    text: str
    is_change: bool = False
    """Whether it is a parameter that was changed, ``text`` then being ``path: old → new``."""
    is_order: bool = False
    """Whether somebody asked for something else: another pour, a study."""


@dataclass(frozen=True)
class Failure:
    """The last word of a solver process that met an error."""

    message: str


Report = Status | Event | Failure
