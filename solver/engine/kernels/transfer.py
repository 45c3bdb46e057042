"""Transfer between NumPy and the arrays of a world, one small kernel per table or group of fields.

    load_…              a scene as tables → the arrays of an empty world
    read_…              the arrays of a world → rows of numbers
    pack…, unpack…      fields of a world → one row of numbers, and back

For a packed group, ``width`` is the number of columns per entry, and ``first`` the index in the row at which the group
begins.
"""

from solver.backend import serial, ti
from solver.effects.air_drag import shape_factors
from solver.engine.kernels.geometry import rotation
from solver.engine.state import WORLD, Ints3, Mat3, Vec3, Vec4

Table = ti.types.ndarray(dtype=ti.f64, ndim=2)
Row = ti.types.ndarray(dtype=ti.f64, ndim=1)
IntTable = ti.types.ndarray(dtype=ti.i32, ndim=2)
IntRow = ti.types.ndarray(dtype=ti.i32, ndim=1)

SETTINGS = (
    *("dt", "gravity", "skin", "cell", "sleep_speed", "sleep_time", "domain", "outlet", "inlet_radius"),
    *("clump_rule", "tangential_law", "tangential_dashpot"),
)
"""Fields of ``state.WORLD`` with which a world is set up."""
Settings = ti.types.struct(**{name: WORLD[name] for name in SETTINGS})


@ti.func
def triple(table: ti.template(), row, column):
    """Three adjacent columns of a row as a vector."""
    return Vec3(table[row, column], table[row, column + 1], table[row, column + 2])


@ti.kernel
def load_world(s: ti.template(), w: ti.i32, settings: Settings):
    """Empty world ``w`` and set it up."""
    s.world.dt[w] = settings.dt
    s.world.gravity[w] = settings.gravity
    s.world.skin[w] = settings.skin
    s.world.cell[w] = settings.cell
    s.world.sleep_speed[w] = settings.sleep_speed
    s.world.sleep_time[w] = settings.sleep_time
    s.world.domain[w] = settings.domain
    s.world.outlet[w] = settings.outlet
    s.world.inlet_radius[w] = settings.inlet_radius
    s.world.clump_rule[w] = settings.clump_rule
    s.world.tangential_law[w] = settings.tangential_law
    s.world.tangential_dashpot[w] = settings.tangential_dashpot
    s.world.grip[w] = 0.0
    s.pull.body[w] = 0
    s.pull.force[w] = Vec3(0.0, 0.0, 0.0)
    s.world.outdated[w] = 1
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
    """Load all bodies that will enter; columns of ``tables.BodyTables``: numbers, places, spheres (x y z r), owner."""
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
        s.body.has_left[w, b] = 0
        s.body.asleep[w, b] = 0
        s.body.listed[w, b] = 0
        s.body.touching[w, b] = 0
    ti.loop_config(serialize=ti.static(serial()))
    for m in range(spheres.shape[0]):
        s.member.local[w, m] = triple(spheres, m, 0)
        s.member.radius[w, m] = spheres[m, 3]
        s.member.body[w, m] = owner[m, 0]
        ti.atomic_max(s.body.swing[w, owner[m, 0]], s.member.local[w, m].norm())  # members of a body run in parallel


@ti.kernel
def load_walls(s: ti.template(), w: ti.i32, poses: Table, marks: IntTable, grids: Table, cells: IntTable):
    """Walls, at rest. poses: origin, quaternion; marks: kind, active; grids: low, cell; cells: counts (3), first."""
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
        s.wall.margin[w, k] = 0.0
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
    """Load the surfaces that spheres can touch, the ``primitives`` first; marks: shape, wall."""
    s.world.primitives[w] = primitives
    ti.loop_config(serialize=ti.static(serial()))
    for p in range(geometry.shape[0]):
        s.surface.geometry[w, p] = Vec4(geometry[p, 0], geometry[p, 1], geometry[p, 2], geometry[p, 3])
        s.surface.shape[w, p] = marks[p, 0]
        s.surface.wall[w, p] = marks[p, 1]


@ti.kernel
def load_triangles(s: ti.template(), w: ti.i32, corners: Table, guards: Table, marks: IntTable):
    """Load triangles of all meshes. corners: a, b, c; guards: row per edge; marks: surface, edges (3), corners (3)."""
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
    """Load cells of all meshes' grids: where the triangles of each begin (and those of the last end); the triangles."""
    ti.loop_config(serialize=ti.static(serial()))
    for c in range(first.shape[0]):
        s.mesh_cell.first[w, c] = first[c]
    ti.loop_config(serialize=ti.static(serial()))
    for k in range(items.shape[0]):
        s.mesh_item.triangle[w, k] = items[k]


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
def pack(fields: ti.template(), w: ti.i32, entries: ti.i32, width: ti.i32, first: ti.i32, row: Row):
    """Write the first ``entries`` entries of ``fields`` (of shape (worlds, …)) into ``row``."""
    ti.loop_config(serialize=ti.static(serial()))
    for k in range(entries):
        at = first + k * width
        for field in ti.static(fields):
            if ti.static(hasattr(field, "n")):
                for i, j in ti.static(ti.ndrange(field.n, field.m)):
                    if ti.static(field.m == 1):
                        row[at] = field[w, k][i]
                    else:
                        row[at] = field[w, k][i, j]
                    at += 1
            else:
                row[at] = ti.cast(field[w, k], ti.f64)
                at += 1


@ti.kernel
def unpack(fields: ti.template(), w: ti.i32, entries: ti.i32, width: ti.i32, first: ti.i32, row: Row):
    """Restore what :func:`pack` wrote."""
    ti.loop_config(serialize=ti.static(serial()))
    for k in range(entries):
        at = first + k * width
        for field in ti.static(fields):
            if ti.static(hasattr(field, "n")):
                for i, j in ti.static(ti.ndrange(field.n, field.m)):
                    if ti.static(field.m == 1):
                        field[w, k][i] = row[at]
                    else:
                        field[w, k][i, j] = row[at]
                    at += 1
            else:
                field[w, k] = ti.cast(row[at], field.dtype)
                at += 1


@ti.kernel
def pack_world(fields: ti.template(), w: ti.i32, row: Row):
    """Write the fields that exist once per world (``fields`` of shape (worlds,)) to the beginning of ``row``."""
    ti.loop_config(serialize=ti.static(serial()))
    for world in range(w, w + 1):
        at = 0
        for field in ti.static(fields):
            if ti.static(hasattr(field, "n")):
                for i in ti.static(range(field.n)):
                    row[at] = field[world][i]
                    at += 1
            else:
                row[at] = ti.cast(field[world], ti.f64)
                at += 1


@ti.kernel
def unpack_world(fields: ti.template(), w: ti.i32, row: Row):
    """Restore what :func:`pack_world` wrote."""
    ti.loop_config(serialize=ti.static(serial()))
    for world in range(w, w + 1):
        at = 0
        for field in ti.static(fields):
            if ti.static(hasattr(field, "n")):
                for i in ti.static(range(field.n)):
                    field[world][i] = row[at]
                    at += 1
            else:
                field[world] = ti.cast(row[at], field.dtype)
                at += 1


@ti.kernel
def pack_memory(number: ti.template(), w: ti.i32, entries: ti.i32, first: ti.i32, row: Row):
    """Write what effects keep of the first ``entries`` contacts (``number`` of shape (worlds, contacts, columns))."""
    ti.loop_config(serialize=ti.static(serial()))
    for k in range(entries):
        for column in range(number.shape[2]):
            row[first + k * number.shape[2] + column] = number[w, k, column]


@ti.kernel
def unpack_memory(number: ti.template(), w: ti.i32, entries: ti.i32, first: ti.i32, row: Row):
    """Restore what :func:`pack_memory` wrote."""
    ti.loop_config(serialize=ti.static(serial()))
    for k in range(entries):
        for column in range(number.shape[2]):
            number[w, k, column] = row[first + k * number.shape[2] + column]
