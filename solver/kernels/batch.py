"""The kernel that runs a batch: worlds in parallel, the steps of a world one after the other."""

from solver.backend import lanes, serial, ti
from solver.kernels.contacts import push
from solver.kernels.motion import move, prepare
from solver.kernels.neighbours import rebuild
from solver.kernels.sleep import fall_asleep, list_bodies, list_border, list_entries, watch
from solver.kernels.summary import body_energy, summarise
from solver.kernels.walls import clear_walls, move_walls


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
    """Run world w for ``steps[w]`` steps and summarise it; worlds with no steps stay untouched.

    A world has several loop iterations, all but one of them idle: a CPU thread is given so many in a row that a loop
    over few worlds would run on one thread. Threads get equal, contiguous shares of the worlds.
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
    """Take bodies out that left the domain; returns how many were lost.

    Rolling or hopping out over the plate is a stray; leaving above the outlet or through the plate is a loss.
    """
    lost = 0
    ti.loop_config(serialize=ti.static(serial()))
    for w in range(world_index, world_index + 1):
        for b in range(s.world.bodies[w]):
            if s.body.alive[w, b] == 1:
                x = s.body.position[w, b]
                outside = ti.abs(x[0]) > s.world.domain[w] or ti.abs(x[1]) > s.world.domain[w]
                if x[2] < -s.body.reach[w, b] or (outside and x[2] > s.world.outlet[w]):
                    lost += 1
                if outside:
                    s.body.alive[w, b] = 0
                    s.world.taken_out[w] = s.world.taken_out[w] + body_energy(s, w, b)
                    s.world.outdated[w] = 1
    return lost
