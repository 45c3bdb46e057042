"""Forces of all contacts of one world, each pair once and in the order of the list (so the bits repeat)."""

from solver.backend import ti
from solver.kernels.geometry import nearest
from solver.laws.hertz_mindlin import elastic_energy, normal_force, tangential_force
from solver.state import Vec3, Vec4


@ti.func
def meet(member: ti.template(), surface: ti.template(), w, i, j):
    """Normal from j to i and overlap [m] of an entry: (nx, ny, nz, overlap); the overlap is ≤ 0 when apart."""
    capacity = member.body.shape[1]
    radius = member.radius[w, i]
    found = Vec4(0.0, 0.0, 0.0, -1.0)
    if j < capacity:
        gap = member.centre[w, i] - member.centre[w, j]
        reach = radius + member.radius[w, j]
        distance2 = gap.dot(gap)
        if distance2 < reach * reach and distance2 > 0.0:
            distance = ti.sqrt(distance2)
            n = (1.0 / distance) * gap
            found = Vec4(n[0], n[1], n[2], reach - distance)
    else:
        s = j - capacity
        if surface.active[w, s] == 1:
            hit = nearest(surface.shape[w, s], surface.geometry[w, s], member.centre[w, i])
            found = Vec4(hit[0], hit[1], hit[2], radius - hit[3])
    return found


@ti.func
def push(
    world: ti.template(),
    body: ti.template(),
    member: ti.template(),
    contact: ti.template(),
    surface: ti.template(),
    law: ti.template(),
    w,
):
    """Add the force and torque of every touching entry to its bodies; keep springs and contact radii."""
    capacity = member.body.shape[1]
    dt, largest = world.dt[w], world.overlap[w]
    for k in range(world.contacts[w]):
        i, j = contact.i[w, k], contact.j[w, k]
        hit = meet(member, surface, w, i, j)
        overlap = hit[3]
        if overlap > 0.0:
            n = Vec3(hit[0], hit[1], hit[2])
            radius = member.radius[w, i]
            if overlap > largest * radius:
                largest = overlap / radius
            a, b = member.body[w, i], -1
            point = member.centre[w, i] - n * (radius - 0.5 * overlap)
            arm, other_arm = point - body.position[w, a], Vec3(0.0, 0.0, 0.0)
            velocity = body.velocity[w, a] + body.omega[w, a].cross(arm)
            if j < capacity:
                b = member.body[w, j]
                other_arm = point - body.position[w, b]
                velocity -= body.velocity[w, b] + body.omega[w, b].cross(other_arm)
            pair = law.pair[w, body.kind[w, a], contact.kind[w, k]]
            v_n = velocity.dot(n)
            contact_radius = ti.sqrt(contact.reduced_radius[w, k] * overlap)
            inertia = ti.sqrt(contact_radius * contact.reduced_mass[w, k])
            f_n = normal_force(pair, contact_radius, overlap, inertia, v_n)
            spring, f_t = tangential_force(
                pair,
                contact_radius,
                contact.radius[w, k],
                contact.spring[w, k],
                n,
                velocity - v_n * n,
                inertia,
                f_n,
                dt,
            )
            contact.spring[w, k] = spring
            contact.radius[w, k] = contact_radius
            force = f_n * n + f_t
            body.force[w, a] += force
            body.torque[w, a] += arm.cross(force)
            if b >= 0:
                body.force[w, b] -= force
                body.torque[w, b] -= other_arm.cross(force)
        elif contact.radius[w, k] > 0.0:
            contact.radius[w, k] = 0.0
            contact.spring[w, k] = Vec3(0.0, 0.0, 0.0)
    world.overlap[w] = largest


@ti.func
def stored_energy(
    body: ti.template(), member: ti.template(), contact: ti.template(), surface: ti.template(), law: ti.template(), w, k
):
    """Elastic energy [J] of entry k; 0 when apart."""
    energy = 0.0
    i = contact.i[w, k]
    hit = meet(member, surface, w, i, contact.j[w, k])
    if hit[3] > 0.0:
        pair = law.pair[w, body.kind[w, member.body[w, i]], contact.kind[w, k]]
        energy = elastic_energy(pair, ti.sqrt(contact.reduced_radius[w, k] * hit[3]), hit[3], contact.spring[w, k])
    return energy
