"""Interface of an effect: a name, parameters, an amplitude, and the limit in which it vanishes.

An effect is one frozen dataclass in one file. Its fields are ordinary parameters (``effect.<name>.<field>`` in files,
``--set``, sliders and study factors). It is off while all fields named in ``amplitudes`` are zero. There are three
kinds:

    ContactEffect   a ``ti.func`` on one contact: changes the normal force or Coulomb limit, or adds a pull or torque
    BodyEffect      a ``ti.func`` on one body: a force from its surroundings
    SetUpEffect     a function scene → scene: material or set-up differ from what was declared

Contact effects act in stages, in the order of :class:`Stage`; a pull changes the Coulomb limit that later stages read.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from enum import IntEnum, StrEnum
from typing import Any, ClassVar


class Stage(IntEnum):
    """When a contact effect acts."""

    NORMAL = 0
    """Changes the elastic force or the damper of the normal direction."""
    ADHESION = 1
    """Adds a pull, which may last after the surfaces have separated."""
    TANGENTIAL = 2
    """Changes the Coulomb limit."""
    ROLLING = 3
    """Adds a torque against rolling."""
    TWISTING = 4
    """Adds a torque against rotation about the normal."""


class Telltale(StrEnum):
    """A class of observables that can reveal an effect."""

    SHAPE = "shape"
    """Of the pile or the free surface: angles, slopes, heights, footprint."""
    FLOW = "flow"
    """Discharge over time, bodies that strayed, the surface of a moving bed."""
    ASYMMETRY = "asymmetry"
    """One side against the other: left and right angle, centroid."""
    PACKING = "packing"
    """How much volume a mass takes: solid fraction, bulk density, heights, discharge."""


@dataclass(frozen=True)
class Effect:
    """Base of all effects; the class attributes contain what reports and the diagnosis need."""

    name: ClassVar[str]
    amplitudes: ClassVar[tuple[str, ...]]
    """Fields that are zero while the effect is off: one, or two for a direction in the plane of the plate."""
    strongest: ClassVar[float]
    """Largest amplitude that the literature supports, the upper end of the prior [unit of the amplitude]."""
    literature: ClassVar[str]
    """Where that bound comes from."""
    lever: ClassVar[str]
    """The experiment that reveals it."""
    telltales: ClassVar[tuple[Telltale, ...]]
    """Classes of observables that can reveal it; it stays hidden in data that contain none of them."""
    revision: ClassVar[int] = 1
    """Raise it, instead of ``solver.version.PHYSICS``, with a change to the bits of pours in which it acts and of no
    others: it is part of the key of such a pour."""
    on_bench: ClassVar[bool] = False
    """Whether it stays with the bench when the rig is turned by 180° on it; its amplitudes then change sign."""

    @property
    def on(self) -> bool:
        """False if every amplitude is zero."""
        return any(getattr(self, amplitude) != 0.0 for amplitude in self.amplitudes)

    @property
    def numbers(self) -> tuple[float, ...]:
        """Values of all parameters in order of declaration."""
        return tuple(float(getattr(self, field.name)) for field in fields(self) if "parameter" in field.metadata)


@dataclass(frozen=True)
class ContactEffect(Effect):
    """Acts on contacts. ``act(p, m, c) -> (c, m)`` with parameters p, memory m of the contact, contact c."""

    stage: ClassVar[Stage]
    act: ClassVar[Callable[..., Any]]
    memory: ClassVar[int] = 0
    """How many numbers it keeps per contact; they are zero when two surfaces meet."""

    def row(self, at_wall: bool) -> tuple[float, ...]:
        """Parameters p of ``act`` for contacts between bodies, or with a wall; all zero if it does not act there."""
        return self.numbers

    def grip(self, e_star: float, reduced_radius: float) -> float:
        """Largest gap [m] across which it holds surfaces; 0 for an effect that needs an overlap."""
        return 0.0

    def restitution(self, declared: float, speed: float) -> float:
        """Restitution of an impact at ``speed`` [m/s] if ``declared`` is the declared one; the time step uses it."""
        return declared

    @property
    def stiffening(self) -> float:
        """Factor by which it raises the contact stiffness; the time step is divided by its square root."""
        return 1.0


@dataclass(frozen=True)
class BodyEffect(Effect):
    """Acts on bodies. ``act(p, b) -> force`` [N] with parameters p and body b."""

    act: ClassVar[Callable[..., Any]]


@dataclass(frozen=True)
class SetUpEffect(Effect):
    """Changes material or set-up before a run begins."""

    def applied(self, scene: Any) -> Any:
        """The scene as it really is, if the declared one is ``scene``."""
        raise NotImplementedError
