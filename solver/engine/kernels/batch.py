"""The kernel that runs a batch: worlds in parallel, the steps of a world one after the other, and a summary at the end.

The summary of a world contains its energies, its masses and the speed of the fastest body; it does not affect the
motion.
"""

from solver.backend import lanes, serial, ti
from solver.effects.columns import HERTZ
from solver.engine.kernels.contacts import push, scale_of
from solver.engine.kernels.motion import energy_per_mass, move, prepare
from solver.engine.kernels.neighbours import rebuild
from solver.engine.kernels.sleep import fall_asleep, list_bodies, list_border, list_entries, watch
from solver.engine.kernels.walls import clear_walls, move_walls
from solver.scenes.numerics import ROLLING_SLOPE


@ti.func
def rolls_away(s: ti.template(), w, b):
    """1 for a single body that rolls outward on the plate, beyond the feed opening's radius: not part of the pile.

    Without rolling resistance it may roll for ever, which must not keep the run going.
    """
    x, v = s.body.position[w, b], s.body.velocity[w, b]
    beyond = x[0] * x[0] + x[1] * x[1] > s.world.inlet_radius[w] ** 2
    outward = x[0] * v[0] + x[1] * v[1] > 0.0
    level = v[2] * v[2] < ROLLING_SLOPE**2 * v.dot(v)
    away = 0
    if s.body.touching[w, b] == 0 and x[2] < s.body.reach[w, b] and beyond and outward and level:
        away = 1
    return away


@ti.func
def body_energy(s: ti.template(), w, b):
    """Kinetic and potential energy of a body [J]."""
    half = 0.5 * energy_per_mass(s, w, b)
    return s.body.mass[w, b] * (half - s.world.gravity[w].dot(s.body.position[w, b]))


@ti.func
def sum_contacts(s: ti.template(), w):
    """Count touching contacts, in total and per body with others, and sum the energy in the springs (last step)."""
    s.summary.elastic[w] = 0.0
    s.summary.touching[w] = 0
    for b in range(s.world.bodies[w]):
        s.body.touching[w, b] = 0
    for k in range(s.world.contacts[w]):
        radius = s.contact.radius[w, k]
        if radius > 0.0:
            law = s.law.row[w, s.contact.law[w, k]]
            hertz = radius
            if ti.static(s.effects):
                hertz = s.memory.number[w, k, HERTZ]
            overlap = hertz * hertz / s.contact.reduced_radius[w, k]
            scale, spring2 = scale_of(s, w, k, law), s.contact.spring[w, k].norm_sqr()
            energy = s.contact_law.normal_energy(law, scale, hertz, overlap)
            energy += s.contact_law.shear_energy(law, scale, spring2, radius)
            s.summary.elastic[w] = s.summary.elastic[w] + energy
            s.summary.touching[w] = s.summary.touching[w] + 1
            if s.contact.b[w, k] >= 0:
                s.body.touching[w, s.contact.a[w, k]] = s.body.touching[w, s.contact.a[w, k]] + 1
                s.body.touching[w, s.contact.b[w, k]] = s.body.touching[w, s.contact.b[w, k]] + 1


@ti.func
def summarise(s: ti.template(), w):
    """Energies, masses and speeds of world ``w``."""
    sum_contacts(s, w)
    s.summary.kinetic[w] = 0.0
    s.summary.potential[w] = 0.0
    s.summary.speed[w] = 0.0
    s.summary.funnel_speed[w] = 0.0
    s.summary.discharged[w] = 0.0
    s.summary.in_funnel[w] = 0.0
    s.summary.hanging[w] = 0
    s.summary.asleep[w] = 0
    s.summary.finite[w] = 1
    for b in range(s.world.bodies[w]):
        mass, x = s.body.mass[w, b], s.body.position[w, b]
        if s.body.alive[w, b] == 0:
            s.summary.discharged[w] = s.summary.discharged[w] + mass
        else:
            energy = energy_per_mass(s, w, b)
            s.summary.kinetic[w] = s.summary.kinetic[w] + 0.5 * mass * energy
            s.summary.potential[w] = s.summary.potential[w] - mass * s.world.gravity[w].dot(x)
            s.summary.asleep[w] = s.summary.asleep[w] + s.body.asleep[w, b]
            if not (energy < 1e30 and x.dot(x) < 1e30):
                s.summary.finite[w] = 0
            speed = ti.sqrt(energy)
            if x[2] > s.world.outlet[w] and x[0] * x[0] + x[1] * x[1] < s.world.inlet_radius[w] ** 2:
                s.summary.in_funnel[w] = s.summary.in_funnel[w] + mass
                s.summary.hanging[w] = s.summary.hanging[w] + 1
                s.summary.funnel_speed[w] = ti.max(s.summary.funnel_speed[w], speed)
            else:
                s.summary.discharged[w] = s.summary.discharged[w] + mass
                if rolls_away(s, w, b) == 0:
                    s.summary.speed[w] = ti.max(s.summary.speed[w], speed)


@ti.func
def step(s: ti.template(), w):
    """One time step of world ``w``."""
    if s.world.outdated[w] == 1:
        rebuild(s, w)
    if s.world.stirred[w] == 1:
        list_bodies(s, w)
        list_entries(s, w)
    for item in range(s.world.awake[w]):
        prepare(s, w, s.body.awake[w, item])
    clear_walls(s, w)
    push(s, w)
    if s.world.stirred[w] == 1:
        s.world.stirred[w] = 0
        list_border(s, w)
    for item in range(s.world.border[w]):
        watch(s, w, s.body.border[w, item])
    for item in range(s.world.awake[w]):
        b = s.body.awake[w, item]
        if s.world.sleep_speed[w] > 0.0:
            fall_asleep(s, w, b)
        if s.body.asleep[w, b] == 0:
            move(s, w, b)
    move_walls(s, w)


@ti.kernel
def advance(s: ti.template(), steps: ti.types.ndarray(dtype=ti.i32, ndim=1)):
    """Run world w for ``steps[w]`` steps and summarise it; worlds with no steps are left unchanged.

    A world has several loop iterations, all but one of them idle: each CPU thread is given so many consecutive
    iterations that a loop over few worlds would run on one thread. Threads get equal, contiguous shares of the worlds.
    """
    ti.loop_config(serialize=ti.static(serial()))
    for lane in range(steps.shape[0] * ti.static(lanes())):
        w = lane // ti.static(lanes())
        if lane % ti.static(lanes()) == 0 and steps[w] > 0:
            for _ in range(steps[w]):
                step(s, w)
            summarise(s, w)


@ti.kernel
def measure(s: ti.template(), world_index: ti.i32):
    """Summarise one world as it stands."""
    ti.loop_config(serialize=ti.static(serial()))
    for w in range(world_index, world_index + 1):
        summarise(s, w)


@ti.kernel
def take_out(s: ti.template(), world_index: ti.i32) -> ti.i32:
    """Take out bodies that left the domain; returns how many were lost.

    A body that has come out of the outlet and rolls or bounces off the plate is a stray, however high it bounces. One
    that leaves without having come out of the outlet, or through the plate, is lost.
    """
    lost = 0
    ti.loop_config(serialize=ti.static(serial()))
    for w in range(world_index, world_index + 1):
        for b in range(s.world.bodies[w]):
            if s.body.alive[w, b] == 1:
                x = s.body.position[w, b]
                outside = ti.abs(x[0]) > s.world.domain[w] or ti.abs(x[1]) > s.world.domain[w]
                if x[2] <= s.world.outlet[w]:
                    s.body.has_left[w, b] = 1
                if x[2] < -s.body.reach[w, b] or (outside and s.body.has_left[w, b] == 0):
                    lost += 1
                if outside:
                    s.body.alive[w, b] = 0
                    s.world.taken_out[w] = s.world.taken_out[w] + body_energy(s, w, b)
                    s.world.outdated[w] = 1
    return lost
