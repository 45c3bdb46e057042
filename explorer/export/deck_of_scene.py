"""From a pour of ours to the deck that repeats it: materials, bodies, walls, and what no deck can hold."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Collection
from pathlib import Path
from typing import cast

import numpy as np

from explorer.errors import CommandError
from explorer.export.deck import Array, Clump, Deck, Mesh
from explorer.export.target import ExportOrder, ExportTarget
from explorer.export.triangles import mesh_triangles, revolved_triangles
from solver import Body, Entries, Record, Scene
from solver.effects.rolling_resistance import RollingResistance
from solver.laws import HertzMindlin, LinearSpringDashpot
from solver.rigs import Funnel, MeshFunnel, Plane, Revolved, Rig
from solver.scenes.scene import actual, pour_rig

HOLDS = (RollingResistance.name,)
"""Effects of contacts that a deck can say; an engine may have the law of fewer."""
LAWS = (HertzMindlin.name, LinearSpringDashpot.name)
"""Contact laws that a deck can say; an engine may have fewer."""


class DeckTarget(ExportTarget):
    """An engine that repeats a pour of ours from a deck."""

    holds: tuple[str, ...] = ()
    """Effects of contacts and flight that its law has as well."""
    laws: tuple[str, ...] = (HertzMindlin.name,)
    """Contact laws that it has."""

    def check(self, scene: Scene) -> None:
        """Raise :class:`CommandError` for what its deck cannot hold."""
        check_exportable(scene, self.name, self.holds, self.laws)

    def write(self, folder: Path, order: ExportOrder) -> str:
        """Pour, and write the deck of it."""
        # Imported here: it loads Taichi, and a target can be named without.
        from solver import run_pour

        deck = deck_of(run_pour(order.scene, order.seed), order.time)
        self.write_deck(folder, deck)
        return f"{deck.bodies} bodies, {deck.steps} steps of {deck.dt:.4g} s; how to run it: README.txt"

    def write_deck(self, folder: Path, deck: Deck) -> None:
        """Write a deck into an existing folder."""
        raise NotImplementedError


def deck_of(record: Record, time: float | None = None) -> Deck:
    """The deck that repeats ``record``: the same bodies at the same moments and places, the same number of steps.

    Args:
        record: a pour of ours; its entries say how bodies enter, and its gate when it opens.
        time: simulated time [s] instead of the record's; bodies that enter later are left out.

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

    Effects of material and set-up are carried out in a deck; of those of contacts and flight ``holds`` are the ones
    that have an equal there, and ``laws`` the contact laws.
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
        # No engine of these damps by the mass that acts at a contact.
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
    meshes: tuple[Mesh, ...] = (),
) -> Deck:
    """A deck with the materials and bodies of ``scene`` that enter as ``entries`` say, and whatever walls are given."""
    friction, restitution = _pair_tables(scene)
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


def _clumps(scene: Scene) -> tuple[Clump, ...]:
    clumps = []
    for body in scene.bodies:
        clump, material = body.clump, scene.material(body.material)
        clumps.append(
            Clump(
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


def _pair_tables(scene: Scene) -> tuple[Array, Array]:
    """Friction and restitution of all classes; wall against wall, which never meet, get those of the first body."""
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


def _meshes(scene: Scene, record: Record) -> tuple[Mesh, ...]:
    gated = scene.insertion.protocol == "fill_then_open"
    opening = round(record.gate_opened / record.dt) if record.gate_opened > 0.0 else -1
    meshes = []
    for name, surface in zip(scene.rig.surface_names, scene.rig.surfaces(), strict=True):
        if isinstance(surface, Plane) or (name == "gate" and not gated):
            continue
        triangles = revolved_triangles(surface) if isinstance(surface, Revolved) else mesh_triangles(surface)
        meshes.append(Mesh(name, triangles, opening if name == "gate" else -1))
    return tuple(meshes)


def _box(scene: Scene) -> Array:
    half, longest = scene.rig.domain_half_width, max(max(body.extents) for body in scene.bodies)
    top = pour_rig(scene).feed().floor + scene.insertion.region_height + longest
    return np.array([[-half, -half, -0.01], [half, half, top]])
