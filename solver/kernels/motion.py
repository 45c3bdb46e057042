"""Motion of rigid bodies: leapfrog with all velocities at one common half step.

Translation  v ← v + dt (F/m + g),  x ← x + dt v.
Rotation     Euler's equations in the principal frame, I ω' = τ − ω × I ω, by the implicit midpoint rule (which keeps
             |L| and the energy of a free body), then the quaternion turned by the new spin.
"""

from solver.backend import ti
from solver.kernels.geometry import turned
from solver.kernels.neighbours import place_members
from solver.state import Vec3

MIDPOINT_ITERATIONS = 3
"""Fixed-point iterations of the midpoint rule; each gains a factor |ω| dt, below 1e-2 here."""


@ti.func
def prepare(body: ti.template(), member: ti.template(), w, b):
    """What contacts need of a listed body: member centres and the angular velocity in the world frame."""
    place_members(body, member, w, b, False)
    body.omega[w, b] = body.rotation[w, b] @ body.spin[w, b]


@ti.func
def spun(spin, inertia, torque, dt):
    """Spin [rad/s] after ``dt`` under ``torque`` [N m], both in the principal frame."""
    new = spin
    for _ in ti.static(range(MIDPOINT_ITERATIONS)):
        mid = 0.5 * (spin + new)
        new = spin + dt * (torque - mid.cross(inertia * mid)) / inertia
    return new


@ti.func
def move(world: ti.template(), body: ti.template(), w, b):
    """Advance one body by a step and clear its force and torque."""
    dt = world.dt[w]
    velocity = body.velocity[w, b] + dt * world.gravity[w]
    torque = Vec3(0.0, 0.0, 0.0)
    if body.listed[w, b] == 1:
        velocity += dt / body.mass[w, b] * body.force[w, b]
        torque = body.rotation[w, b].transpose() @ body.torque[w, b]
        body.force[w, b] = Vec3(0.0, 0.0, 0.0)
        body.torque[w, b] = Vec3(0.0, 0.0, 0.0)
    spin = spun(body.spin[w, b], body.inertia[w, b], torque, dt)
    body.velocity[w, b] = velocity
    body.spin[w, b] = spin
    body.position[w, b] += dt * velocity
    body.quaternion[w, b] = turned(body.quaternion[w, b], spin, dt)
    speed = ti.sqrt(velocity.dot(velocity)) + ti.sqrt(spin.dot(spin)) * body.reach[w, b]
    travel = body.travel[w, b] + dt * speed
    body.travel[w, b] = travel
    world.moved[w] = ti.max(world.moved[w], travel)
