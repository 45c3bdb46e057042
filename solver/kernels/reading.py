"""The arrays of a world → rows of numbers: one small kernel per table."""

from solver.backend import serial, ti
from solver.kernels.tables import Table


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
