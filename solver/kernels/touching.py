"""The contacts of a world as they are: read, and nothing changed."""

from solver.backend import serial, ti
from solver.effects.columns import HERTZ
from solver.kernels.contacts import scale_of
from solver.kernels.meeting import lasts, meet
from solver.state import Vec3

Table = ti.types.ndarray(dtype=ti.f64, ndim=2)
IntRow = ti.types.ndarray(dtype=ti.i32, ndim=1)


@ti.kernel
def read_contacts(s: ti.template(), world: ti.i32, out: Table, count: IntRow):
    """One row per acting contact: body a, body b or -1 - wall, point (3), normal from b to a (3), force on a (3).

    The force is that of the last step: the elastic part along the normal, less the part that takes energy
    (``contact.loss``), which holds damping and friction. ``count[0]`` says how many rows are filled.
    """
    ti.loop_config(serialize=ti.static(serial()))
    for w in range(world, world + 1):
        found = 0
        for k in range(s.world.contacts[w]):
            if s.contact.radius[w, k] > 0.0:
                hit = meet(s, w, k)
                overlap = hit[3]
                if lasts(s, w, k, overlap):
                    i, a = s.contact.i[w, k], s.contact.a[w, k]
                    n = Vec3(hit[0], hit[1], hit[2])
                    point = s.member.centre[w, i] - n * (s.member.radius[w, i] - 0.5 * overlap)
                    hertz = s.contact.radius[w, k]
                    if ti.static(s.effects):
                        hertz = s.memory.number[w, k, HERTZ]
                    pressed = hertz * hertz / s.contact.reduced_radius[w, k]
                    law = s.law.row[w, s.contact.law[w, k]]
                    elastic = s.contact_law.normal_spring_force(law, scale_of(s, w, k, law), hertz, pressed)
                    force = elastic * n - s.contact.loss[w, k]
                    out[found, 0] = ti.cast(a, ti.f64)
                    out[found, 1] = ti.cast(s.contact.b[w, k], ti.f64)
                    for d in ti.static(range(3)):
                        out[found, 2 + d] = point[d]
                        out[found, 5 + d] = n[d]
                        out[found, 8 + d] = force[d]
                    found += 1
        count[0] = found
