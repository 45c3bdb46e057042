"""Arrays of a batch of worlds: what the kernels read and write, each with its unit and shape.

Worlds are independent runs. Every array has the world as its leading axis; capacities are fixed when a batch is
allocated, and a world that outgrows them stops with the outcome ``buffer_overflow``.
"""

import math
from dataclasses import dataclass, fields, replace
from functools import cache

from solver.backend import ti
from solver.effects.columns import COLUMNS, KEPT
from solver.laws import CONTACT_LAWS, HertzMindlin

Vec3 = ti.types.vector(3, ti.f64)
Vec4 = ti.types.vector(4, ti.f64)
Ints3 = ti.types.vector(3, ti.i32)
Mat3 = ti.types.matrix(3, 3, ti.f64)

WORLD = {
    "dt": ti.f64,  # time step [s]
    "gravity": Vec3,  # [m/s²]
    "skin": ti.f64,  # unit of the margins, by which the contact list reaches beyond touching [m]
    "outdated": ti.i32,  # 1: the list has to be built before the next step
    "loaded": ti.i32,  # bodies that will enter
    "bodies": ti.i32,  # bodies that have entered
    "walls": ti.i32,  # walls of the rig
    "primitives": ti.i32,  # surfaces that are planes or revolved segments; they come before the patches of meshes
    "contacts": ti.i32,  # entries of the contact list
    "candidates": ti.i32,  # triangles that the entries refer to
    "rebuilds": ti.i32,  # how often the list was built
    "overflow": ti.i32,  # 1 once the contact list did not fit
    "overlap": ti.f64,  # largest overlap / member radius since it was cleared
    "cell": ti.f64,  # edge of a cell of the body grid [m]
    "kinds": ti.i32,  # contact classes
    "sleep_speed": ti.f64,  # a body slower than this may fall asleep [m/s]; 0: none does
    "sleep_time": ti.f64,  # after it has been that slow for this time [s]
    "stirred": ti.i32,  # 1: a body woke or fell asleep, or the list was built
    "awake": ti.i32,  # bodies that move
    "border": ti.i32,  # sleeping bodies that an awake body or a moving wall may push
    "live": ti.i32,  # entries of the list whose force may change
    "dissipated": ti.f64,  # energy dissipated by contacts and by falling asleep [J]
    "wall_work": ti.f64,  # work of moving walls and of a pull on the bodies [J]
    "taken_out": ti.f64,  # kinetic and potential energy of bodies that were taken out [J]
    "domain": ti.f64,  # bodies beyond |x| or |y| of this are taken out [m]
    "grip": ti.f64,  # largest gap at which effects may still hold surfaces that have touched [m]
    "clump_rule": ti.i32,  # index in ``contact_model.CLUMP_RULES``
    "tangential_law": ti.i32,  # index in ``contact_model.TANGENTIAL_LAWS``
    "tangential_dashpot": ti.i32,  # index in ``contact_model.TANGENTIAL_DASHPOTS``
    "outlet": ti.f64,  # height of the outlet [m]
    "inlet_radius": ti.f64,  # radius of the feed opening [m]
}
"""Per world, shape (worlds,)."""

BODY = {
    "mass": ti.f64,  # [kg]
    "inertia": Vec3,  # principal moments [kg m²]
    "inverse_mass": ti.f64,  # [1/kg]
    "inverse_inertia": Vec3,  # [1/(kg m²)]
    "position": Vec3,  # centre of mass [m], at the full step
    "quaternion": Vec4,  # orientation wxyz, at the full step
    "velocity": Vec3,  # [m/s], at the half step
    "spin": Vec3,  # angular velocity in the principal frame [rad/s], at the half step
    "rotation": Mat3,  # principal frame → world, valid while ``listed``
    "omega": Vec3,  # angular velocity in the world frame [rad/s], valid while ``listed``
    "force": Vec3,  # contact force [N]
    "torque": Vec3,  # contact torque about the centre of mass, world frame [N m]
    "reach": ti.f64,  # radius of the bounding sphere [m]
    "semi_axes": Vec3,  # of the ellipsoid that represents the body in air drag [m], `tables.outline`
    "diameter": ti.f64,  # of the sphere of the same volume [m]
    "drag_factors": Vec4,  # a, b, c, d of its drag coefficient (`effects/air_drag.py`)
    "swing": ti.f64,  # largest distance of a member's centre from the centre of mass [m]
    "travel": ti.f64,  # bound on the displacement of its members' centres since the list was built [m]
    "margin": ti.f64,  # largest travel for which the list remains valid [m]
    "first": ti.i32,  # index of the first member sphere
    "members": ti.i32,  # number of member spheres
    "kind": ti.i32,  # contact class
    "alive": ti.i32,  # 0: taken out of the world
    "has_left": ti.i32,  # 1: has been below the outlet
    "listed": ti.i32,  # 1: has entries in the contact list
    "touching": ti.i32,  # number of touching contacts with other bodies, set by ``summarise``
    "low": Vec3,  # bounding box when the list was built [m]
    "high": Vec3,
    "next": ti.i32,  # the next body in the same cell of the grid, -1: none
    "near": ti.i32,  # scratch of the list build: bodies, then triangles, that may be near
    "quiet": ti.f64,  # how long it has been slower than ``sleep_speed`` [s]
    "asleep": ti.i32,  # 1: stands still until the forces on it change
    "held": Vec3,  # force [N] and
    "held_torque": Vec3,  # torque [N m] on a sleeping body from contacts in which nothing moves
    "awake": ti.i32,  # list of the bodies that move, ascending
    "border": ti.i32,  # list of the sleeping bodies that an awake body or a moving wall may push, ascending
    "at_border": ti.i32,  # 1: is in that list
}
"""Per body, shape (worlds, bodies)."""

MEMBER = {
    "local": Vec3,  # centre in the principal frame [m]
    "radius": ti.f64,  # [m]
    "body": ti.i32,
    "centre": Vec3,  # in the world [m], valid while ``listed``
    "listed": ti.i32,  # 1: has entries in the contact list
}
"""Per member sphere, shape (worlds, members)."""

PULL = {"body": ti.i32, "force": Vec3}
"""Per world: number + 1 of the body that a person pulls (0: none), and the force on its centre of mass [N]."""

HISTORY = {"i": ti.i32, "j": ti.i32, "spring": Vec3, "loss": Vec3, "radius": ti.f64, "expected": ti.f64}
"""What a contact keeps when the list is rebuilt, shape (worlds, contacts)."""

CONTACT = {
    "i": ti.i32,  # member sphere
    "j": ti.i32,  # the other member sphere (> i), or members' capacity + index of a surface
    "a": ti.i32,  # body of i
    "b": ti.i32,  # body of j, or -1 - wall
    "law": ti.i32,  # row of the law table
    "reduced_radius": ti.f64,  # R* = r_i r_j / (r_i + r_j), r_i against a surface [m]
    "reduced_mass": ti.f64,  # m* of the bodies, m_i against a surface [kg]
    "spring": Vec3,  # tangential elastic force on i [N]
    "loss": Vec3,  # force on j at the last step other than the elastic normal force: damping and friction [N]
    "radius": ti.f64,  # contact radius a = sqrt(R* δ) at the last step [m]; 0: apart
    "expected": ti.f64,  # speed along the normal [m/s] after the last step if this contact alone had acted
    "first": ti.i32,  # first of the triangles that may touch, for a patch of a mesh
    "triangles": ti.i32,  # and how many
    "live": ti.i32,  # list of the entries that have an awake body or a moving wall, ascending; then the others
}
"""Per entry of the contact list, ordered by (i, j), shape (worlds, contacts)."""

PAIR = {
    "lead": ti.i32,  # first entry of the list with the same two bodies (or body and wall)
    "overlap": ti.f64,  # at a lead: sum of the overlaps δ of all contacts of the pair [m]
    "normal": Vec3,  # at a lead: sum of δ n [m]
    "point": Vec3,  # at a lead: sum of δ times the contact point relative to the centre of body a [m²]
}
"""Per entry of the contact list if contacts of a pair share (``narrowphase.py``), shape (worlds, contacts)."""

WALL = {
    "origin": Vec3,  # pose: local frame → world [m]
    "quaternion": Vec4,
    "turn": Mat3,  # the same rotation as a matrix
    "velocity": Vec3,  # of the origin [m/s]
    "omega": Vec3,  # angular velocity about the origin, world frame [rad/s]
    "moving": ti.i32,  # 1: the velocities are not zero
    "extent": ti.f64,  # distance from the origin to the furthest point that the rotation displaces [m]
    "travel": ti.f64,  # bound on the displacement of its points since the list was built [m]
    "margin": ti.f64,  # largest travel for which the list remains valid [m]
    "kind": ti.i32,  # contact class
    "active": ti.i32,
    "force": Vec3,  # force of the bodies on the wall at the last step [N]
    "torque": Vec3,  # torque about the origin [N m]
    "held": Vec3,  # parts of force and torque from contacts in which nothing moves
    "held_torque": Vec3,
    "low": Vec3,  # lower corner of a mesh's grid, local frame [m]
    "cell": ti.f64,  # edge of its cells [m]; 0: no mesh
    "cells": Ints3,  # number of cells along each axis
    "first_cell": ti.i32,  # index of its first cell
}
"""Per surface of the rig as declared, shape (worlds, walls)."""

SURFACE = {
    "shape": ti.i32,  # 0 plane, 1 revolved segment, 2 smooth patch of a triangle mesh
    "geometry": Vec4,  # of a revolved segment: r0, z0, r1, z1 [m]
    "wall": ti.i32,
}
"""What a sphere can touch: one entry per primitive, and one per smooth patch of a mesh; shape (worlds, surfaces)."""

TRIANGLE = {
    "a": Vec3,  # corners in the frame of the wall [m]
    "b": Vec3,
    "c": Vec3,
    "surface": ti.i32,
    "edges": Ints3,  # what to do with a nearest point on ab, bc, ca: 0 keep, 1 leave it to the other patch, 2 see guard
    "corners": Ints3,  # the same at a, b, c: 0 keep, 1 leave it to the other patch
    "guards": Mat3,  # one row per edge: unit vector in the neighbour's plane, away from the edge
}
"""Per triangle of the meshes, ordered by surface, shape (worlds, triangles)."""

SUMMARY = {
    "kinetic": ti.f64,  # kinetic energy [J]
    "elastic": ti.f64,  # energy in the contact springs [J]
    "potential": ti.f64,  # − m g·x [J]
    "speed": ti.f64,  # largest √(2 kinetic / mass) of the bodies outside the funnel that do not roll away [m/s]
    "funnel_speed": ti.f64,  # the same for the bodies in the funnel [m/s]
    "discharged": ti.f64,  # mass of bodies that are not in the funnel, or were taken out [kg]
    "in_funnel": ti.f64,  # mass above the outlet and within the inlet's radius [kg]
    "touching": ti.i32,  # touching contacts
    "hanging": ti.i32,  # number of bodies in the funnel
    "asleep": ti.i32,  # sleeping bodies
    "finite": ti.i32,  # 0 once a number is not finite
}
"""Per world, written by the kernel at the end of a launch, shape (worlds,)."""

QUANTA = {"bodies": 128, "members": 1024, "contacts": 16384}
MESH_QUANTA = {"triangles": 256, "cells": 4096, "cell_items": 16384}
"""Sizes are rounded up to multiples of these, so that similar scenes share compiled kernels."""
KINDS = 6
"""Contact classes of the smallest table; larger ones have twice as many, four times as many, and so on."""


@dataclass(frozen=True)
class Capacity:
    """Sizes of a batch. ``kinds`` counts contact classes (components and surface materials)."""

    worlds: int
    bodies: int
    members: int
    contacts: int
    kinds: int = 6
    walls: int = 8
    surfaces: int = 8
    triangles: int = 1
    effects: bool = False
    """Whether effects are compiled in: the base model is faster without them."""
    sharing: bool = False
    """Whether the clump rule by which contacts of a pair share stiffness and damping is compiled in."""
    law: str = HertzMindlin.name
    """The contact law that is compiled in."""
    cells: int = 1
    """Cells of the grids of all meshes, plus one."""
    cell_items: int = 1
    """Triangles in those cells, counted once per cell."""

    def rounded(self) -> "Capacity":
        """Sizes rounded up to multiples of their quanta; sizes of mesh tables only if there is a mesh."""
        quanta = QUANTA | (MESH_QUANTA if self.triangles > 1 else {})
        kinds = KINDS * 2 ** math.ceil(math.log2(max(1.0, self.kinds / KINDS)))
        sizes = {name: -(-getattr(self, name) // unit) * unit for name, unit in quanta.items()}
        return replace(self, kinds=kinds, **sizes)

    def joined(self, other: "Capacity") -> "Capacity":
        """Smallest capacity that is large enough for both."""
        return Capacity(
            **{field.name: max(getattr(self, field.name), getattr(other, field.name)) for field in fields(self)}
        )

    @property
    def buckets(self) -> int:
        """Size of the body grid's hash table: a power of two, at least twice the bodies."""
        return 1 << (2 * self.bodies - 1).bit_length()

    @property
    def candidates(self) -> int:
        """Triangles that the contact list may refer to."""
        return 8 * self.contacts if self.triangles > 1 else 1


@ti.data_oriented
class Group:
    """Fields that share an index: ``group.position[w, b]`` in a kernel."""

    def __init__(self, table, shape) -> None:
        for name, dtype in table.items():
            setattr(self, name, _field(dtype, shape))


@ti.data_oriented
class State:
    """All arrays of a batch. Taichi never frees fields, so batches of equal capacity share them (:func:`state`)."""

    owner: object = None
    """The batch that uses the arrays at present."""

    def __init__(self, capacity: Capacity) -> None:
        c = capacity
        self.world = Group(WORLD, (c.worlds,))
        self.pull = Group(PULL, (c.worlds,))
        self.body = Group(BODY, (c.worlds, c.bodies))
        self.member = Group(MEMBER, (c.worlds, c.members))
        self.contact = Group(CONTACT, (c.worlds, c.contacts))
        self.history = Group(HISTORY, (c.worlds, c.contacts))
        self.wall = Group(WALL, (c.worlds, c.walls))
        self.surface = Group(SURFACE, (c.worlds, c.surfaces))
        self.triangle = Group(TRIANGLE, (c.worlds, c.triangles))
        self.summary = Group(SUMMARY, (c.worlds,))
        self.grid = Group({"bucket": ti.i32}, (c.worlds, c.buckets))  # first body of each cell, -1: none
        self.mesh_cell = Group({"first": ti.i32}, (c.worlds, c.cells))  # where the cell's triangles begin
        self.mesh_item = Group({"triangle": ti.i32}, (c.worlds, c.cell_items))
        self.candidate = Group({"triangle": ti.i32}, (c.worlds, c.candidates))
        self.contact_law = CONTACT_LAWS[c.law]
        self.law_row = ti.types.struct(**dict.fromkeys(self.contact_law.columns, ti.f64))
        self.law = Group({"row": self.law_row}, (c.worlds, c.kinds * c.kinds))
        # Parameters of effects by contact class, and their memory of each contact (``effects/columns.py``).
        self.effects = c.effects
        room = (c.worlds, c.contacts, KEPT) if c.effects else (1, 1, 1)
        self.effect = Group({"row": ti.f64}, (c.worlds, c.kinds * c.kinds, COLUMNS[-1] + 1))
        self.memory = Group({"number": ti.f64, "kept": ti.f64}, room)
        self.sharing = c.sharing
        if c.sharing:
            self.pair = Group(PAIR, (c.worlds, c.contacts))
            # Scratch of the list build: first entry of the current body with each partner.
            self.lead = Group({"body": ti.i32, "wall": ti.i32}, (c.worlds, max(c.bodies, c.walls)))
        # Allocate now: Taichi allocates at most 1024 fields at once, and kernels depend on what was allocated before.
        ti.sync()


def _field(dtype, shape):
    if hasattr(dtype, "field"):
        return dtype.field(shape=shape)
    return ti.field(dtype, shape=shape)


@cache
def state(capacity: Capacity) -> State:
    """Arrays of the given capacity: the same ones at every call, so only one batch of a capacity can be in use."""
    return State(capacity)
