"""Changes to a running world: contact law, effects, entering bodies, walls, gravity. One small kernel per task."""

from solver.backend import serial, ti
from solver.effects.columns import COLUMNS, MEMORIES, MEMORY
from solver.engine.kernels.sleep import rouse_all
from solver.engine.kernels.transfer import Row, Table
from solver.engine.state import Vec3, Vec4


@ti.func
def disturb(s: ti.template(), w):
    """Wake every body and build the contact list again at the next step."""
    rouse_all(s, w)
    s.world.outdated[w] = 1


@ti.kernel
def load_law(s: ti.template(), w: ti.i32, table: Table, kinds: ti.i32):
    """Replace the contact constants of every pair of kinds: the law's columns, row a · kinds + b."""
    s.world.kinds[w] = kinds
    rouse_all(s, w)
    ti.loop_config(serialize=ti.static(serial()))
    for k in range(table.shape[0]):
        s.law.row[w, k] = s.law_row(*[table[k, c] for c in ti.static(range(len(s.contact_law.columns)))])


@ti.func
def forget_switched(s: ti.template(), w, k, table: ti.template()):
    """Clear what contacts of row ``k`` keep of effects that ``table`` switches on or off there."""
    for index in ti.static(range(len(MEMORIES))):
        if ti.static(MEMORIES[index] > 0):
            was_on = s.effect.row[w, k, ti.static(COLUMNS[index])] != 0.0
            if was_on != (table[k, ti.static(COLUMNS[index])] != 0.0):
                for c in range(s.world.contacts[w]):
                    if s.contact.law[w, c] == k:
                        for d in ti.static(range(MEMORIES[index])):
                            s.memory.number[w, c, ti.static(MEMORY[index] + d)] = 0.0


@ti.kernel
def load_effects(s: ti.template(), w: ti.i32, table: Table, grip: ti.f64):
    """Replace the effects' parameters of every pair of kinds, row a · kinds + b, and the largest gap [m] of a pull."""
    rouse_all(s, w)
    # A cell is as long as the largest body plus margins and grip.
    s.world.cell[w] = s.world.cell[w] + (grip - s.world.grip[w])
    s.world.grip[w] = grip
    s.world.outdated[w] = 1
    ti.loop_config(serialize=ti.static(serial()))
    for k in range(table.shape[0]):
        if ti.static(s.effects):
            forget_switched(s, w, k, table)
        for column in range(table.shape[1]):
            s.effect.row[w, k, column] = table[k, column]


@ti.kernel
def load_state(s: ti.template(), w: ti.i32, b: ti.i32, pose: Row):
    """Let body ``b`` enter; pose: position (3), quaternion wxyz (4), velocity (3), spin in the principal frame (3)."""
    s.body.position[w, b] = Vec3(pose[0], pose[1], pose[2])
    s.body.quaternion[w, b] = Vec4(pose[3], pose[4], pose[5], pose[6])
    s.body.velocity[w, b] = Vec3(pose[7], pose[8], pose[9])
    s.body.spin[w, b] = Vec3(pose[10], pose[11], pose[12])
    s.body.force[w, b] = Vec3(0.0, 0.0, 0.0)
    s.body.torque[w, b] = Vec3(0.0, 0.0, 0.0)
    s.body.travel[w, b] = 0.0
    s.body.quiet[w, b] = 0.0
    s.body.asleep[w, b] = 0
    s.body.listed[w, b] = 0
    s.body.alive[w, b] = 1
    s.body.has_left[w, b] = 0
    s.world.bodies[w] = ti.max(s.world.bodies[w], b + 1)
    s.world.outdated[w] = 1


@ti.kernel
def set_active(s: ti.template(), w: ti.i32, wall: ti.i32, active: ti.i32):
    """Switch a wall on or off (a gate)."""
    s.wall.active[w, wall] = active
    disturb(s, w)


@ti.kernel
def set_container(s: ti.template(), w: ti.i32, height: ti.f64, radius: ti.f64):
    """Set what counts as inside the rig: above ``height`` [m] and within ``radius`` [m] of the z axis."""
    s.world.outlet[w] = height
    s.world.inlet_radius[w] = radius


@ti.kernel
def set_motion(s: ti.template(), w: ti.i32, wall: ti.i32, motion: Row):
    """Let a wall move; motion: velocity (3), angular velocity in the world (3), extent [m]."""
    s.wall.velocity[w, wall] = Vec3(motion[0], motion[1], motion[2])
    s.wall.omega[w, wall] = Vec3(motion[3], motion[4], motion[5])
    s.wall.extent[w, wall] = motion[6]
    s.wall.moving[w, wall] = 0
    for d in ti.static(range(6)):
        if motion[d] != 0.0:
            s.wall.moving[w, wall] = 1
    disturb(s, w)


@ti.kernel
def set_gravity(s: ti.template(), w: ti.i32, x: ti.f64, y: ti.f64, z: ti.f64):
    """Replace gravity [m/s²]."""
    s.world.gravity[w] = Vec3(x, y, z)
    rouse_all(s, w)


@ti.kernel
def set_pull(s: ti.template(), w: ti.i32, pulled: ti.i32, x: ti.f64, y: ti.f64, z: ti.f64):
    """Replace the body that is pulled (its number + 1, 0: none) and the force [N]."""
    s.pull.body[w] = pulled
    s.pull.force[w] = Vec3(x, y, z)
    rouse_all(s, w)


@ti.kernel
def set_time_step(s: ti.template(), w: ti.i32, dt: ti.f64):
    """Replace the time step [s]."""
    s.world.dt[w] = dt


@ti.kernel
def set_sleep(s: ti.template(), w: ti.i32, speed: ti.f64, time: ti.f64):
    """Replace the speed [m/s] and time [s] at which bodies fall asleep, and wake all of them."""
    s.world.sleep_speed[w] = speed
    s.world.sleep_time[w] = time
    rouse_all(s, w)


@ti.kernel
def scale_springs(s: ti.template(), w: ti.i32, ratio: Row):
    """Multiply tangential springs by the ``ratio`` of their law table row: keeps the displacement of each spring."""
    ti.loop_config(serialize=ti.static(serial()))
    for k in range(s.world.contacts[w]):
        s.contact.spring[w, k] = s.contact.spring[w, k] * ratio[s.contact.law[w, k]]


@ti.kernel
def clear_overlap(s: ti.template(), w: ti.i32):
    """Reset the largest overlap."""
    s.world.overlap[w] = 0.0
