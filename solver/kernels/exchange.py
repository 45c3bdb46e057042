"""Everything that crosses between NumPy and the arrays of a batch: one small kernel per errand."""

from solver.backend import ti
from solver.state import Vec3, Vec4, Vec5

Table = ti.types.ndarray(dtype=ti.f64, ndim=2)
Row = ti.types.ndarray(dtype=ti.f64, ndim=1)
IntTable = ti.types.ndarray(dtype=ti.i32, ndim=2)
Cube = ti.types.ndarray(dtype=ti.f64, ndim=3)


@ti.func
def triple(table: ti.template(), row, column):
    """Three neighbouring cells of a row as a vector."""
    return Vec3(table[row, column], table[row, column + 1], table[row, column + 2])


@ti.kernel
def load_world(world: ti.template(), w: ti.i32, settings: Row):
    """Empty world ``w`` and set it up; settings = dt, skin, domain, outlet, inlet radius, gravity (3)."""
    world.dt[w] = settings[0]
    world.skin[w] = settings[1]
    world.domain[w] = settings[2]
    world.outlet[w] = settings[3]
    world.inlet_radius[w] = settings[4]
    world.gravity[w] = Vec3(settings[5], settings[6], settings[7])
    world.moved[w] = settings[1]
    world.bodies[w] = 0
    world.surfaces[w] = 0
    world.contacts[w] = 0
    world.rebuilds[w] = 0
    world.overflow[w] = 0
    world.overlap[w] = 0.0


@ti.kernel
def load_bodies(
    body: ti.template(),
    member: ti.template(),
    w: ti.i32,
    numbers: Table,
    places: IntTable,
    spheres: Table,
    owner: IntTable,
):
    """All bodies that will enter. numbers: mass, inertia (3), reach; places: first, members, kind; spheres: x y z r."""
    for b in range(numbers.shape[0]):
        body.mass[w, b] = numbers[b, 0]
        body.inertia[w, b] = triple(numbers, b, 1)
        body.reach[w, b] = numbers[b, 4]
        body.first[w, b] = places[b, 0]
        body.members[w, b] = places[b, 1]
        body.kind[w, b] = places[b, 2]
        body.alive[w, b] = 0
        body.listed[w, b] = 0
        body.touching[w, b] = 0
    for m in range(spheres.shape[0]):
        member.local[w, m] = triple(spheres, m, 0)
        member.radius[w, m] = spheres[m, 3]
        member.body[w, m] = owner[m, 0]


@ti.kernel
def load_surfaces(world: ti.template(), surface: ti.template(), w: ti.i32, geometry: Table, marks: IntTable):
    """Surfaces of the rig; marks: shape, kind, active."""
    world.surfaces[w] = geometry.shape[0]
    for s in range(geometry.shape[0]):
        surface.geometry[w, s] = Vec4(geometry[s, 0], geometry[s, 1], geometry[s, 2], geometry[s, 3])
        surface.shape[w, s] = marks[s, 0]
        surface.kind[w, s] = marks[s, 1]
        surface.active[w, s] = marks[s, 2]


@ti.kernel
def load_law(law: ti.template(), w: ti.i32, table: Cube):
    """Contact constants of every pair of kinds, shape (kinds, kinds, 5)."""
    for a in range(table.shape[0]):
        for b in range(table.shape[1]):
            law.pair[w, a, b] = Vec5(table[a, b, 0], table[a, b, 1], table[a, b, 2], table[a, b, 3], table[a, b, 4])


@ti.kernel
def load_state(world: ti.template(), body: ti.template(), w: ti.i32, b: ti.i32, pose: Row):
    """Let body ``b`` enter; pose: position (3), quaternion wxyz (4), velocity (3), spin in the principal frame (3)."""
    body.position[w, b] = Vec3(pose[0], pose[1], pose[2])
    body.quaternion[w, b] = Vec4(pose[3], pose[4], pose[5], pose[6])
    body.velocity[w, b] = Vec3(pose[7], pose[8], pose[9])
    body.spin[w, b] = Vec3(pose[10], pose[11], pose[12])
    body.force[w, b] = Vec3(0.0, 0.0, 0.0)
    body.torque[w, b] = Vec3(0.0, 0.0, 0.0)
    body.travel[w, b] = 0.0
    body.listed[w, b] = 0
    body.alive[w, b] = 1
    world.bodies[w] = ti.max(world.bodies[w], b + 1)
    world.moved[w] = world.skin[w]


@ti.kernel
def set_active(world: ti.template(), surface: ti.template(), w: ti.i32, s: ti.i32, active: ti.i32):
    """Switch a surface on or off (a gate)."""
    surface.active[w, s] = active
    world.moved[w] = world.skin[w]


@ti.kernel
def set_container(world: ti.template(), w: ti.i32, height: ti.f64, radius: ti.f64):
    """What counts as inside the rig: above ``height`` [m] and within ``radius`` [m] of the z axis."""
    world.outlet[w] = height
    world.inlet_radius[w] = radius


@ti.kernel
def set_time_step(world: ti.template(), w: ti.i32, dt: ti.f64):
    """Replace the time step [s]."""
    world.dt[w] = dt


@ti.kernel
def scale_springs(
    world: ti.template(),
    body: ti.template(),
    member: ti.template(),
    contact: ti.template(),
    w: ti.i32,
    ratio: Table,
):
    """Multiply tangential springs of pairs of kinds (a, b) by ``ratio[a, b]``: a spring keeps its displacement."""
    for k in range(world.contacts[w]):
        contact.spring[w, k] *= ratio[body.kind[w, member.body[w, contact.i[w, k]]], contact.kind[w, k]]


@ti.kernel
def read_bodies(body: ti.template(), w: ti.i32, out: Table):
    """Per body: position (3), quaternion (4), velocity (3), spin (3), alive, touching contacts with other bodies."""
    for b in range(out.shape[0]):
        for d in ti.static(range(3)):
            out[b, d] = body.position[w, b][d]
            out[b, 7 + d] = body.velocity[w, b][d]
            out[b, 10 + d] = body.spin[w, b][d]
        for d in ti.static(range(4)):
            out[b, 3 + d] = body.quaternion[w, b][d]
        out[b, 13] = ti.cast(body.alive[w, b], ti.f64)
        out[b, 14] = ti.cast(body.touching[w, b], ti.f64)


@ti.kernel
def read_summary(world: ti.template(), summary: ti.template(), out: Table):
    """One row per world, columns as in ``world.SUMMARY_COLUMNS``."""
    for w in range(out.shape[0]):
        out[w, 0] = summary.kinetic[w]
        out[w, 1] = summary.elastic[w]
        out[w, 2] = summary.potential[w]
        out[w, 3] = summary.speed[w]
        out[w, 4] = summary.funnel_speed[w]
        out[w, 5] = summary.discharged[w]
        out[w, 6] = summary.in_funnel[w]
        out[w, 7] = ti.cast(summary.hanging[w], ti.f64)
        out[w, 8] = ti.cast(summary.touching[w], ti.f64)
        out[w, 9] = ti.cast(summary.finite[w], ti.f64)
        out[w, 10] = ti.cast(world.overflow[w], ti.f64)
        out[w, 11] = world.overlap[w]
        out[w, 12] = ti.cast(world.rebuilds[w], ti.f64)
        out[w, 13] = ti.cast(world.contacts[w], ti.f64)


@ti.kernel
def clear_overlap(world: ti.template(), w: ti.i32):
    """Start looking for the largest overlap anew."""
    world.overlap[w] = 0.0
