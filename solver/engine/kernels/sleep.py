"""Sleeping bodies: a body at rest takes no computing time until the forces on it change.

A body that has been slower than ``sleep_speed`` (√(2 kinetic energy / mass)) for ``sleep_time`` and whose forces are in
balance falls asleep: it is fixed, and contacts among sleeping bodies and resting walls are skipped, their forces summed
once. It wakes when the balance is lost, for instance when an awake body pushes it. Each body falls asleep and wakes on
its own, at steps that do not depend on how the run is divided into launches.
"""

from solver.backend import ti
from solver.engine.kernels.motion import energy_per_mass
from solver.engine.state import Vec3

BALANCE = 0.02
"""Imbalance at which a body may fall asleep, as a fraction of its weight."""
WAKE = 0.1
"""Imbalance at which it wakes, as a fraction of its weight."""


@ti.func
def imbalance(s: ti.template(), w, b, force, torque):
    """The larger of net force and net torque divided by the reach, as a fraction of the weight."""
    mass, g = s.body.mass[w, b], s.world.gravity[w]
    net = (force + mass * g).norm()
    return ti.max(net, torque.norm() / s.body.reach[w, b]) / (mass * g.norm())


@ti.func
def fall_asleep(s: ti.template(), w, b):
    """Let body ``b`` sleep if it is balanced and has been slow for long enough; called before its force is cleared."""
    energy = energy_per_mass(s, w, b)
    if energy > s.world.sleep_speed[w] ** 2:
        s.body.quiet[w, b] = 0.0
    else:
        s.body.quiet[w, b] = s.body.quiet[w, b] + s.world.dt[w]
        still = s.body.quiet[w, b] >= s.world.sleep_time[w]
        if still and imbalance(s, w, b, s.body.force[w, b], s.body.torque[w, b]) < BALANCE:
            s.body.asleep[w, b] = 1
            s.world.stirred[w] = 1
            s.world.dissipated[w] = s.world.dissipated[w] + 0.5 * s.body.mass[w, b] * energy
            s.body.velocity[w, b] = Vec3(0.0, 0.0, 0.0)
            s.body.spin[w, b] = Vec3(0.0, 0.0, 0.0)
            s.body.omega[w, b] = Vec3(0.0, 0.0, 0.0)
            s.body.force[w, b] = Vec3(0.0, 0.0, 0.0)
            s.body.torque[w, b] = Vec3(0.0, 0.0, 0.0)


@ti.func
def rouse(s: ti.template(), w, b):
    """Wake body ``b`` from the next step on."""
    s.body.asleep[w, b] = 0
    s.body.quiet[w, b] = 0.0
    s.world.stirred[w] = 1


@ti.func
def rouse_all(s: ti.template(), w):
    """Wake every body: something that acts on many of them has changed."""
    for b in range(s.world.bodies[w]):
        rouse(s, w, b)
    s.world.stirred[w] = 1


@ti.func
def watch(s: ti.template(), w, b):
    """Wake sleeping body ``b`` if its held and live forces are out of balance; clears its live force."""
    force, torque = s.body.force[w, b], s.body.torque[w, b]
    s.body.force[w, b] = Vec3(0.0, 0.0, 0.0)
    s.body.torque[w, b] = Vec3(0.0, 0.0, 0.0)
    if imbalance(s, w, b, s.body.held[w, b] + force, s.body.held_torque[w, b] + torque) > WAKE:
        rouse(s, w, b)


@ti.func
def list_bodies(s: ti.template(), w):
    """List the bodies that are awake, and clear the held forces of all."""
    awake = 0
    for b in range(s.world.bodies[w]):
        if s.body.alive[w, b] == 1:
            s.body.held[w, b] = Vec3(0.0, 0.0, 0.0)
            s.body.held_torque[w, b] = Vec3(0.0, 0.0, 0.0)
            s.body.at_border[w, b] = 0
            if s.body.asleep[w, b] == 0:
                s.body.awake[w, awake] = b
                awake += 1
    s.world.awake[w] = awake


@ti.func
def list_entries(s: ti.template(), w):
    """List the entries with an awake body or a moving wall, ascending, and the others after them."""
    live, rest = 0, s.world.contacts[w]
    for k in range(s.world.contacts[w]):
        a, b = s.contact.a[w, k], s.contact.b[w, k]
        moving = 1 - s.body.asleep[w, a]
        if b >= 0:
            moving = ti.max(moving, 1 - s.body.asleep[w, b])
        else:
            moving = ti.max(moving, s.wall.moving[w, -1 - b])
        if moving == 1:
            s.contact.live[w, live] = k
            live += 1
            s.body.at_border[w, a] = s.body.asleep[w, a]
            if b >= 0:
                s.body.at_border[w, b] = s.body.asleep[w, b]
        else:
            rest -= 1
            s.contact.live[w, rest] = k
    s.world.live[w] = live


@ti.func
def list_border(s: ti.template(), w):
    """List sleeping bodies that an awake body or a moving wall may push; wake others that have lost their support."""
    border = 0
    for b in range(s.world.bodies[w]):
        if s.body.alive[w, b] == 1 and s.body.asleep[w, b] == 1:
            if s.body.at_border[w, b] == 1:
                s.body.border[w, border] = b
                border += 1
            elif imbalance(s, w, b, s.body.held[w, b], s.body.held_torque[w, b]) > WAKE:
                rouse(s, w, b)
    s.world.border[w] = border
