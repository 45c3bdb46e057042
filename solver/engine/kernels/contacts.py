"""Forces of all contacts of one world, each pair once and in the order of the list (so results repeat bit for bit).

:func:`push` adds them to the bodies; :func:`read_contacts` reads the contacts and changes nothing.
"""

from solver.backend import serial, ti
from solver.effects import Stage
from solver.effects.columns import COLUMNS, HERTZ
from solver.effects.touch import Touch
from solver.engine.kernels.effects import forget, keep, last_couple, pass_stage
from solver.engine.kernels.narrowphase import (
    BODY_MASS,
    SHARED,
    contact_point,
    lasts,
    local_mass,
    meet,
    share,
    shared_point,
    sum_pairs,
)
from solver.engine.kernels.transfer import IntRow, Table
from solver.engine.kernels.walls import surface_velocity
from solver.engine.state import Vec3
from solver.laws.law import normal_force, tangential_force

HELD_OVERLAP = 1e-45
"""Overlap [m] used for surfaces held at a gap: the resulting contact radius, 1e-24 m, carries and damps nothing."""
APART = 1e-20
"""Contact radius [m] below which surfaces are held at a gap and do not touch."""


@ti.func
def scale_of(s: ti.template(), w, k, law):
    """The contact law's ``scale`` for entry ``k``."""
    return s.contact_law.scale(law, s.contact.reduced_radius[w, k], s.contact.reduced_mass[w, k])


@ti.func
def lose(s: ti.template(), w, k, law):
    """Clear entry ``k``, whose surfaces have separated; the energy in its spring is dissipated."""
    spring2 = s.contact.spring[w, k].norm_sqr()
    energy = s.contact_law.shear_energy(law, scale_of(s, w, k, law), spring2, s.contact.radius[w, k])
    s.world.dissipated[w] = s.world.dissipated[w] + energy
    s.contact.radius[w, k] = 0.0
    s.contact.spring[w, k] = Vec3(0.0, 0.0, 0.0)
    s.contact.loss[w, k] = Vec3(0.0, 0.0, 0.0)
    if ti.static(s.effects):
        forget(s, w, k)


@ti.func
def push_wall(s: ti.template(), w, k, point, force, couple, held):
    """Add to wall ``k`` the reaction to ``force`` [N] and ``couple`` [N m] on a body at ``point``; count its work."""
    torque = (point - s.wall.origin[w, k]).cross(force) + couple
    s.wall.force[w, k] = s.wall.force[w, k] - force
    s.wall.torque[w, k] = s.wall.torque[w, k] - torque
    if held:
        s.wall.held[w, k] = s.wall.held[w, k] - force
        s.wall.held_torque[w, k] = s.wall.held_torque[w, k] - torque
    elif s.wall.moving[w, k] == 1:
        work = force.dot(surface_velocity(s, w, k, point)) + couple.dot(s.wall.omega[w, k])
        s.world.wall_work[w] = s.world.wall_work[w] + s.world.dt[w] * work


@ti.func
def touch_of(s: ti.template(), w, k, n, overlap, velocity, omega, a, whole, elastic, damper, mass, part):
    """What effects see of entry ``k`` before they act; ``elastic`` [N] is this contact's share of ``whole`` [N]."""
    row = s.contact.law[w, k]
    law = s.law.row[w, row]
    scale = scale_of(s, w, k, law)
    v_n = velocity.dot(n)
    before = s.contact.radius[w, k]
    if before < APART:
        before = 0.0
    return Touch(
        normal=n,
        overlap=overlap,
        reduced_radius=s.contact.reduced_radius[w, k],
        mass=mass,
        part=part,
        v_n=v_n,
        v_t=velocity - v_n * n,
        omega=omega,
        dt=s.world.dt[w],
        before=before,
        e_star=law.e_star,
        g_star=s.contact_law.shear_modulus(law, scale, a),
        restitution=s.effect.row[w, row, ti.static(COLUMNS[-1])],
        friction=law.friction,
        radius=a,
        elastic=elastic,
        adhesive=whole,
        work=0.0,
        pull_off=0.0,
        damper=damper,
        shear_damper=s.contact_law.shear_damper(law, scale, a, mass),
        floor=0.0,
        pull=0.0,
        held=0,
        force=0.0,
        limit=0.0,
        torque=Vec3(0.0, 0.0, 0.0),
    )


@ti.func
def respond(s: ti.template(), w, k, n, overlap, velocity, omega, mass, part, still):
    """Force [N] and torque [N m] on body a of entry ``k``, energy that it takes and the part its spring stores [J].

    ``velocity`` is that of a relative to its partner at the contact, ``omega`` the relative angular velocity (used only
    by effects). A torque comes from effects alone; it acts on both bodies, in opposite directions. ``mass`` [kg] is the
    mass that the dashpots damp, ``part`` the contact's share in its pair (``narrowphase.py``).

    If ``still``, nothing moves in the entry: what it keeps is unchanged, and no energy is counted. Such an entry is
    evaluated whenever the list is built; otherwise the frequency of list builds would affect the motion.
    """
    dt = s.world.dt[w]
    law = s.law.row[w, s.contact.law[w, k]]
    scale = scale_of(s, w, k, law)
    before = s.contact.radius[w, k]
    v_n = velocity.dot(n)
    v_t = velocity - v_n * n
    pressed, began = overlap, before
    if ti.static(s.effects):
        pressed = ti.max(HELD_OVERLAP, overlap)
        if overlap > 0.0 and before < APART:
            began = 0.0
    contact_radius = ti.sqrt(s.contact.reduced_radius[w, k] * pressed)
    hertz_radius = contact_radius
    spring_force = s.contact_law.normal_spring_force(law, scale, contact_radius, pressed)
    damper = s.contact_law.normal_damper(law, scale, contact_radius, mass, began, pressed, v_n, dt)
    elastic, floor, pull, released, last_half = spring_force, 0.0, 0.0, 0, 0.0
    if ti.static(s.sharing):
        elastic, damper = part * spring_force, part * damper
    touch = Touch(force=0.0)
    if ti.static(s.effects):
        touch = touch_of(
            s, w, k, n, overlap, velocity, omega, contact_radius, spring_force, elastic, damper, mass, part
        )
        touch = pass_stage(s, w, k, touch, Stage.NORMAL, still)
        touch = pass_stage(s, w, k, touch, Stage.ADHESION, still)
        contact_radius, elastic, damper = touch.radius, touch.elastic, touch.damper
        floor, pull = touch.floor, touch.pull
        if overlap <= 0.0 and touch.held == 0:
            released = 1
    expected = v_n
    if before > 0.0:
        expected = s.contact.expected[w, k]
    f_n = normal_force(elastic, damper, v_n, expected, mass, dt, floor)
    limit = law.friction * f_n
    if ti.static(s.effects):
        touch.force = f_n
        touch.limit = law.friction * ti.max(0.0, f_n + pull)
        touch = pass_stage(s, w, k, touch, Stage.TANGENTIAL, still)
        limit = touch.limit
    old, last_loss = s.contact.spring[w, k], s.contact.loss[w, k]
    displaced, uncapped = s.world.tangential_law[w], s.world.tangential_dashpot[w]
    shear_stiffness = s.contact_law.shear_stiffness(law, scale, contact_radius) * part
    shear_damper = s.contact_law.shear_damper(law, scale, contact_radius, mass) * part
    growth = s.contact_law.growth(contact_radius, before, displaced)
    spring, f_t = tangential_force(shear_stiffness, shear_damper, growth, old, n, v_t, limit, dt, uncapped)
    force, torque = f_n * n + f_t, Vec3(0.0, 0.0, 0.0)
    if ti.static(s.effects):
        touch = pass_stage(s, w, k, touch, Stage.ROLLING, still)
        touch = pass_stage(s, w, k, touch, Stage.TWISTING, still)
        torque = touch.torque
    # Work against the damper and the tangential force, at the mean of the velocities before and after the step: half is
    # counted now, half when the next velocity is known. What the spring stores is subtracted.
    taken, stored = 0.0, 0.0
    if not still:
        loss = (spring_force - f_n) * n - f_t
        taken = 0.5 * dt * (loss + last_loss).dot(velocity)
        stored = s.contact_law.shear_energy_gain(law, scale, old.norm_sqr(), before, spring.norm_sqr(), contact_radius)
        if ti.static(s.effects):
            taken -= 0.5 * dt * (torque + last_couple(s, w, k)).dot(omega)
            last_half = 0.5 * dt * (last_loss.dot(velocity) - last_couple(s, w, k).dot(omega))
            keep(s, w, k, torque, hertz_radius)
        s.contact.spring[w, k] = spring
        s.contact.radius[w, k] = contact_radius
        s.contact.expected[w, k] = v_n + dt * f_n / mass
        s.contact.loss[w, k] = loss
    if ti.static(s.effects):
        if released == 1:
            if not still:
                s.contact.spring[w, k], s.contact.radius[w, k] = old, before
                lose(s, w, k, law)
            force, torque = Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0)
            taken, stored = last_half, 0.0
    return force, torque, taken, stored


@ti.func
def push(s: ti.template(), w):
    """Add the force and torque of every live entry that touches to its bodies; update springs and contact radii.

    The list is ordered by the first body, so the sum for that body stays in registers until the next one. After a body
    woke or fell asleep, the entries in which nothing moves are evaluated once, after the live ones: they give the held
    forces on sleeping bodies.
    """
    largest, dissipated = s.world.overlap[w], 0.0
    present = -1
    force_sum, torque_sum = Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0)
    live, entries = s.world.live[w], s.world.live[w]
    if s.world.stirred[w] == 1:
        entries = s.world.contacts[w]
    if ti.static(s.sharing):
        if s.world.clump_rule[w] == SHARED:
            sum_pairs(s, w, entries)
    for item in range(entries):
        k = s.contact.live[w, item]
        hit = meet(s, w, k)
        overlap = hit[3]
        if lasts(s, w, k, overlap):
            a, b, i = s.contact.a[w, k], s.contact.b[w, k], s.contact.i[w, k]
            if item < live:
                radius = s.member.radius[w, i]
                if b >= 0:
                    radius = ti.min(radius, s.member.radius[w, s.contact.j[w, k]])
                if overlap > largest * radius:
                    largest = overlap / radius
            n = Vec3(hit[0], hit[1], hit[2])
            point = contact_point(s, w, i, n, overlap)
            arm, other_arm = point - s.body.position[w, a], Vec3(0.0, 0.0, 0.0)
            omega = s.body.omega[w, a]
            velocity = s.body.velocity[w, a] + omega.cross(arm)
            if b >= 0:
                other_arm = point - s.body.position[w, b]
                velocity -= s.body.velocity[w, b] + s.body.omega[w, b].cross(other_arm)
                omega -= s.body.omega[w, b]
            else:
                velocity -= surface_velocity(s, w, -1 - b, point)
                omega -= s.wall.omega[w, -1 - b]
            mass, part = s.contact.reduced_mass[w, k], 1.0
            if s.world.clump_rule[w] != BODY_MASS:
                place = point
                if ti.static(s.sharing):
                    if s.world.clump_rule[w] == SHARED:
                        place = shared_point(s, w, k, n, point)
                        part = share(s, w, k, n, overlap)
                mass = local_mass(s, w, a, b, place, n)
            force, torque, taken, stored = respond(s, w, k, n, overlap, velocity, omega, mass, part, item >= live)
            dissipated += taken
            dissipated -= stored
            if b < 0:
                push_wall(s, w, -1 - b, point, force, torque, item >= live)
            if item >= live:
                s.body.held[w, a] = s.body.held[w, a] + force
                s.body.held_torque[w, a] = s.body.held_torque[w, a] + (arm.cross(force) + torque)
                if b >= 0:
                    s.body.held[w, b] = s.body.held[w, b] - force
                    s.body.held_torque[w, b] = s.body.held_torque[w, b] - (other_arm.cross(force) + torque)
                force, torque = Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0)
            if a != present:
                if present >= 0:
                    s.body.force[w, present] = s.body.force[w, present] + force_sum
                    s.body.torque[w, present] = s.body.torque[w, present] + torque_sum
                present = a
                force_sum, torque_sum = Vec3(0.0, 0.0, 0.0), Vec3(0.0, 0.0, 0.0)
            force_sum += force
            torque_sum += arm.cross(force)
            if b >= 0:
                s.body.force[w, b] = s.body.force[w, b] - force
                s.body.torque[w, b] = s.body.torque[w, b] - other_arm.cross(force)
            if ti.static(s.effects):
                torque_sum += torque
                if b >= 0:
                    s.body.torque[w, b] = s.body.torque[w, b] - torque
        elif s.contact.radius[w, k] > 0.0:
            lose(s, w, k, s.law.row[w, s.contact.law[w, k]])
    if present >= 0:
        s.body.force[w, present] = s.body.force[w, present] + force_sum
        s.body.torque[w, present] = s.body.torque[w, present] + torque_sum
    s.world.overlap[w] = largest
    s.world.dissipated[w] = s.world.dissipated[w] + dissipated


@ti.kernel
def read_contacts(s: ti.template(), world: ti.i32, out: Table, count: IntRow):
    """One row per acting contact: body a, body b or -1 - wall, point (3), normal from b to a (3), force on a (3).

    The force is that of the last step: the elastic part along the normal minus ``contact.loss``, which contains damping
    and friction. ``count[0]`` is the number of filled rows.
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
