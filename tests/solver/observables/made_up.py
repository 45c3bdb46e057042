"""Made-up piles and records for the tests of observables; cones come from the package itself."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from solver.observables.made_up import SEED_AXES, cone, pile_of, seed_spheres, seeds_in_cone, solid_of
from solver.pours.record import Bodies, Outcome, Pile, Record, Spheres, Trace
from solver.pours.record_builder import entries_of
from solver.scenes.body import Body, Members
from solver.scenes.material import Material
from solver.scenes.scene import Scene

__all__ = [
    "SEED_AXES",
    "balls",
    "cone",
    "joined",
    "moved",
    "oblique_cone",
    "pile_of",
    "record_of",
    "seed_spheres",
    "seeds_in_cone",
    "solid_of",
    "truncated_cone",
]

Array = npt.NDArray[np.float64]


def balls(centre: Array, radius: float = 3e-3, component: list[int] | None = None) -> Pile:
    """Pile of single spheres of one ``radius`` [m] at ``centre`` [m], shape (n, 3)."""
    n = len(centre)
    return pile_of(np.asarray(centre, dtype=np.float64), np.full(n, radius), np.arange(n, dtype=np.int32), component)


def oblique_cone(base_radius: float, height: float, apex_x: float) -> Pile:
    """Cone over a disc about the origin with its apex above (``apex_x``, 0) [m]."""

    def height_at(x: Array, y: Array) -> Array:
        # The disc at level t (0 at the apex, 1 at the base) has radius t R and centre (1 - t) apex_x:
        # (x - apex_x + t apex_x)² + y² = t² R², solved for t.
        a = base_radius**2 - apex_x**2
        b = apex_x * (x - apex_x)
        level: Array = (b + np.sqrt(b**2 + a * ((x - apex_x) ** 2 + y**2))) / a
        return height * (1.0 - level)

    return solid_of(height_at, base_radius)


def truncated_cone(angle_deg: float, top_radius: float, height: float) -> Pile:
    """Right cone cut off by a horizontal plane at ``height`` [m], where its radius is ``top_radius`` [m]."""
    slope = np.tan(np.radians(angle_deg))
    return solid_of(
        lambda x, y: np.minimum(height, height - slope * (np.hypot(x, y) - top_radius)),
        top_radius + height / slope,
    )


def joined(*piles: Pile) -> Pile:
    """All bodies of several piles."""
    offsets = np.cumsum([0, *(len(pile.mass) for pile in piles[:-1])])
    spheres = Spheres(
        np.concatenate([pile.spheres.centre for pile in piles]),
        np.concatenate([pile.spheres.radius for pile in piles]),
        np.concatenate([pile.spheres.body + offset for pile, offset in zip(piles, offsets, strict=True)]),
    )
    return Pile(
        spheres,
        np.concatenate([pile.position for pile in piles]),
        np.concatenate([pile.mass for pile in piles]),
        np.concatenate([pile.component for pile in piles]),
        piles[0].component_names,
    )


def moved(pile: Pile, rotation_deg: float = 0.0, scale: float = 1.0, shift: tuple[float, float] = (0.0, 0.0)) -> Pile:
    """``pile`` turned about z, scaled about the origin, then shifted by (x, y) [m]."""
    c, s = np.cos(np.radians(rotation_deg)), np.sin(np.radians(rotation_deg))
    turn = scale * np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    offset = np.array([*shift, 0.0])
    spheres = Spheres(pile.spheres.centre @ turn.T + offset, scale * pile.spheres.radius, pile.spheres.body)
    return Pile(spheres, pile.position @ turn.T + offset, pile.mass, pile.component, pile.component_names)


def record_of(
    pile: Pile,
    time: Array,
    discharged_mass: Array,
    poured_mass: float,
    gate_opened: float = 0.0,
    inside: npt.NDArray[np.bool_] | None = None,
) -> Record:
    """Record of a pour that left ``pile``; all has entered. Bodies of the scene: a, b, c of 500 kg/m³."""
    n = len(pile.mass)
    zero = np.zeros_like(time)
    shape = Members(((0.0, 0.0, 0.0),), (3e-3,), 1e-4, (1e-9, 1e-9, 1e-9))
    scene = Scene("made up", (Material("m"),), tuple(Body(name, "m", 1 / 3, shape, 500.0) for name in "abc"), ())
    bodies = Bodies(
        component=pile.component,
        component_names=pile.component_names,
        mass=pile.mass,
        scale=np.ones(n),
        position=pile.position,
        quaternion=np.tile([1.0, 0.0, 0.0, 0.0], (n, 1)),
        velocity=np.zeros((n, 3)),
        inside=np.ones(n, dtype=bool) if inside is None else inside,
    )
    contacts = np.zeros(time.size, dtype=np.int32)
    trace = Trace(time, np.full_like(time, poured_mass), discharged_mass, zero, contacts, *[zero] * 7)
    return Record(
        scene,
        0,
        Outcome.AT_REST,
        "",
        (Outcome.AT_REST, ""),
        bodies,
        pile.spheres,
        np.ones(n, dtype=bool),
        pile,
        trace,
        entries_of(pile.component, []),
        gate_opened,
        poured_mass,
        1e-6,
        1,
        0.0,
    )


def empty_pile() -> Pile:
    """A pile without bodies."""
    spheres = Spheres(np.zeros((0, 3)), np.zeros(0), np.zeros(0, dtype=np.int32))
    return Pile(spheres, np.zeros((0, 3)), np.zeros(0), np.zeros(0, dtype=np.int32), ("a", "b"))
