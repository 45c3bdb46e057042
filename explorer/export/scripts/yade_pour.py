"""The pour that `deck.json` beside this file describes, in YADE: `yade -n -x -j1 yade_pour.py [DUMP_EVERY]`.

Writes `final.txt` at the end, and with DUMP_EVERY also `trajectory.txt` every so many steps, in the text form of a
LAMMPS dump: id, radius, x, y, z, vx, vy, vz, omegax, omegay, omegaz of every member sphere (SI; spheres of a body one
after the other, bodies in order of entry). Prints the seconds that the stepping loop took.
"""

import json
import sys
import time
from pathlib import Path

from yade import (
    Bo1_Facet_Aabb,
    Bo1_Sphere_Aabb,
    Bo1_Wall_Aabb,
    ForceResetter,
    FrictMat,
    Ig2_Facet_Sphere_ScGeom,
    Ig2_Sphere_Sphere_ScGeom,
    Ig2_Wall_Sphere_ScGeom,
    InsertionSortCollider,
    InteractionLoop,
    Ip2_FrictMat_FrictMat_MindlinPhys,
    Law2_ScGeom_MindlinPhys_Mindlin,
    MatchMaker,
    NewtonIntegrator,
    O,
    Quaternion,
    Vector3,
)
from yade.utils import facet, sphere, wall

COLUMNS = "id radius x y z vx vy vz omegax omegay omegaz"

deck = json.loads(Path("deck.json").read_text(encoding="utf-8"))
law = json.loads(Path("law.json").read_text(encoding="utf-8"))
classes = range(len(deck["clumps"]) + 1)


def table(name: str) -> MatchMaker:
    """A value for every pair of materials; they are numbered as the classes of the deck."""
    return MatchMaker(matches=[(a, b, law[name][a][b]) for a in classes for b in classes if a <= b])


materials = [
    *deck["clumps"],
    {"youngs_modulus": deck["wall_youngs_modulus"], "poisson_ratio": deck["wall_poisson_ratio"]},
]
for entry in materials:
    O.materials.append(FrictMat(young=entry["youngs_modulus"], poisson=entry["poisson_ratio"], density=0.0))
wall_material = classes[-1]
carrier_material = O.materials.append(FrictMat(density=1.0))

# hertzian: the wall's radius counts as infinite (R* = r); by default it is taken as r (plane) or 2 r (facet).
newton = NewtonIntegrator(damping=0.0, gravity=deck["gravity"])
O.engines = [
    ForceResetter(),
    # A reach of one smallest radius: the fastest of 0.25 … 3 for the seed pour.
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Facet_Aabb(), Bo1_Wall_Aabb()], verletDist=-1.0),
    InteractionLoop(
        [
            Ig2_Sphere_Sphere_ScGeom(avoidGranularRatcheting=False),
            Ig2_Facet_Sphere_ScGeom(hertzian=True),
            Ig2_Wall_Sphere_ScGeom(hertzian=True, noRatch=False),
        ],
        [
            Ip2_FrictMat_FrictMat_MindlinPhys(
                betan=table("normal_damping"), betas=table("tangential_damping"), frictAngle=table("friction_angle")
            )
        ],
        [Law2_ScGeom_MindlinPhys_Mindlin()],
    ),
    newton,
]
O.dt = deck["dt"]

if deck["plate"] is not None:
    O.bodies.append(wall(deck["plate"], axis=2, material=wall_material))
meshes = [
    (mesh["until_step"], O.bodies.append([facet(t, material=wall_material) for t in mesh["triangles"]]))
    for mesh in deck["meshes"]
]

clumps: list[tuple[int, list[int]]] = []
CARRIERS = ((1.0, 1.0, 0.0), (1.0, -1.0, 0.0), (-2.0, 0.0, 0.0))


def enter(k: int) -> None:
    """Let body k of the deck enter.

    YADE computes a clump's centre of mass and principal axes from the densities of its spheres. Members have none;
    three carriers that touch nothing have, about the centre of mass and along the principal axes. The clump is made
    along the world's axes, then given its mass, principal moments and orientation. YADE damps with the mass of the
    touching sphere: afterwards members are given the body's.
    """
    entries = deck["entries"]
    component = entries["component"][k]
    clump = deck["clumps"][component]
    place, velocity = Vector3(entries["position"][k]), Vector3(entries["velocity"][k])
    turn = Quaternion(*entries["quaternion"][k])
    size = min(clump["radii"])
    carriers = [sphere(place + size * Vector3(at), size, material=carrier_material) for at in CARRIERS]
    for carrier in carriers:
        carrier.bounded = False
    members = [
        sphere(place + Vector3(centre), radius, material=component)
        for centre, radius in zip(clump["centres"], clump["radii"], strict=True)
    ]
    number, ids = O.bodies.appendClumped([*carriers, *members])
    body = O.bodies[number]
    # YADE orders the axes by its own moments: axis i of the clump is axis j of the deck where |axes[j][i]| = 1.
    axes = body.state.ori.toRotationMatrix()
    moments = [sum(axes[j, i] ** 2 * clump["inertia"][j] for j in range(3)) for i in range(3)]
    if max(abs(axes[j, i]) * (1.0 - abs(axes[j, i])) for i in range(3) for j in range(3)) > 1e-9:
        raise RuntimeError("YADE made the clump about other axes than asked for")
    body.state.mass, body.state.inertia = clump["mass"], Vector3(moments)
    body.state.pos, body.state.vel = place, velocity
    body.state.ori, body.aspherical = turn * body.state.ori, True
    for member, centre in zip(ids[len(CARRIERS) :], clump["centres"], strict=True):
        state = O.bodies[member].state
        state.mass, state.vel, state.pos = clump["mass"], velocity, place + turn * Vector3(centre)
    clumps.append((number, ids[len(CARRIERS) :]))


def write(path: str, mode: str) -> None:
    """Append or write the state of all member spheres to a file."""
    rows: list[str] = []
    for number, ids in clumps:
        spin = O.bodies[number].state.angVel
        for member in ids:
            body = O.bodies[member]
            values = (body.shape.radius, *body.state.pos, *body.state.vel, *spin)
            rows.append(" ".join([str(len(rows) + 1), *(f"{value:.12g}" for value in values)]))
    head = ["ITEM: TIMESTEP", str(O.iter), "ITEM: NUMBER OF ATOMS", str(len(rows)), "ITEM: BOX BOUNDS mm mm mm"]
    head += ["-1 1"] * 3 + [f"ITEM: ATOMS {COLUMNS}"]
    with Path(path).open(mode, encoding="ascii") as file:
        file.write("\n".join(head + rows) + "\n")


dump_every = int(sys.argv[1]) if len(sys.argv) > 1 else 0
events: set[int] = {0, deck["steps"], *deck["entries"]["step"], *(until for until, _ in meshes if until >= 0)}
if dump_every:
    Path("trajectory.txt").unlink(missing_ok=True)
    events |= set(range(0, deck["steps"] + 1, dump_every))
loop = 0.0
entered = 0
for step in sorted(event for event in events if event <= deck["steps"]):
    if step > O.iter:
        started = time.perf_counter()
        O.run(step - O.iter, True)
        loop += time.perf_counter() - started
    for until, ids in meshes:
        if until == step:
            for number in ids:
                O.bodies.erase(number)
    while entered < len(deck["entries"]["step"]) and deck["entries"]["step"][entered] <= step:
        enter(entered)
        entered += 1
    if dump_every and step % dump_every == 0:
        write("trajectory.txt", "a")
write("final.txt", "w")
print(f"Loop time of {loop:.6f} s for {O.iter} steps with {sum(len(ids) for _, ids in clumps)} spheres")
