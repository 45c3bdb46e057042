"""The deck for LIGGGHTS-PUBLIC 3.8: ``in.liggghts``, one file per clump, one STL per mesh.

These settings make it repeat our pour, in the order of the input:

- ``limitForce on`` cuts tension as our laws do, and every restitution is replaced by the one that gives our damping
  (:func:`unclamped_restitution`), so the normal laws are the same functions.
- ``mass … inertia_tensor … use_density`` takes the declared centre of mass; ``use_volume`` would shift it to a Monte
  Carlo estimate. The reduced mass of a contact is already that of the bodies.
- One ``fix insert/pack`` per body in a cube of 0.2 nm, with the orientation as a quaternion, at its own step. LIGGGHTS
  inserts bodies after moving those of a step, so its step k + 1 is our k.
- ``boundary m`` lets the box follow bodies that roll out of it; ``f`` would delete them.

Differences that remain with Hertz–Mindlin: the tangential spring is a displacement times the present stiffness (ours is
a force that does not grow while the contact is loaded), it is projected when the normal turns (ours keeps its length),
and its damping follows from the replaced restitution (18 % stronger at e = 0.5). With linear springs only the
projection differs if ``contact.tangential_dashpot`` is uncapped: stiffness and both dampings equal ours.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from explorer.errors import CommandError
from explorer.export.deck import Deck, DeckClump, DeckTarget, pair_tables, write_deck, write_stl
from explorer.export.frames import FINAL, TRAJECTORY
from explorer.export.readme import write_readme
from solver.effects.rolling_resistance import RollingResistance
from solver.laws import HertzMindlin, LinearSpringDashpot
from solver.laws.restitution import normal_damping
from solver.scenes.scene import Scene, actual

Array = npt.NDArray[np.float64]
INPUT = "in.liggghts"
LEAST_RESTITUTION = 0.05
"""LIGGGHTS refuses coefficients of restitution up to and including this one."""
SLOWEST_CHARACTERISTIC = 0.01
"""LIGGGHTS in SI units refuses slower characteristic velocities [m/s]."""
SEEDS = (15485863, 15485867, 32452843)
"""Primes for templates, distributions and insertion, which must differ; no random draw affects the result."""
CUBE = 1e-10
"""Half the edge of the cube in which a centre of mass is placed [m]."""
SOFT, HARD = 5e6, 1e9
"""Young's moduli [Pa] beyond which LIGGGHTS asks for a confirmation."""
SKIN, CELL = 0.9, 6.0
"""Reach of the contact list beyond touching, and size of its cells, in radii of the largest sphere: the fastest values
found for the seed pour. By default the box is cut into cells of half a contact distance, and emptying millions of them
takes longer than everything else."""
MODELS = {
    HertzMindlin.name: "model hertz tangential history",
    LinearSpringDashpot.name: "model hooke tangential history",
}
"""Names of our laws in LIGGGHTS."""
ROLLING = " rolling_friction epsd2"
"""Added to the model if there is rolling resistance: the law of our ``rolling_resistance``, without a dashpot."""


def unclamped_restitution(restitution: float) -> float:
    """The e for which LIGGGHTS's damping ratio, |β(e)| in both laws, is our ζ; 0 where ζ ≥ 1.

    β = ln e / √(ln² e + π²), so e = exp(−π b / √(1 − b²)) with b = ζ = c_n / (2 √(5/6)).
    """
    b = normal_damping(restitution) / (2.0 * math.sqrt(5.0 / 6.0))
    return math.exp(-math.pi * b / math.sqrt(1.0 - b * b)) if b < 1.0 else 0.0


def write_liggghts(folder: Path, deck: Deck) -> None:
    """Write the deck into ``folder``; :class:`CommandError` for anything that LIGGGHTS does not accept."""
    for clump in deck.clumps:
        _check_clump(clump.name, len(clump.radii))
    text = "\n".join(_input(deck)) + "\n"
    for k, clump in enumerate(deck.clumps, start=1):
        rows = np.column_stack([clump.centres, clump.radii])
        (folder / _clump_file(k)).write_text("\n".join(map(_row, rows)) + "\n", encoding="ascii")
    for mesh in deck.meshes:
        write_stl(folder / f"{mesh.name}.stl", mesh.name, mesh.triangles)
    (folder / INPUT).write_text(text, encoding="utf-8")
    write_deck(folder, deck)
    write_readme(folder, "liggghts", deck)


class Liggghts(DeckTarget):
    """LIGGGHTS as a target of an export."""

    name, what = "liggghts", "a deck that runs as it is"
    holds = (RollingResistance.name,)
    laws = (HertzMindlin.name, LinearSpringDashpot.name)

    def check(self, scene: Scene) -> None:
        """Raise :class:`CommandError` for what a deck cannot hold, single-sphere bodies and low restitutions."""
        super().check(scene)
        scene = actual(scene)
        for body in scene.bodies:
            _check_clump(body.name, len(body.clump.radii))
        _replaced(pair_tables(scene)[1])
        speed = scene.contact.characteristic_velocity
        if scene.contact.law == LinearSpringDashpot.name and speed < SLOWEST_CHARACTERISTIC:
            raise CommandError(
                f"contact.characteristic_velocity: {speed:g} m/s; "
                f"allowed by LIGGGHTS: from {SLOWEST_CHARACTERISTIC:g} on"
            )

    def write_deck(self, folder: Path, deck: Deck) -> None:
        """Write a deck into an existing folder."""
        write_liggghts(folder, deck)


LIGGGHTS = Liggghts()


@dataclass(frozen=True)
class ContactSettings:
    """The law between particles and at walls, in LIGGGHTS's words, including our rolling resistance if there is one."""

    rolling_friction: float = 0.0
    law: str = HertzMindlin.name
    characteristic_velocity: float = 1.0
    """Characteristic velocity of linear springs [m/s]."""

    @property
    def words(self) -> str:
        """The model of a pair style or a wall."""
        return MODELS[self.law] + (ROLLING if self.rolling_friction > 0.0 else "")

    def pair_lines(self, moduli: list[float], ratios: list[float], restitution: Array, friction: Array) -> list[str]:
        """Materials by class and pairs of classes, and the law between particles.

        Raises :class:`CommandError` if a restitution is too low for LIGGGHTS.
        """
        n = len(moduli)
        replaced = _replaced(restitution)
        return [
            *_confirmations(moduli),
            f"fix youngs all property/global youngsModulus peratomtype {_row(moduli)}",
            f"fix poisson all property/global poissonsRatio peratomtype {_row(ratios)}",
            f"fix restitution all property/global coefficientRestitution peratomtypepair {n} {_row(replaced.ravel())}",
            f"fix friction all property/global coefficientFriction peratomtypepair {n} {_row(friction.ravel())}",
            *self._velocity_lines(),
            *self._rolling_lines(n),
            f"pair_style gran {self.words} limitForce on",
            "pair_coeff * *",
        ]

    def plane_line(self, name: str, wall: int, axis: str, place: float) -> str:
        """An infinite plane of material ``wall`` normal to ``axis`` (x, y, z) at ``place`` [m]; R* is the sphere's."""
        plane = f"primitive type {wall} {axis}plane {place!r}"
        return f"fix {name} all wall/gran {self.words} {plane} limitForce on"

    def mesh_lines(self, names: list[str]) -> list[str]:
        """All meshes as one wall; LIGGGHTS allows only one of this kind."""
        meshes = f"n_meshes {len(names)} meshes {' '.join(names)}"
        return [f"fix walls all wall/gran {self.words} mesh {meshes} limitForce on"] if names else []

    def _velocity_lines(self) -> list[str]:
        if self.law != LinearSpringDashpot.name:
            return []
        return [f"fix speed all property/global characteristicVelocity scalar {self.characteristic_velocity!r}"]

    def _rolling_lines(self, n: int) -> list[str]:
        if not self.rolling_friction > 0.0:
            return []
        table = _row([self.rolling_friction] * n**2)
        return [f"fix rolling all property/global coefficientRollingFriction peratomtypepair {n} {table}"]


@dataclass(frozen=True)
class FreeSpheres:
    """Single spheres (n of them), not clumps, as ``read_data`` accepts them."""

    type: npt.NDArray[np.int64]
    """Number of the material, from 1, shape (n,)."""
    radius: Array
    """[m], shape (n,)."""
    density: Array
    """[kg/m³], shape (n,)."""
    position: Array
    """[m], shape (n, 3)."""
    velocity: Array
    """[m/s], shape (n, 3)."""
    spin: Array
    """[rad/s], shape (n, 3)."""


def write_spheres(path: Path, spheres: FreeSpheres, types: int, box: Array) -> None:
    """Write ``spheres`` as ``read_data`` expects them for ``atom_style granular``: numbered from 1 in their order.

    Parameters
    ----------
    path
        File to write.
    spheres
        Content of the file.
    types
        Number of materials, walls included.
    box
        Corners (low, high) of the box [m], shape (2, 3).
    """
    sides = [f"{low:.12g} {high:.12g} {a}lo {a}hi" for a, low, high in zip("xyz", *box, strict=True)]
    columns = (spheres.type, spheres.radius, spheres.density, spheres.position)
    places = [
        f"{k} {kind} {2.0 * r:.15g} {density:.15g} {x:.15g} {y:.15g} {z:.15g}"
        for k, (kind, r, density, (x, y, z)) in enumerate(zip(*columns, strict=True), start=1)
    ]
    moving = np.hstack([spheres.velocity, spheres.spin])
    speeds = [" ".join([str(k), *(f"{value:.15g}" for value in row)]) for k, row in enumerate(moving, start=1)]
    head = ["single spheres", "", f"{len(places)} atoms", f"{types} atom types", "", *sides]
    text = "\n".join([*head, "", "Atoms", "", *places, "", "Velocities", "", *speeds])
    path.write_text(text + "\n", encoding="ascii")


def gravity_lines(gravity: tuple[float, float, float]) -> list[str]:
    """The acceleration [m/s²] as a magnitude and a direction."""
    size = math.hypot(*gravity)
    return [f"fix gravity all gravity {size!r} vector {_row([g / size for g in gravity])}"] if size > 0.0 else []


def settings_lines(box: Array, types: int, skin: float) -> list[str]:
    """Style, box (low, high) [m], number of types and the reach of the contact list beyond touching [m]."""
    sides = " ".join(f"{low:.12g} {high:.12g}" for low, high in zip(*box, strict=True))
    return [
        "units si",
        "atom_style granular",
        "atom_modify map array",
        "boundary m m m  # grows with what rolls out; f would delete it",
        "newton off",
        "communicate single vel yes",
        f"region room block {sides} units box",
        f"create_box {types} room",
        f"neighbor {skin:.12g} bin",
        "neigh_modify delay 0",
    ]


def run_lines(steps: int, dt: float) -> list[str]:
    """Time step and the output along the way: there is none unless ``-var dump_every N`` asks for it."""
    return [
        f"timestep {dt!r}",
        "variable dump_every index 0",
        f'if "${{dump_every}} > 0" then "dump trajectory all custom ${{dump_every}} {TRAJECTORY} {COLUMNS}" '
        f"\"dump_modify trajectory sort id format '{FORMAT}'\"",
        f"thermo {max(1, steps // 10)}",
        "thermo_style custom step atoms cpu",
    ]


COLUMNS = "id radius x y z vx vy vz omegax omegay omegaz"
FORMAT = " ".join(["%d", *["%.12g"] * 10])
WRITE_FINAL = f'write_dump all custom {FINAL} {COLUMNS} modify sort id format "{FORMAT}"'


def _input(deck: Deck) -> list[str]:
    moduli = [*(clump.youngs_modulus for clump in deck.clumps), deck.wall_youngs_modulus]
    ratios = [*(clump.poisson_ratio for clump in deck.clumps), deck.wall_poisson_ratio]
    wall, law = len(moduli), ContactSettings(deck.rolling_friction, deck.law, deck.characteristic_velocity)
    largest = max(float(clump.radii.max()) for clump in deck.clumps)
    # Further lines of a title would be read as commands.
    title = " ".join(deck.title.split())
    return [
        f"# {title}, seed {deck.seed}: {deck.bodies} bodies, {deck.steps} steps of {deck.dt:.6g} s",
        *settings_lines(deck.box, wall, SKIN * largest),
        f"neigh_modify binsize {CELL * largest:.12g}",
        *law.pair_lines(moduli, ratios, deck.restitution, deck.friction),
        *gravity_lines(deck.gravity),
        *([] if deck.plate is None else [law.plane_line("plate", wall, "z", deck.plate)]),
        *(f"fix {mesh.name} all mesh/surface file {mesh.name}.stl type {wall}" for mesh in deck.meshes),
        *law.mesh_lines([mesh.name for mesh in deck.meshes]),
        *(line for k, clump in enumerate(deck.clumps, start=1) for line in _template_lines(k, clump)),
        "fix motion all multisphere",
        *run_lines(deck.steps, deck.dt),
        *(line for body in range(deck.bodies) for line in _insertion_lines(deck, body)),
        *_runs(deck, law),
        WRITE_FINAL,
    ]


def _replaced(restitution: Array) -> Array:
    """The restitutions to give to LIGGGHTS; :class:`CommandError` if one is too low for it."""
    replaced: Array = np.vectorize(unclamped_restitution, otypes=[float])(restitution)
    if replaced.min() <= LEAST_RESTITUTION:
        raise CommandError(
            f"restitution {restitution.min():g}: LIGGGHTS needs more than {LEAST_RESTITUTION:g} after its damping "
            "is matched to ours; allowed: 0.22 … 1"
        )
    return replaced


def _check_clump(name: str, spheres: int) -> None:
    if spheres < 2:
        raise CommandError(f"body {name!r}: LIGGGHTS takes clumps of at least 2 spheres, not of one")


def _confirmations(moduli: list[float]) -> list[str]:
    """The confirmations that LIGGGHTS requires for very soft or very hard particles."""
    soft = [f"soft_particles yes  # a modulus below {SOFT:g} Pa"] if min(moduli) < SOFT else []
    return soft + ([f"hard_particles yes  # a modulus above {HARD:g} Pa"] if max(moduli) > HARD else [])


def _template_lines(k: int, clump: DeckClump) -> list[str]:
    x, y, z = map(float, clump.inertia)
    return [
        f"fix clump{k} all particletemplate/multisphere {SEEDS[0]} atom_type {k} volume_limit 1e-30 "
        f"density constant {clump.density!r} nspheres {len(clump.radii)} ntry 1000 spheres file {_clump_file(k)} "
        f"scale 1.0 type {k} mass {clump.mass!r} inertia_tensor {x!r} 0 0 {y!r} 0 {z!r} use_density",
        f"fix only{k} all particledistribution/discrete {SEEDS[1]} 1 clump{k} 1.0",
    ]


def _insertion_lines(deck: Deck, body: int) -> list[str]:
    entries = deck.entries
    place = " ".join(f"{c - CUBE:.12f} {c + CUBE:.12f}" for c in entries.position[body])
    return [
        f"region place{body} block {place} volume_limit 1e-60 units box",
        f"fix enter{body} all insert/pack seed {SEEDS[2]} distributiontemplate only{entries.component[body] + 1} "
        f"insert_every once start {entries.step[body] + 1} overlapcheck no all_in no verbose no "
        f"vel constant {_row(entries.velocity[body])} orientation constant {_row(entries.quaternion[body])} "
        f"region place{body} particles_in_region 1 ntry_mc 1000",
    ]


def _runs(deck: Deck, law: ContactSettings) -> list[str]:
    """Runs between the moments at which a mesh is removed; one step more than ours, because theirs begin at 1.

    The wall is then declared again without that mesh: contacts with the other meshes restart without a tangential
    spring.
    """
    lines, done, there = [], 0, [mesh.name for mesh in deck.meshes]
    for mesh in sorted(deck.meshes, key=lambda mesh: mesh.until_step):
        if 0 <= mesh.until_step < deck.steps:
            there.remove(mesh.name)
            lines += [f"run {mesh.until_step + 1 - done}", "unfix walls", f"unfix {mesh.name}"]
            lines += law.mesh_lines(there)
            done = mesh.until_step + 1
    return [*lines, f"run {deck.steps + 1 - done}"]


def _clump_file(k: int) -> str:
    return f"clump{k}.txt"


def _row(values: Array | list[float]) -> str:
    return " ".join(f"{float(value)!r}" for value in values)
