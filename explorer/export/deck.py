"""A deck: everything that another engine needs to repeat a pour of ours, in SI and in engine-neutral terms.

It holds materials, bodies, and walls as triangles; a scene with anything that a deck cannot hold is refused. Every
exported folder has the deck as ``deck.json``; LIGGGHTS's input and STL files are written from it, YADE's script reads
it.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from explorer.errors import CommandError
from explorer.export.target import ExportOrder, ExportTarget
from explorer.outcomes import outcome_text
from solver import Body, Entries, Record, Scene
from solver.effects.rolling_resistance import RollingResistance
from solver.laws import HertzMindlin, LinearSpringDashpot
from solver.rigs import Funnel, MeshFunnel, Plane, Revolved, Rig, TriangleMesh
from solver.scenes.insertion import rotation_matrix
from solver.scenes.scene import actual, pour_rig

Array = npt.NDArray[np.float64]

FILE = "deck.json"
SIDES = 96
"""Corners of the polygon that represents a circle of a revolved wall."""
BANDS = 3
"""Rings of triangles along the profile of a revolved wall: more rings make the triangles less slender."""
HOLDS = (RollingResistance.name,)
"""Effects of contacts that a deck can express; an engine may support fewer."""
LAWS = (HertzMindlin.name, LinearSpringDashpot.name)
"""Contact laws that a deck can express; an engine may support fewer."""


@dataclass(frozen=True)
class DeckClump:
    """One component: member spheres in the principal frame about the centre of mass, mass, inertia and material."""

    name: str
    centres: Array
    """[m], shape (m, 3)."""
    radii: Array
    """[m], shape (m,)."""
    mass: float
    """[kg]."""
    inertia: Array
    """Principal moments about x, y, z [kg m²], shape (3,)."""
    density: float
    """Density of the material [kg/m³]; the mass does not follow from it."""
    youngs_modulus: float
    poisson_ratio: float


@dataclass(frozen=True)
class DeckMesh:
    """A thin wall of triangles, which pushes from either side."""

    name: str
    triangles: Array
    """Corners [m], shape (t, 3, 3)."""
    until_step: int = -1
    """The wall is removed after this many steps; −1: never."""
    of_file: bool = False
    """Whether the triangles come from a mesh file, and not from a polygon with ``SIDES`` corners."""


@dataclass(frozen=True)
class Deck:
    """A pour. The wall's contact class is the last one, after the components."""

    title: str
    seed: int
    dt: float
    """[s]."""
    steps: int
    gravity: tuple[float, float, float]
    """[m/s²]."""
    clumps: tuple[DeckClump, ...]
    wall_youngs_modulus: float
    wall_poisson_ratio: float
    friction: Array
    """μ, shape (classes, classes)."""
    restitution: Array
    """e of a single contact, shape (classes, classes)."""
    rolling_friction: float
    """μ_r of all contacts: a torque spring k_t R*² with its cap at μ_r R* F_n; 0: nothing resists rolling."""
    law: str
    """Name of the law here (``solver.laws``)."""
    characteristic_velocity: float
    """Characteristic velocity of linear springs [m/s]; Hertz–Mindlin does not use it."""
    tangential_law: str
    tangential_dashpot: str
    """Conventions of our own pour (``solver.scenes.material``); another engine has its own."""
    entries: Entries
    plate: float | None
    """Height of the infinite plate [m]; None: there is none."""
    meshes: tuple[DeckMesh, ...]
    box: Array
    """Corners (low, high) of the space in which bodies are expected [m], shape (2, 3)."""

    @property
    def bodies(self) -> int:
        """Number of bodies that enter."""
        return len(self.entries.step)

    def members(self, body: int) -> Array:
        """Centres of the member spheres of a body in its principal frame [m], shape (m, 3)."""
        return self.clumps[int(self.entries.component[body])].centres


class DeckTarget(ExportTarget):
    """An engine that repeats a pour of ours from a deck."""

    goes_on = True
    holds: tuple[str, ...] = ()
    """Effects of contacts and flight that the engine's law supports."""
    laws: tuple[str, ...] = (HertzMindlin.name,)
    """Contact laws that the engine has."""

    def check(self, scene: Scene) -> None:
        """Raise :class:`CommandError` for anything that the engine's deck cannot hold."""
        check_exportable(scene, self.name, self.holds, self.laws)

    def write(self, folder: Path, order: ExportOrder) -> str:
        """Run the pour, and write its deck."""
        # Imported here because it loads Taichi, which merely naming a target does not need.
        from solver import Outcome, body_counts, run_pour

        record = run_pour(order.scene, order.seed)
        deck = deck_of(record, order.time)
        self.write_deck(folder, deck)
        missing, why = sum(body_counts(record.scene)) - deck.bodies, "the time was up; state a longer --time"
        if record.outcome != Outcome.TIME_LIMIT:
            why = f"the pour here ended ({record.outcome.replace('_', ' ')})"
        cut = f" ({missing} more had not entered when {why})" if missing else ""
        broke = f"; the pour here broke off: {outcome_text(record.outcome, record.message)}"
        broke = broke if record.outcome.unstable else ""
        return f"{deck.bodies} bodies{cut}, {deck.steps} steps of {deck.dt:.4g} s; how to run it: README.txt{broke}"

    def write_deck(self, folder: Path, deck: Deck) -> None:
        """Write a deck into an existing folder."""
        raise NotImplementedError


def deck_of(record: Record, time: float | None = None) -> Deck:
    """The deck that repeats ``record``: the same bodies at the same moments and places, for the same number of steps.

    Args:
        record: a pour of ours; it says how bodies enter, and when its gate opens.
        time: simulated time [s] to use instead of the record's; bodies that enter later are left out.

    Raises:
        CommandError: the scene has something that no exported deck can hold.
    """
    scene = record.scene
    check_exportable(scene)
    steps = record.steps if time is None else math.ceil(time / record.dt)
    return assembled(
        scene,
        record.seed,
        record.dt,
        steps,
        _until(record.entries, steps),
        plate=_plate(scene.rig),
        meshes=_meshes(scene, record),
    )


def check_exportable(
    scene: Scene, engine: str = "any engine", holds: Collection[str] = HOLDS, laws: Collection[str] = LAWS
) -> None:
    """Raise :class:`CommandError` if ``scene`` has something that a deck for ``engine`` cannot hold.

    A deck already includes the effects of material and set-up. ``holds`` are the effects of contacts and flight that
    have an equivalent there, and ``laws`` the contact laws.
    """
    scene = actual(scene)
    for effect in scene.effects:
        if effect.on and effect.name not in holds:
            amplitude = f"effect.{effect.name}.{effect.amplitudes[0]}"
            raise CommandError(f"{amplitude}: {effect.numbers[0]:g} cannot be exported to {engine}; allowed: 0")
    if scene.contact.law not in laws:
        allowed = ", ".join(laws)
        raise CommandError(f"contact.law: {scene.contact.law!r} cannot be exported to {engine}; allowed: {allowed}")
    if scene.contact.clump_rule != "body_mass":
        # None of these engines damps by the mass that acts at a contact.
        raise CommandError(
            f"contact.clump_rule: {scene.contact.clump_rule!r} cannot be exported to {engine}; allowed: body_mass"
        )
    damping = rolling(scene).rolling_damping
    if rolling(scene).on and damping > 0.0:
        raise CommandError(f"effect.rolling_resistance.rolling_damping: {damping:g} cannot be exported; allowed: 0")
    if not isinstance(scene.rig, Funnel | MeshFunnel):
        allowed = f"{Funnel.name}, {MeshFunnel.name}"
        raise CommandError(f"rig {getattr(scene.rig, 'name', '?')!r} cannot be exported; allowed: {allowed}")
    for body in scene.bodies:
        if body.sizes.varies:
            raise CommandError(
                f"body.{body.name}.size_distribution: {body.sizes.kind!r} cannot be exported, a deck has one clump per "
                "component; allowed: none"
            )


def rolling(scene: Scene) -> RollingResistance:
    """The scene's rolling resistance, which may be off."""
    return cast(RollingResistance, scene.effect(RollingResistance.name))


def assembled(
    scene: Scene,
    seed: int,
    dt: float,
    steps: int,
    entries: Entries,
    plate: float | None = None,
    meshes: tuple[DeckMesh, ...] = (),
) -> Deck:
    """A deck with the materials and bodies of ``scene``, which enter according to ``entries``, and the given walls."""
    friction, restitution = pair_tables(scene)
    wall = scene.material(scene.rig.wall)
    return Deck(
        title=scene.title,
        seed=seed,
        dt=dt,
        steps=steps,
        gravity=scene.gravity,
        clumps=_clumps(scene),
        wall_youngs_modulus=wall.youngs_modulus,
        wall_poisson_ratio=wall.poisson_ratio,
        friction=friction,
        restitution=restitution,
        rolling_friction=rolling(scene).rolling_friction,
        law=scene.contact.law,
        characteristic_velocity=scene.contact.characteristic_velocity,
        tangential_law=scene.contact.tangential_law,
        tangential_dashpot=scene.contact.tangential_dashpot,
        entries=entries,
        plate=plate,
        meshes=meshes,
        box=_box(scene),
    )


def _clumps(scene: Scene) -> tuple[DeckClump, ...]:
    clumps = []
    for body in scene.bodies:
        clump, material = body.clump, scene.material(body.material)
        clumps.append(
            DeckClump(
                name=body.name,
                centres=np.array(clump.centres),
                radii=np.array(clump.radii),
                mass=float(clump.mass),
                inertia=np.array(clump.inertia),
                density=material.density,
                youngs_modulus=material.youngs_modulus,
                poisson_ratio=material.poisson_ratio,
            )
        )
    return tuple(clumps)


def pair_tables(scene: Scene) -> tuple[Array, Array]:
    """Friction and restitution of all classes; wall against wall never occurs and gets values of the first body."""
    n, wall = len(scene.bodies), scene.rig.wall
    others: tuple[Body | str, ...] = (*scene.bodies, wall)
    pairs = [[scene.contact_pair(one, other) for other in others] for one in scene.bodies]
    friction, restitution = np.zeros((n + 1, n + 1)), np.zeros((n + 1, n + 1))
    for table, key in ((friction, "static_friction"), (restitution, "restitution")):
        for a in range(n):
            for b in range(n + 1):
                table[a, b] = table[b, a] = getattr(pairs[a][b], key)
        table[n, n] = table[0, n]
    return friction, restitution


def _until(entries: Entries, steps: int) -> Entries:
    kept = entries.step < steps
    return Entries(**{field.name: getattr(entries, field.name)[kept] for field in dataclasses.fields(Entries)})


def _plate(rig: Rig) -> float:
    return next(surface.pose.origin[2] for surface in rig.surfaces() if isinstance(surface, Plane))


def _meshes(scene: Scene, record: Record) -> tuple[DeckMesh, ...]:
    gated = scene.insertion.protocol == "fill_then_open"
    opening = round(record.gate_opened / record.dt) if record.gate_opened > 0.0 else -1
    meshes = []
    for name, surface in zip(scene.rig.surface_names, scene.rig.surfaces(), strict=True):
        if isinstance(surface, Plane) or (name == "gate" and not gated):
            continue
        triangles = revolved_triangles(surface) if isinstance(surface, Revolved) else mesh_triangles(surface)
        meshes.append(DeckMesh(name, triangles, opening if name == "gate" else -1, isinstance(surface, TriangleMesh)))
    return tuple(meshes)


def _box(scene: Scene) -> Array:
    half, longest = scene.rig.domain_half_width, max(max(body.extents) for body in scene.bodies)
    top = pour_rig(scene).feed().floor + scene.insertion.region_height + longest
    return np.array([[-half, -half, -0.01], [half, half, top]])


def revolved_triangles(surface: Revolved) -> Array:
    """Corners (t, 3, 3) [m] of a polygonal cone, or of one triangle around a disc.

    The polygons have the area of the circles that they represent: flats are 1.8e-4 radii inside, corners 3.6e-4
    outside. A disc (a gate) becomes the triangle that encloses it: every edge within a flat surface is one more place
    at which engines may push twice.
    """
    if surface.z0 == surface.z1 and min(surface.r0, surface.r1) == 0.0:
        return _around(max(surface.r0, surface.r1), surface.z0)
    angle = np.linspace(0.0, 2.0 * np.pi, SIDES, endpoint=False)
    circle = math.sqrt(2.0 * np.pi / SIDES / math.sin(2.0 * np.pi / SIDES))
    corners = circle * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    share = np.linspace(0.0, 1.0, BANDS + 1)
    radii, heights = surface.r0 + share * (surface.r1 - surface.r0), surface.z0 + share * (surface.z1 - surface.z0)
    rings = np.stack([np.column_stack([r * corners, np.full(SIDES, z)]) for r, z in zip(radii, heights, strict=True)])
    low, high = rings[:-1], rings[1:]
    low_next, high_next = np.roll(low, -1, axis=1), np.roll(high, -1, axis=1)
    quads = [np.stack([low, low_next, high_next], axis=2), np.stack([low, high_next, high], axis=2)]
    return np.concatenate([quad.reshape(-1, 3, 3) for quad in quads])


def _around(radius: float, height: float) -> Array:
    """The equilateral triangle whose inscribed circle has ``radius``."""
    angle = np.radians([90.0, 210.0, 330.0])
    corners = 2.0 * radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.column_stack([corners, np.full(3, height)])[None]


def mesh_triangles(surface: TriangleMesh) -> Array:
    """Corners (t, 3, 3) [m] of a mesh at its place in the rig."""
    turn = rotation_matrix(np.array(surface.pose.quaternion))
    corners = np.array(surface.vertices) @ turn.T + np.array(surface.pose.origin)
    return np.asarray(corners[np.array(surface.faces)])


def write_deck(folder: Path, deck: Deck) -> None:
    """Write ``deck.json`` into ``folder``."""
    text = json.dumps(dataclasses.asdict(deck), indent=1, default=lambda array: array.tolist(), allow_nan=False)
    (folder / FILE).write_text(text + "\n", encoding="utf-8")


def read_deck(folder: Path) -> Deck:
    """The deck in ``folder``; OSError if there is none."""
    table: dict[str, Any] = json.loads((folder / FILE).read_text(encoding="utf-8"))
    table["clumps"] = tuple(DeckClump(**_arrays(entry, "centres", "radii", "inertia")) for entry in table["clumps"])
    table["meshes"] = tuple(DeckMesh(**_arrays(entry, "triangles")) for entry in table["meshes"])
    entries = table["entries"]
    whole = {key: np.array(entries[key], dtype=np.int32) for key in ("step", "component")}
    table["entries"] = Entries(**(_arrays(entries, "time", "position", "quaternion", "velocity") | whole))
    table["gravity"] = tuple(table["gravity"])
    return Deck(**_arrays(table, "friction", "restitution", "box"))


def _arrays(table: dict[str, Any], *keys: str) -> dict[str, Any]:
    return table | {key: np.array(table[key], dtype=float) for key in keys}


def write_stl(path: Path, name: str, triangles: Array) -> None:
    """Write triangles (t, 3, 3) [m] as an STL file in text form."""
    lines = [f"solid {name}"]
    for corners in triangles:
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        normal = normal / np.linalg.norm(normal)
        lines += [f"facet normal {_row(normal)}", "  outer loop"]
        lines += [f"    vertex {_row(corner)}" for corner in corners]
        lines += ["  endloop", "endfacet"]
    lines.append(f"endsolid {name}")
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


def _row(values: Array) -> str:
    return " ".join(f"{value:.12g}" for value in values)
