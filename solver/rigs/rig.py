"""What the rest of the program expects of a rig. A new rig is one file with one frozen dataclass and one line in
``RIGS``, or an entry point ``rig.NAME`` in your own package (``solver/plugins.py``).

Bodies are poured into every rig in the same way (``solver/pours/pour.py``): the rig is filled, the fill settles, the
rig acts (a gate opens, a cylinder is lifted, a drum begins to turn), and the run ends, at rest or after a given time.
All of this is decided at the moments at which a pour is sampled, so that a seed repeats a run bit for bit.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Protocol

from solver.rigs.feed import Feed
from solver.rigs.outlet import Outlet
from solver.rigs.surface import Surface

NOTHING: Mapping[str, float | str] = MappingProxyType({})

OUTLET_HEIGHTS: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {
        "outlet at 0.6 times the height": {"rig.outlet_height": 0.6},
        "outlet at 1.5 times the height": {"rig.outlet_height": 1.5},
        "outlet at twice the height": {"rig.outlet_height": 2.0},
    }
)
"""Changes (``PourRig.quick_changes``) of a rig that hangs above its plate."""

PILE = "pile"
"""Group of the observables of a free pile on the plate, whatever made it."""
DISCHARGE = "discharge"
"""Group of the observables of the flow out of a container."""
FREE_SURFACE = "free_surface"
"""Group of the observables of the surface of a bed in motion."""
DRAW_DOWN = "draw_down"
"""Group of the observables of the material that remains above a slot."""


@dataclass(frozen=True)
class Container:
    """The part of the world that is inside the rig: above ``height`` [m] and within ``radius`` [m] of the z axis."""

    height: float
    radius: float


EVERYWHERE = Container(-math.inf, math.inf)
"""Container of a rig that has no outside."""
NOWHERE = Container(math.inf, 0.0)
"""Container of a rig that has no inside."""


@dataclass(frozen=True)
class Switch:
    """Switch surface number ``surface`` on or off, ``after`` [s] after the rig begins to act."""

    after: float
    surface: int
    active: bool


@dataclass(frozen=True)
class Move:
    """Move surface number ``surface`` from ``after`` [s] on: its origin at ``velocity`` [m/s], the surface about its
    origin at ``angular_velocity`` [rad/s], both in world coordinates."""

    after: float
    surface: int
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    angular_velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)


Action = Switch | Move


@dataclass(frozen=True)
class Watch:
    """Record the free surface at each sample from ``after`` [s] on: |x| up to ``half_width``, y from ``height`` [m]."""

    after: float
    half_width: float
    height: float


class Rig(Protocol):
    """Surfaces with a name and parameters. All of a scene's surfaces are of one material, ``wall``."""

    @property
    def name(self) -> str:
        """Name used in files and on the command line."""
        ...

    @property
    def wall(self) -> str:
        """Name of the material of its surfaces."""
        ...

    @property
    def domain_half_width(self) -> float:
        """Bodies with |x| or |y| beyond this are removed [m]."""
        ...

    @property
    def surface_names(self) -> tuple[str, ...]:
        """Names of ``surfaces()``, in order. A surface called ``gate`` is there only until the rig acts."""
        ...

    @property
    def suits(self) -> Mapping[str, float | str]:
        """Parameter path → value: settings of insertion and numerics that a scene gets along with the rig."""
        return NOTHING

    def surfaces(self) -> tuple[Surface, ...]:
        """Plate, walls and gates, where they are before the rig acts."""
        ...

    def container(self, since: float) -> Container:
        """Inside of the rig, ``since`` [s] after it began to act (0 while it is filled)."""
        ...

    def check(self, widest_body: float) -> None:
        """Raise ParameterError if dimensions do not fit together.

        ``widest_body`` [m] is the smallest width that all of the bodies can pass: their middle extent, since a body may
        turn and only its two smaller extents have to go through.
        """
        ...


class BareRig(Rig, Protocol):
    """Surfaces and nothing else: single bodies are put there by hand."""

    @property
    def name(self) -> str:
        """Not a name that can be requested."""
        return "bare"

    @property
    def surface_names(self) -> tuple[str, ...]:
        """The surfaces' numbers."""
        return tuple(str(k) for k in range(len(self.surfaces())))

    def container(self, since: float) -> Container:
        """Nowhere: no body is fed, none flows out."""
        return NOWHERE

    def check(self, widest_body: float) -> None:
        """Every body fits."""
        return


class BenchRig(BareRig, Protocol):
    """A rig that measures one property on a single body (``solver/single_body``)."""

    @property
    def body(self) -> str:
        """Name of the component that is measured; empty: the first one."""
        ...


class PourRig(Rig, Protocol):
    """A rig that bodies are poured into."""

    @property
    def gives(self) -> tuple[str, ...]:
        """What is read from a run by default: groups of observables, and names of single observables."""
        ...

    @property
    def protocols(self) -> tuple[str, ...]:
        """Values of ``insertion.protocol`` that make sense."""
        return ("fill_then_open",)

    @property
    def refills(self) -> bool:
        """Whether bodies that did not fit in keep entering while the rig acts. Otherwise an overfull rig is a jam."""
        return False

    @property
    def leaves_heap(self) -> bool:
        """Whether a heap's angle of repose is wanted: a flat layer is then no result (``Outcome.NO_HEAP``)."""
        return PILE in self.gives

    @property
    def quarter_turns(self) -> bool:
        """Whether a quarter turn about the z axis leaves the rig, its feed and its domain as they are."""
        return False

    @property
    def keeps_material(self) -> bool:
        """Whether material left in the container at rest belongs to the result. Otherwise it is a jam."""
        return False

    @property
    def outlet(self) -> Outlet | None:
        """The opening at the container's lower end that everything leaves through; None: there is none."""
        return None

    @property
    def running_time(self) -> float | None:
        """The run ends this long [s] after the rig began to act; None: when everything is at rest."""
        return None

    @property
    def watch(self) -> Watch | None:
        """When and where the free surface is kept; None: never."""
        return None

    @property
    def quick_changes(self) -> Mapping[str, Mapping[str, float]]:
        """Changes that a laboratory can make to it within minutes: name → parameter path → factor.

        A diagnosis that cannot tell two answers apart looks among these for an experiment that can.
        """
        return {}

    @property
    def forgets(self) -> tuple[str, ...]:
        """Paths of parameters of any rig that do not affect what is read from this one; a diagnosis changes none of
        them to tell answers apart.
        """
        return ()

    def poured_mass(self, density: float) -> float:
        """Mass to be poured [kg] of bodies whose solid has ``density`` [kg/m³]."""
        ...

    def feed(self) -> Feed:
        """The opening that bodies enter through."""
        ...

    def actions(self) -> tuple[Action, ...]:
        """What the rig does once it is filled, in order of time."""
        ...
