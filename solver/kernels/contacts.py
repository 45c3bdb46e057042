"""Forces of all contacts of one world, each pair once and in the order of the list (so the bits repeat)."""

from solver.backend import ti
from solver.kernels.walls import from_patch, from_primitive, surface_velocity
from solver.laws.hertz_mindlin import (
    normal_damper,
    normal_force,
    normal_spring_force,
    spring_energy,
    spring_energy_gain,
    tangential_force,
)
from solver.state import Vec3, Vec4


@ti.func
def meet_surface(s: ti.template(), w, k):
    """Normal and overlap of entry ``k`` of the list, which is one with a surface: (nx, ny, nz, overlap)."""
    i = s.contact.i[w, k]
    p = s.contact.j[w, k] - s.member.body.shape[1]
    hit = Vec4(0.0, 0.0, 0.0, 0.0)
    if s.surface.shape[w, p] < 2:
        hit = from_primitive(s, w, p, s.member.centre[w, i])
    else:
        wall = s.surface.wall[w, p]
        hit = from_patch(s, w, wall, s.contact.first[w, k], s.contact.triangles[w, k], s.member.centre[w, i])
    return Vec4(hit[0], hit[1], hit[2], s.member.radius[w, i] - hit[3])


@ti.func
def meet(s: ti.template(), w, k):
    """Normal from j to i and overlap [m] of entry ``k``: (nx, ny, nz, overlap); the overlap is ≤ 0 when apart."""
    i, j = s.contact.i[w, k], s.contact.j[w, k]
    found = Vec4(0.0, 0.0, 0.0, -1.0)
    if j < s.member.body.shape[1]:
        gap = s.member.centre[w, i] - s.member.centre[w, j]
        reach = s.member.radius[w, i] + s.member.radius[w, j]
        distance2 = gap.dot(gap)
        if distance2 < reach * reach and distance2 > 0.0:
            distance = ti.sqrt(distance2)
            n = (1.0 / distance) * gap
            found = Vec4(n[0], n[1], n[2], reach - distance)
    else:
        found = meet_surface(s, w, k)
    return found


@ti.func
def lose(s: ti.template(), w, k, law):
    """Entry ``k`` has come apart: its spring is gone, and so is the energy in it."""
    s.world.dissipated[w] += spring_energy(law, s.contact.spring[w, k].norm_sqr(), s.contact.radius[w, k])
    s.contact.radius[w, k] = 0.0
    s.contact.spring[w, k] = Vec3(0.0, 0.0, 0.0)
    s.contact.loss[w, k] = Vec3(0.0, 0.0, 0.0)


@ti.func
def push_wall(s: ti.template(), w, k, point, force, held):
    """Take the reaction to ``force`` [N] on a body at ``point`` into the sums of wall ``k``, and the wall's work."""
    torque = (point - s.wall.origin[w, k]).cross(force)
    s.wall.force[w, k] -= force
    s.wall.torque[w, k] -= torque
    if held:
        s.wall.held[w, k] -= force
        s.wall.held_torque[w, k] -= torque
    elif s.wall.moving[w, k] == 1:
        s.world.wall_work[w] += s.world.dt[w] * force.dot(surface_velocity(s, w, k, point))


@ti.func
def push(s: ti.template(), w):
    """Add the force and torque of every live entry that touches to its bodies; keep springs and contact radii.

    The list is ordered by the first body, so its sum stays in registers until the next one comes. After a change of
    who is awake the entries in which nothing moves follow the live ones once: they hold the sleepers.
    """
    dt, largest, dissipated = s.world.dt[w], s.world.overlap[w], 0.0
    present = -1
    force_sum, torque_sum = Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0)
    live, entries = s.world.live[w], s.world.live[w]
    if s.world.stirred[w] == 1:
        entries = s.world.contacts[w]
    for item in range(entries):
        k = s.contact.live[w, item]
        hit = meet(s, w, k)
        overlap = hit[3]
        if overlap > 0.0:
            a, b, i = s.contact.a[w, k], s.contact.b[w, k], s.contact.i[w, k]
            law = s.law.row[w, s.contact.law[w, k]]
            radius = s.member.radius[w, i]
            if overlap > largest * radius:
                largest = overlap / radius
            n = Vec3(hit[0], hit[1], hit[2])
            point = s.member.centre[w, i] - n * (radius - 0.5 * overlap)
            arm, other_arm = point - s.body.position[w, a], Vec3(0.0, 0.0, 0.0)
            velocity = s.body.velocity[w, a] + s.body.omega[w, a].cross(arm)
            if b >= 0:
                other_arm = point - s.body.position[w, b]
                velocity -= s.body.velocity[w, b] + s.body.omega[w, b].cross(other_arm)
            else:
                velocity -= surface_velocity(s, w, -1 - b, point)
            v_n = velocity.dot(n)
            v_t = velocity - v_n * n
            mass = s.contact.reduced_mass[w, k]
            contact_radius = ti.sqrt(s.contact.reduced_radius[w, k] * overlap)
            inertia = ti.sqrt(contact_radius * mass)
            elastic = normal_spring_force(law, contact_radius, overlap)
            before = s.contact.radius[w, k]
            damper = normal_damper(law, inertia, before, overlap, v_n, dt)
            expected = v_n
            if before > 0.0:
                expected = s.contact.expected[w, k]
            f_n = normal_force(elastic, damper, v_n, expected, mass, dt)
            old, last_loss = s.contact.spring[w, k], s.contact.loss[w, k]
            spring, f_t = tangential_force(law, contact_radius, before, old, n, v_t, inertia, f_n, dt)
            force = f_n * n + f_t
            # Work against the damper and the tangential force, at the mean of the velocities before and after the
            # step: half of it now, half when the next velocity is known; less what has gone into the spring.
            loss = (elastic - f_n) * n - f_t
            dissipated += 0.5 * dt * (loss + last_loss).dot(velocity)
            dissipated -= spring_energy_gain(law, old.norm_sqr(), before, spring.norm_sqr(), contact_radius)
            s.contact.spring[w, k] = spring
            s.contact.radius[w, k] = contact_radius
            s.contact.expected[w, k] = v_n + dt * f_n / mass
            s.contact.loss[w, k] = loss
            if b < 0:
                push_wall(s, w, -1 - b, point, force, item >= live)
            if item >= live:
                s.body.held[w, a] += force
                s.body.held_torque[w, a] += arm.cross(force)
                if b >= 0:
                    s.body.held[w, b] -= force
                    s.body.held_torque[w, b] -= other_arm.cross(force)
                force = Vec3(0.0, 0.0, 0.0)
            if a != present:
                if present >= 0:
                    s.body.force[w, present] += force_sum
                    s.body.torque[w, present] += torque_sum
                present = a
                force_sum, torque_sum = Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0)
            force_sum += force
            torque_sum += arm.cross(force)
            if b >= 0:
                s.body.force[w, b] -= force
                s.body.torque[w, b] -= other_arm.cross(force)
        elif s.contact.radius[w, k] > 0.0:
            lose(s, w, k, s.law.row[w, s.contact.law[w, k]])
    if present >= 0:
        s.body.force[w, present] += force_sum
        s.body.torque[w, present] += torque_sum
    s.world.overlap[w] = largest
    s.world.dissipated[w] += dissipated
