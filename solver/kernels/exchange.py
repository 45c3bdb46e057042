"""Everything that crosses between NumPy and the arrays of a batch: one small kernel per errand."""

from solver.backend import serial, ti
from solver.effects.air_drag import shape_factors
from solver.kernels.geometry import rotation
from solver.kernels.sleep import rouse_all
from solver.state import Ints3, Mat3, Vec3, Vec4, Vec5

Table = ti.types.ndarray(dtype=ti.f64, ndim=2)
Row = ti.types.ndarray(dtype=ti.f64, ndim=1)
IntTable = ti.types.ndarray(dtype=ti.i32, ndim=2)
IntRow = ti.types.ndarray(dtype=ti.i32, ndim=1)


@ti.func
def triple(table: ti.template(), row, column):
    """Three neighbouring cells of a row as a vector."""
    return Vec3(table[row, column], table[row, column + 1], table[row, column + 2])


@ti.func
def disturb(s: ti.template(), w):
    """Wake every body and build the contact list again at the next step."""
    rouse_all(s, w)
    s.world.moved[w] = s.world.skin[w]


@ti.kernel
def load_world(s: ti.template(), w: ti.i32, settings: Row):
    """Empty world ``w`` and set it up; the columns of ``settings`` are those of ``world.SETTINGS``."""
    s.world.dt[w] = settings[0]
    s.world.skin[w] = settings[1]
    s.world.cell[w] = settings[2]
    s.world.sleep_speed[w] = settings[3]
    s.world.sleep_time[w] = settings[4]
    s.world.domain[w] = settings[5]
    s.world.outlet[w] = settings[6]
    s.world.inlet_radius[w] = settings[7]
    s.world.gravity[w] = Vec3(settings[8], settings[9], settings[10])
    s.world.grip[w] = 0.0
    s.world.moved[w] = settings[1]
    s.world.bodies[w] = 0
    s.world.walls[w] = 0
    s.world.primitives[w] = 0
    s.world.contacts[w] = 0
    s.world.candidates[w] = 0
    s.world.live[w] = 0
    s.world.awake[w] = 0
    s.world.border[w] = 0
    s.world.stirred[w] = 1
    s.world.rebuilds[w] = 0
    s.world.overflow[w] = 0
    s.world.overlap[w] = 0.0
    s.world.dissipated[w] = 0.0
    s.world.wall_work[w] = 0.0
    s.world.taken_out[w] = 0.0


@ti.kernel
def load_bodies(s: ti.template(), w: ti.i32, numbers: Table, places: IntTable, spheres: Table, owner: IntTable):
    """All bodies that will enter, by the columns of ``layout.Layout``: numbers, places, spheres (x y z r), owner."""
    s.world.loaded[w] = numbers.shape[0]
    ti.loop_config(serialize=ti.static(serial()))
    for b in range(numbers.shape[0]):
        s.body.mass[w, b] = numbers[b, 0]
        s.body.inertia[w, b] = triple(numbers, b, 1)
        s.body.inverse_mass[w, b] = 1.0 / numbers[b, 0]
        s.body.inverse_inertia[w, b] = 1.0 / triple(numbers, b, 1)
        s.body.reach[w, b] = numbers[b, 4]
        s.body.semi_axes[w, b] = triple(numbers, b, 5)
        s.body.diameter[w, b] = numbers[b, 8]
        s.body.drag_factors[w, b] = shape_factors(numbers[b, 9])
        s.body.swing[w, b] = 0.0
        s.body.first[w, b] = places[b, 0]
        s.body.members[w, b] = places[b, 1]
        s.body.kind[w, b] = places[b, 2]
        s.body.alive[w, b] = 0
        s.body.asleep[w, b] = 0
        s.body.listed[w, b] = 0
        s.body.touching[w, b] = 0
    ti.loop_config(serialize=ti.static(serial()))
    for m in range(spheres.shape[0]):
        s.member.local[w, m] = triple(spheres, m, 0)
        s.member.radius[w, m] = spheres[m, 3]
        s.member.body[w, m] = owner[m, 0]
        s.body.swing[w, owner[m, 0]] = ti.max(s.body.swing[w, owner[m, 0]], s.member.local[w, m].norm())


@ti.kernel
def load_walls(s: ti.template(), w: ti.i32, poses: Table, marks: IntTable, grids: Table, cells: IntTable):
    """Walls at rest. poses: origin, quaternion; marks: kind, active; grids: low, cell; cells: counts (3), first."""
    s.world.walls[w] = poses.shape[0]
    ti.loop_config(serialize=ti.static(serial()))
    for k in range(poses.shape[0]):
        s.wall.origin[w, k] = triple(poses, k, 0)
        s.wall.quaternion[w, k] = Vec4(poses[k, 3], poses[k, 4], poses[k, 5], poses[k, 6])
        s.wall.turn[w, k] = rotation(s.wall.quaternion[w, k])
        s.wall.velocity[w, k] = Vec3(0.0, 0.0, 0.0)
        s.wall.omega[w, k] = Vec3(0.0, 0.0, 0.0)
        s.wall.moving[w, k] = 0
        s.wall.extent[w, k] = 0.0
        s.wall.travel[w, k] = 0.0
        s.wall.force[w, k] = Vec3(0.0, 0.0, 0.0)
        s.wall.torque[w, k] = Vec3(0.0, 0.0, 0.0)
        s.wall.kind[w, k] = marks[k, 0]
        s.wall.active[w, k] = marks[k, 1]
        s.wall.low[w, k] = triple(grids, k, 0)
        s.wall.cell[w, k] = grids[k, 3]
        s.wall.cells[w, k] = Ints3(cells[k, 0], cells[k, 1], cells[k, 2])
        s.wall.first_cell[w, k] = cells[k, 3]


@ti.kernel
def load_surfaces(s: ti.template(), w: ti.i32, geometry: Table, marks: IntTable, primitives: ti.i32):
    """What spheres can touch, the ``primitives`` first; marks: shape, wall."""
    s.world.primitives[w] = primitives
    ti.loop_config(serialize=ti.static(serial()))
    for p in range(geometry.shape[0]):
        s.surface.geometry[w, p] = Vec4(geometry[p, 0], geometry[p, 1], geometry[p, 2], geometry[p, 3])
        s.surface.shape[w, p] = marks[p, 0]
        s.surface.wall[w, p] = marks[p, 1]


@ti.kernel
def load_triangles(s: ti.template(), w: ti.i32, corners: Table, guards: Table, marks: IntTable):
    """Triangles of all meshes. corners: a, b, c; guards: a row per edge; marks: surface, edges (3), corners (3)."""
    ti.loop_config(serialize=ti.static(serial()))
    for t in range(corners.shape[0]):
        s.triangle.a[w, t] = triple(corners, t, 0)
        s.triangle.b[w, t] = triple(corners, t, 3)
        s.triangle.c[w, t] = triple(corners, t, 6)
        one, two, three = triple(guards, t, 0), triple(guards, t, 3), triple(guards, t, 6)
        s.triangle.guards[w, t] = Mat3([one, two, three])
        s.triangle.surface[w, t] = marks[t, 0]
        s.triangle.edges[w, t] = Ints3(marks[t, 1], marks[t, 2], marks[t, 3])
        s.triangle.corners[w, t] = Ints3(marks[t, 4], marks[t, 5], marks[t, 6])


@ti.kernel
def load_cells(s: ti.template(), w: ti.i32, first: IntRow, items: IntRow):
    """Cells of all meshes' grids: where each one's triangles begin (and where the last ones end), and the triangles."""
    ti.loop_config(serialize=ti.static(serial()))
    for c in range(first.shape[0]):
        s.mesh_cell.first[w, c] = first[c]
    ti.loop_config(serialize=ti.static(serial()))
    for k in range(items.shape[0]):
        s.mesh_item.triangle[w, k] = items[k]


@ti.kernel
def load_law(s: ti.template(), w: ti.i32, table: Table, kinds: ti.i32):
    """Contact constants of every pair of kinds, shape (kinds², 5), row a · kinds + b."""
    s.world.kinds[w] = kinds
    rouse_all(s, w)
    ti.loop_config(serialize=ti.static(serial()))
    for k in range(table.shape[0]):
        s.law.row[w, k] = Vec5(table[k, 0], table[k, 1], table[k, 2], table[k, 3], table[k, 4])


@ti.kernel
def load_effects(s: ti.template(), w: ti.i32, table: Table, grip: ti.f64):
    """Parameters of the effects of every pair of kinds, row a · kinds + b, and how far apart [m] a pull may hold."""
    rouse_all(s, w)
    # A cell is as long as the largest body, the skin and the grip.
    s.world.cell[w] = s.world.cell[w] + (grip - s.world.grip[w])
    s.world.grip[w] = grip
    s.world.moved[w] = s.world.skin[w]
    ti.loop_config(serialize=ti.static(serial()))
    for k in range(table.shape[0]):
        for column in range(table.shape[1]):
            s.effect.row[w, k, column] = table[k, column]


@ti.kernel
def load_state(s: ti.template(), w: ti.i32, b: ti.i32, pose: Row):
    """Let body ``b`` enter; pose: position (3), quaternion wxyz (4), velocity (3), spin in the principal frame (3)."""
    s.body.position[w, b] = Vec3(pose[0], pose[1], pose[2])
    s.body.quaternion[w, b] = Vec4(pose[3], pose[4], pose[5], pose[6])
    s.body.velocity[w, b] = Vec3(pose[7], pose[8], pose[9])
    s.body.spin[w, b] = Vec3(pose[10], pose[11], pose[12])
    s.body.force[w, b] = Vec3(0.0, 0.0, 0.0)
    s.body.torque[w, b] = Vec3(0.0, 0.0, 0.0)
    s.body.travel[w, b] = 0.0
    s.body.quiet[w, b] = 0.0
    s.body.asleep[w, b] = 0
    s.body.listed[w, b] = 0
    s.body.alive[w, b] = 1
    s.world.bodies[w] = ti.max(s.world.bodies[w], b + 1)
    s.world.moved[w] = s.world.skin[w]


@ti.kernel
def set_active(s: ti.template(), w: ti.i32, wall: ti.i32, active: ti.i32):
    """Switch a wall on or off (a gate)."""
    s.wall.active[w, wall] = active
    disturb(s, w)


@ti.kernel
def set_container(s: ti.template(), w: ti.i32, height: ti.f64, radius: ti.f64):
    """What counts as inside the rig: above ``height`` [m] and within ``radius`` [m] of the z axis."""
    s.world.outlet[w] = height
    s.world.inlet_radius[w] = radius


@ti.kernel
def set_motion(s: ti.template(), w: ti.i32, wall: ti.i32, motion: Row):
    """Let a wall move; motion: velocity (3), angular velocity in the world (3), extent [m]."""
    s.wall.velocity[w, wall] = Vec3(motion[0], motion[1], motion[2])
    s.wall.omega[w, wall] = Vec3(motion[3], motion[4], motion[5])
    s.wall.extent[w, wall] = motion[6]
    s.wall.moving[w, wall] = 0
    for d in ti.static(range(6)):
        if motion[d] != 0.0:
            s.wall.moving[w, wall] = 1
    disturb(s, w)


@ti.kernel
def set_gravity(s: ti.template(), w: ti.i32, x: ti.f64, y: ti.f64, z: ti.f64):
    """Replace gravity [m/s²]."""
    s.world.gravity[w] = Vec3(x, y, z)
    rouse_all(s, w)


@ti.kernel
def set_time_step(s: ti.template(), w: ti.i32, dt: ti.f64):
    """Replace the time step [s]."""
    s.world.dt[w] = dt


@ti.kernel
def set_sleep(s: ti.template(), w: ti.i32, speed: ti.f64, time: ti.f64):
    """Replace the speed [m/s] and time [s] at which bodies fall asleep, and wake all of them."""
    s.world.sleep_speed[w] = speed
    s.world.sleep_time[w] = time
    rouse_all(s, w)


@ti.kernel
def scale_springs(s: ti.template(), w: ti.i32, ratio: Row):
    """Multiply tangential springs by the ``ratio`` of their row of the law table: a spring keeps its displacement."""
    ti.loop_config(serialize=ti.static(serial()))
    for k in range(s.world.contacts[w]):
        s.contact.spring[w, k] = s.contact.spring[w, k] * ratio[s.contact.law[w, k]]


@ti.kernel
def read_bodies(s: ti.template(), w: ti.i32, out: Table):
    """Per body: position (3), quaternion (4), velocity (3), spin (3), alive, touching contacts, asleep."""
    ti.loop_config(serialize=ti.static(serial()))
    for b in range(out.shape[0]):
        for d in ti.static(range(3)):
            out[b, d] = s.body.position[w, b][d]
            out[b, 7 + d] = s.body.velocity[w, b][d]
            out[b, 10 + d] = s.body.spin[w, b][d]
        for d in ti.static(range(4)):
            out[b, 3 + d] = s.body.quaternion[w, b][d]
        out[b, 13] = ti.cast(s.body.alive[w, b], ti.f64)
        out[b, 14] = ti.cast(s.body.touching[w, b], ti.f64)
        out[b, 15] = ti.cast(s.body.asleep[w, b], ti.f64)


@ti.kernel
def read_walls(s: ti.template(), w: ti.i32, out: Table):
    """Per wall: origin (3), quaternion (4), velocity (3), angular velocity (3), force (3), torque (3)."""
    ti.loop_config(serialize=ti.static(serial()))
    for k in range(out.shape[0]):
        for d in ti.static(range(3)):
            out[k, d] = s.wall.origin[w, k][d]
            out[k, 7 + d] = s.wall.velocity[w, k][d]
            out[k, 10 + d] = s.wall.omega[w, k][d]
            out[k, 13 + d] = s.wall.force[w, k][d]
            out[k, 16 + d] = s.wall.torque[w, k][d]
        for d in ti.static(range(4)):
            out[k, 3 + d] = s.wall.quaternion[w, k][d]


@ti.kernel
def read_summary(s: ti.template(), out: Table):
    """One row per world, columns as in ``world.SUMMARY_COLUMNS``."""
    ti.loop_config(serialize=ti.static(serial()))
    for w in range(out.shape[0]):
        out[w, 0] = s.summary.kinetic[w]
        out[w, 1] = s.summary.elastic[w]
        out[w, 2] = s.summary.potential[w]
        out[w, 3] = s.summary.speed[w]
        out[w, 4] = s.summary.funnel_speed[w]
        out[w, 5] = s.summary.discharged[w]
        out[w, 6] = s.summary.in_funnel[w]
        out[w, 7] = ti.cast(s.summary.hanging[w], ti.f64)
        out[w, 8] = ti.cast(s.summary.touching[w], ti.f64)
        out[w, 9] = ti.cast(s.summary.finite[w], ti.f64)
        out[w, 10] = ti.cast(s.world.overflow[w], ti.f64)
        out[w, 11] = s.world.overlap[w]
        out[w, 12] = ti.cast(s.world.rebuilds[w], ti.f64)
        out[w, 13] = ti.cast(s.world.contacts[w], ti.f64)
        out[w, 14] = ti.cast(s.summary.asleep[w], ti.f64)
        out[w, 15] = s.world.dissipated[w]
        out[w, 16] = s.world.wall_work[w]
        out[w, 17] = s.world.taken_out[w]


@ti.kernel
def clear_overlap(s: ti.template(), w: ti.i32):
    """Start looking for the largest overlap anew."""
    s.world.overlap[w] = 0.0
