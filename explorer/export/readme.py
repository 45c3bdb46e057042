"""``README.txt`` of an exported folder: how to run it, how to read the results, what differs from our solver."""

from __future__ import annotations

import textwrap
from pathlib import Path

from explorer.export.deck import SIDES, Deck
from solver.laws import HertzMindlin

RUN = {
    "liggghts": """\
        liggghts -in in.liggghts
        liggghts -in in.liggghts -var dump_every 1000      writes trajectory.txt every 1000 steps as well

        Made for LIGGGHTS-PUBLIC 3.8.0 (Debian: apt install liggghts). One process: clumps are serial.
        "Loop time of … s" in the output is the time of the stepping loop.""",
    "yade": """\
        yade -n -x -j1 yade_pour.py
        yade -n -x -j1 yade_pour.py 1000                   writes trajectory.txt every 1000 steps as well

        Made for YADE 2023.02a (Debian: apt install yade). "Loop time of … s" at the end is the time of the stepping
        loop. On a busy machine set OMP_WAIT_POLICY=passive.""",
}
FILES = {
    "liggghts": """\
        in.liggghts   the input            clump<k>.txt   member spheres x y z r of component k [m]""",
    "yade": """\
        yade_pour.py  the script           law.json       damping ratios and friction angles of all pairs""",
}
DIFFERENCES = {
    "linear": """\
        contact.law = {law_name}, characteristic velocity {speed:g} m/s; model hooke tangential history there.
        Normal force: the same function (limitForce on, and restitutions replaced by those with the same damping).
        Tangential force: LIGGGHTS's spring is projected when the normal turns, ours keeps its length. Coulomb's limit
        holds for its spring alone{dashpot}.
        Where a body is placed is drawn in a cube of 0.2 nm. Counting of steps: its step k + 1 is our k.""",
    "liggghts": """\
        Normal force: the same function (limitForce on, and restitutions replaced by those with the same damping).
        Tangential force: LIGGGHTS stores a displacement and multiplies it with the present stiffness, so the force
        grows while a contact is loaded{law}. Coulomb's limit holds for its spring
        alone{dashpot}. Its tangential damping is stronger, by 18 % at e = 0.5.
        Where a body is placed is drawn in a cube of 0.2 nm. Counting of steps: its step k + 1 is our k.""",
    "yade": """\
        Normal force and both dampings: the same functions. Tangential force: YADE does not scale the spring down while
        a contact unloads{law}. A sphere on an edge between two triangles of the cone is pushed by both.""",
}
MODULI = """\
        moduli            Young's modulus and Poisson's ratio; 1/E* = sum of (1 - nu^2)/E, G from both: as here"""
COMMON = """\
        rolling friction  {rolling}
        mass, inertia     of the true shape, not of overlapping spheres: as here
        R*, m*            reduced radius of two member spheres (a wall: infinite) and mass of two bodies: as here
                          (contact.clump_rule = body_mass)"""
CONVENTIONS = {
    "liggghts": f"""\
{MODULI}
        restitution       in.liggghts holds those of the same damping, each lower than the one declared, which comes out
        static friction   Coulomb, |F_t| <= mu F_n: as here
{COMMON}""",
    "yade": f"""\
{MODULI}
        restitution       law.json holds damping ratios instead, half of our c_n and c_t: as here
        static friction   law.json holds the angle, atan mu; Coulomb, |F_t| <= mu F_n: as here
{COMMON}""",
}
POLYGON = f"The cone is a polygon of the same area with {SIDES} sides"
OF_FILE = "The cone has the triangles of its mesh file, as here"
NO_ROLLING = "none: nothing resists rolling, here or there"
EPSD2 = "{mu:g}, epsd2: a spring k_t R*^2, torque up to mu_r R* F_n, as here; elsewhere the number means something else"
TEXT = """\
{title}
{bodies} bodies, {spheres} member spheres, seed {seed}; {steps} steps of {dt:.6g} s = {time:.6g} s simulated.
Bodies enter at the moments, places, orientations and velocities of the pour of this seed in explorer.

Run
{run}

Files
{files}
    deck.json     all of it, in SI and in no engine's terms
    *.stl         cone and gate [m]; the plate is an infinite plane{plate}

Read
    final.txt     the last moment, one row per member sphere: id, radius, position, velocity of its centre, angular
                  velocity of its body (world's frame); SI. Ids follow the order of entry, the spheres of a body stand
                  one after the other in the order of its clump (deck.json: clumps, entries.component).
                  The form is that of a LAMMPS dump; OVITO opens it.

Conventions
{conventions}

Not as in explorer
{differences}
    {cone}; bodies that roll far away stay in the calculation.
"""


def write_readme(folder: Path, engine: str, deck: Deck) -> None:
    """Write ``README.txt`` into ``folder``."""
    text = TEXT.format(
        title=deck.title,
        bodies=deck.bodies,
        spheres=sum(len(deck.members(body)) for body in range(deck.bodies)),
        seed=deck.seed,
        steps=deck.steps,
        dt=deck.dt,
        time=deck.steps * deck.dt,
        run=_block(RUN[engine]),
        files=_block(FILES[engine]),
        conventions=_block(CONVENTIONS[engine].format(rolling=_rolling(deck.rolling_friction))),
        cone=OF_FILE if any(mesh.of_file for mesh in deck.meshes) else POLYGON,
        differences=_block(_differences(engine, deck)),
        plate="" if deck.plate is None else f" z = {deck.plate:g} m",
    )
    (folder / "README.txt").write_text(text, encoding="utf-8")


def _differences(engine: str, deck: Deck) -> str:
    same = engine == "liggghts" and deck.tangential_law == "mindlin"
    law = f"{', as' if same else '; not so'} here (contact.tangential_law = {deck.tangential_law})"
    both = "; here as well" if deck.tangential_dashpot == "uncapped" else ", here for both"
    dashpot = f"{both} (contact.tangential_dashpot = {deck.tangential_dashpot})"
    if deck.law != HertzMindlin.name:
        speed = deck.characteristic_velocity
        return DIFFERENCES["linear"].format(law_name=deck.law, speed=speed, dashpot=dashpot)
    return DIFFERENCES[engine].format(law=law, dashpot=dashpot)


def _rolling(friction: float) -> str:
    return EPSD2.format(mu=friction) if friction > 0.0 else NO_ROLLING


def _block(text: str) -> str:
    return textwrap.indent(textwrap.dedent(text), "    ")
