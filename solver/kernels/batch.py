"""The kernel that runs a batch: worlds in parallel, the steps of a world one after the other."""

from solver.backend import ti
from solver.kernels.contacts import push, stored_energy
from solver.kernels.motion import move, prepare
from solver.kernels.neighbours import place_members, rebuild

LANES = 512
"""Loop iterations per world, all but one of them idle: Taichi gives a CPU thread at least 512 iterations in a row, so a
loop over fewer worlds than that would run on one thread. Threads get equal, contiguous shares of the worlds."""


@ti.func
def rolls_away(world: ti.template(), body: ti.template(), w, b):
    """1 for a single body that rolls outward on the plate, beyond the feed opening's radius: no part of the pile.

    There is no rolling resistance, so it may roll for ever; it must not keep the run going.
    """
    x, v = body.position[w, b], body.velocity[w, b]
    beyond = x[0] * x[0] + x[1] * x[1] > world.inlet_radius[w] ** 2
    outward = x[0] * v[0] + x[1] * v[1] > 0.0
    away = 0
    if body.touching[w, b] == 0 and x[2] < body.reach[w, b] and beyond and outward:
        away = 1
    return away


@ti.func
def summarise(
    world: ti.template(),
    body: ti.template(),
    member: ti.template(),
    contact: ti.template(),
    surface: ti.template(),
    law: ti.template(),
    summary: ti.template(),
    w,
):
    """Energies, masses and speeds as they stand; nothing is changed."""
    capacity = member.body.shape[1]
    summary.kinetic[w] = 0.0
    summary.elastic[w] = 0.0
    summary.potential[w] = 0.0
    summary.speed[w] = 0.0
    summary.funnel_speed[w] = 0.0
    summary.discharged[w] = 0.0
    summary.in_funnel[w] = 0.0
    summary.touching[w] = 0
    summary.hanging[w] = 0
    summary.finite[w] = 1
    for b in range(world.bodies[w]):
        body.touching[w, b] = 0
        if body.alive[w, b] == 1:
            place_members(body, member, w, b, False)
    for k in range(world.contacts[w]):
        if contact.radius[w, k] > 0.0:
            summary.touching[w] += 1
            summary.elastic[w] += stored_energy(body, member, contact, surface, law, w, k)
            i, j = contact.i[w, k], contact.j[w, k]
            if j < capacity:
                body.touching[w, member.body[w, i]] += 1
                body.touching[w, member.body[w, j]] += 1
    for b in range(world.bodies[w]):
        mass, x = body.mass[w, b], body.position[w, b]
        if body.alive[w, b] == 0:
            summary.discharged[w] += mass
        else:
            v, spin = body.velocity[w, b], body.spin[w, b]
            kinetic = 0.5 * mass * v.dot(v) + 0.5 * spin.dot(body.inertia[w, b] * spin)
            summary.kinetic[w] += kinetic
            summary.potential[w] -= mass * world.gravity[w].dot(x)
            if not (kinetic < 1e30 and x.dot(x) < 1e30):
                summary.finite[w] = 0
            in_funnel = x[2] > world.outlet[w] and x[0] * x[0] + x[1] * x[1] < world.inlet_radius[w] ** 2
            speed = ti.sqrt(2.0 * kinetic / mass)
            if in_funnel:
                summary.in_funnel[w] += mass
                summary.hanging[w] += 1
                summary.funnel_speed[w] = ti.max(summary.funnel_speed[w], speed)
            else:
                summary.discharged[w] += mass
                if rolls_away(world, body, w, b) == 0:
                    summary.speed[w] = ti.max(summary.speed[w], speed)


@ti.kernel
def advance(
    world: ti.template(),
    body: ti.template(),
    member: ti.template(),
    contact: ti.template(),
    history: ti.template(),
    surface: ti.template(),
    law: ti.template(),
    summary: ti.template(),
    steps: ti.types.ndarray(dtype=ti.i32, ndim=1),
):
    """Run world w for ``steps[w]`` steps and summarise it; worlds with no steps stay untouched."""
    for lane in range(steps.shape[0] * LANES):
        w = lane // LANES
        if lane % LANES == 0 and steps[w] > 0:
            for _ in range(steps[w]):
                if 2.0 * world.moved[w] > world.skin[w]:
                    rebuild(world, body, member, contact, history, surface, w)
                for b in range(world.bodies[w]):
                    if body.listed[w, b] == 1:
                        prepare(body, member, w, b)
                push(world, body, member, contact, surface, law, w)
                for b in range(world.bodies[w]):
                    if body.alive[w, b] == 1:
                        move(world, body, w, b)
            summarise(world, body, member, contact, surface, law, summary, w)


@ti.kernel
def measure(
    world: ti.template(),
    body: ti.template(),
    member: ti.template(),
    contact: ti.template(),
    surface: ti.template(),
    law: ti.template(),
    summary: ti.template(),
    world_index: ti.i32,
):
    """Summarise one world as it stands."""
    for w in range(world_index, world_index + 1):
        summarise(world, body, member, contact, surface, law, summary, w)


@ti.kernel
def take_out(world: ti.template(), body: ti.template(), world_index: ti.i32) -> ti.i32:
    """Take bodies out that left the domain; returns how many were lost.

    Rolling or hopping out over the plate is a stray; leaving above the outlet or through the plate is a loss.
    """
    lost = 0
    for w in range(world_index, world_index + 1):
        for b in range(world.bodies[w]):
            if body.alive[w, b] == 1:
                x = body.position[w, b]
                outside = ti.abs(x[0]) > world.domain[w] or ti.abs(x[1]) > world.domain[w]
                if x[2] < -body.reach[w, b] or (outside and x[2] > world.outlet[w]):
                    lost += 1
                if outside:
                    body.alive[w, b] = 0
                    world.moved[w] = world.skin[w]
    return lost
