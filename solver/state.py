"""Arrays of a batch of worlds: what the kernels read and write, each with its unit and shape.

Worlds are independent pours. Every array has the world as its leading axis; capacities are fixed when a batch is
allocated, and a world that outgrows them stops with the outcome ``buffer_overflow``.
"""

from dataclasses import dataclass
from functools import cache

from solver.backend import ti

Vec3 = ti.types.vector(3, ti.f64)
Vec4 = ti.types.vector(4, ti.f64)
Vec5 = ti.types.vector(5, ti.f64)
Mat3 = ti.types.matrix(3, 3, ti.f64)


WORLD = {
    "dt": ti.f64,  # time step [s]
    "gravity": Vec3,  # [m/s²]
    "skin": ti.f64,  # reach of the contact list beyond touching [m]
    "moved": ti.f64,  # largest travel of a body since the list was built [m]
    "bodies": ti.i32,  # bodies that have entered
    "surfaces": ti.i32,  # surfaces of the rig
    "contacts": ti.i32,  # entries of the contact list
    "rebuilds": ti.i32,  # how often the list was built
    "overflow": ti.i32,  # 1 once the contact list did not fit
    "overlap": ti.f64,  # largest overlap / member radius since it was cleared
    "domain": ti.f64,  # bodies beyond |x| or |y| of this are taken out [m]
    "outlet": ti.f64,  # height of the outlet [m]
    "inlet_radius": ti.f64,  # radius of the feed opening [m]
}
"""Per world, shape (worlds,)."""

BODY = {
    "mass": ti.f64,  # [kg]
    "inertia": Vec3,  # principal moments [kg m²]
    "position": Vec3,  # centre of mass [m], at the full step
    "quaternion": Vec4,  # orientation wxyz, at the full step
    "velocity": Vec3,  # [m/s], at the half step
    "spin": Vec3,  # angular velocity in the principal frame [rad/s], at the half step
    "rotation": Mat3,  # principal frame → world, valid while ``listed``
    "omega": Vec3,  # angular velocity in the world frame [rad/s], valid while ``listed``
    "force": Vec3,  # contact force [N]
    "torque": Vec3,  # contact torque about the centre of mass, world frame [N m]
    "reach": ti.f64,  # radius of the bounding sphere [m]
    "travel": ti.f64,  # bound on the motion of any of its points since the list was built [m]
    "first": ti.i32,  # index of the first member sphere
    "members": ti.i32,  # number of member spheres
    "kind": ti.i32,  # contact class
    "alive": ti.i32,  # 0: taken out of the world
    "listed": ti.i32,  # 1: has entries in the contact list
    "touching": ti.i32,  # number of touching contacts with other bodies, set by ``summarise``
    "low": Vec3,  # bounding box when the list was built [m]
    "high": Vec3,
    "near": ti.i32,  # scratch of the list build: bodies whose boxes overlap
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

HISTORY = {"i": ti.i32, "j": ti.i32, "spring": Vec3, "radius": ti.f64}
"""What a contact keeps when the list is built again, shape (worlds, contacts)."""

CONTACT = {
    "i": ti.i32,  # member sphere
    "j": ti.i32,  # the other member sphere (> i), or members' capacity + index of a surface
    "reduced_radius": ti.f64,  # R* = r_i r_j / (r_i + r_j), r_i against a surface [m]
    "reduced_mass": ti.f64,  # m* of the bodies, m_i against a surface [kg]
    "kind": ti.i32,  # contact class of j's body or surface
    "spring": Vec3,  # tangential elastic force on i [N]
    "radius": ti.f64,  # contact radius a = sqrt(R* δ) at the last step [m]; 0: apart
}
"""Per entry of the contact list, ordered by (i, j), shape (worlds, contacts)."""

SURFACE = {
    "shape": ti.i32,  # 0 plane z = geometry[0]; 1 revolved segment (r0, z0, r1, z1)
    "geometry": Vec4,  # [m]
    "kind": ti.i32,  # contact class
    "active": ti.i32,
}
"""Per surface, shape (worlds, surfaces)."""

SUMMARY = {
    "kinetic": ti.f64,  # kinetic energy [J]
    "elastic": ti.f64,  # energy in the contact springs [J]
    "potential": ti.f64,  # − m g·x [J]
    "speed": ti.f64,  # largest √(2 kinetic / mass) of the bodies outside the funnel that do not roll away [m/s]
    "funnel_speed": ti.f64,  # the same of the bodies in the funnel [m/s]
    "discharged": ti.f64,  # mass below the outlet or taken out [kg]
    "in_funnel": ti.f64,  # mass above the outlet [kg]
    "touching": ti.i32,  # touching contacts
    "hanging": ti.i32,  # bodies above the outlet
    "finite": ti.i32,  # 0 once a number is not finite
}
"""Per world, written by the kernel at the end of a launch, shape (worlds,)."""


@dataclass(frozen=True)
class Capacity:
    """Sizes of a batch. ``kinds`` counts contact classes (components and surface materials)."""

    worlds: int
    bodies: int
    members: int
    contacts: int
    surfaces: int = 4
    kinds: int = 6


@ti.data_oriented
class Group:
    """Fields that share an index: ``group.position[w, b]`` in a kernel."""

    def __init__(self, table, shape) -> None:
        for name, dtype in table.items():
            setattr(self, name, _field(dtype, shape))


class Arrays:
    """All arrays of a batch. Taichi never frees fields, so batches of one capacity share them (:func:`arrays`)."""

    def __init__(self, capacity: Capacity) -> None:
        c = capacity
        self.world = Group(WORLD, (c.worlds,))
        self.body = Group(BODY, (c.worlds, c.bodies))
        self.member = Group(MEMBER, (c.worlds, c.members))
        self.contact = Group(CONTACT, (c.worlds, c.contacts))
        self.history = Group(HISTORY, (c.worlds, c.contacts))
        self.surface = Group(SURFACE, (c.worlds, c.surfaces))
        self.summary = Group(SUMMARY, (c.worlds,))
        self.law = Group({"pair": Vec5}, (c.worlds, c.kinds, c.kinds))


def _field(dtype, shape):
    if hasattr(dtype, "field"):
        return dtype.field(shape=shape)
    return ti.field(dtype, shape=shape)


@cache
def arrays(capacity: Capacity) -> Arrays:
    """Arrays of that capacity; the same ones at every call, so only one batch of a capacity may live at a time."""
    return Arrays(capacity)
