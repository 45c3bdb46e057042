"""The bed of spheres in `bed.json` beside this file, in YADE: `yade -n -x -j1 yade_bed.py`.

Writes `final.txt` in the text form of a LAMMPS dump (id, radius, x, y, z, vx, vy, vz, omegax, omegay, omegaz; SI) and
prints the seconds that the stepping loop took.
"""

import json
import time
from pathlib import Path

from yade import (
    Bo1_Sphere_Aabb,
    Bo1_Wall_Aabb,
    ForceResetter,
    FrictMat,
    Ig2_Sphere_Sphere_ScGeom,
    Ig2_Wall_Sphere_ScGeom,
    InsertionSortCollider,
    InteractionLoop,
    Ip2_FrictMat_FrictMat_MindlinPhys,
    Law2_ScGeom_MindlinPhys_Mindlin,
    MatchMaker,
    NewtonIntegrator,
    O,
)
from yade.utils import sphere, wall

bed = json.loads(Path("bed.json").read_text(encoding="utf-8"))
law = json.loads(Path("law.json").read_text(encoding="utf-8"))
O.materials.append(FrictMat(young=bed["youngs_modulus"], poisson=bed["poisson_ratio"], density=bed["density"]))
ratios = {name: MatchMaker(matches=[(0, 0, values[0][0])]) for name, values in law.items()}
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()]),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(avoidGranularRatcheting=False), Ig2_Wall_Sphere_ScGeom(hertzian=True, noRatch=False)],
        [
            Ip2_FrictMat_FrictMat_MindlinPhys(
                betan=ratios["normal_damping"], betas=ratios["tangential_damping"], frictAngle=ratios["friction_angle"]
            )
        ],
        [Law2_ScGeom_MindlinPhys_Mindlin()],
    ),
    NewtonIntegrator(damping=0.0, gravity=bed["gravity"]),
]
O.dt = bed["dt"]
for axis in range(3):
    O.bodies.append(wall(bed["low"][axis], axis=axis, material=0))
    if axis < 2:
        O.bodies.append(wall(bed["high"][axis], axis=axis, material=0))
ids = O.bodies.append([sphere(x, r, material=0) for x, r in zip(bed["position"], bed["radius"], strict=True)])
for number, velocity in zip(ids, bed["velocity"], strict=True):
    O.bodies[number].state.vel = velocity

# The first step sorts all bodies; it belongs to the setting up.
O.run(1, True)
started = time.perf_counter()
O.run(bed["steps"] - 1, True)
loop = time.perf_counter() - started
rows = []
for k, number in enumerate(ids, start=1):
    body = O.bodies[number]
    values = (body.shape.radius, *body.state.pos, *body.state.vel, *body.state.angVel)
    rows.append(" ".join([str(k), *(f"{value:.12g}" for value in values)]))
head = ["ITEM: TIMESTEP", str(O.iter), "ITEM: NUMBER OF ATOMS", str(len(rows)), "ITEM: BOX BOUNDS mm mm mm"]
head += ["-1 1"] * 3 + ["ITEM: ATOMS id radius x y z vx vy vz omegax omegay omegaz"]
Path("final.txt").write_text("\n".join(head + rows) + "\n", encoding="ascii")
contacts = sum(1 for interaction in O.interactions if interaction.isReal)
print(f"Contacts {contacts}")
print(f"Loop time of {loop:.6f} s for {bed['steps'] - 1} steps with {len(ids)} spheres")
