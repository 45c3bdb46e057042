"""Motion of rigid bodies: leapfrog with all velocities at one common half step.

Translation  v ← v + dt (F/m + g),  x ← x + dt v.
Rotation     Euler's equations in the principal frame, I ω' = τ − ω × I ω, by the implicit midpoint rule (which
             conserves |L| and the energy of a free body); then the quaternion is rotated by the new spin.
"""

from solver.backend import ti
from solver.engine.kernels.effects import body_force
from solver.engine.kernels.geometry import turned
from solver.engine.kernels.neighbours import place_members
from solver.engine.state import Vec3

MIDPOINT_ITERATIONS = 3
"""Fixed-point iterations of the midpoint rule; each reduces the error by a factor |ω| dt, below 1e-2 here."""


@ti.func
def prepare(s: ti.template(), w, b):
    """Compute what contacts need of a listed body: member centres and the angular velocity in the world frame."""
    if s.body.listed[w, b] == 1:
        place_members(s, w, b, False)
        s.body.omega[w, b] = s.body.rotation[w, b] @ s.body.spin[w, b]


@ti.func
def spun(spin, inertia, inverse, torque, dt):
    """Spin [rad/s] after ``dt`` under ``torque`` [N m], both in the principal frame; ``inverse`` is that of inertia."""
    scale = dt * inverse
    new = spin + scale * torque
    if inertia[0] != inertia[1] or inertia[1] != inertia[2]:
        for _ in ti.static(range(MIDPOINT_ITERATIONS)):
            mid = 0.5 * (spin + new)
            new = spin + scale * (torque - mid.cross(inertia * mid))
    return new


@ti.func
def energy_per_mass(s: ti.template(), w, b):
    """Kinetic energy of a body divided by half its mass [m²/s²]."""
    v, spin = s.body.velocity[w, b], s.body.spin[w, b]
    return v.dot(v) + spin.dot(s.body.inertia[w, b] * spin) / s.body.mass[w, b]


@ti.func
def move(s: ti.template(), w, b):
    """Advance one body by a step and clear its force and torque."""
    dt = s.world.dt[w]
    velocity = s.body.velocity[w, b] + dt * s.world.gravity[w]
    torque = Vec3(0.0, 0.0, 0.0)
    if s.body.listed[w, b] == 1:
        velocity += dt * s.body.inverse_mass[w, b] * s.body.force[w, b]
        torque = s.body.rotation[w, b].transpose() @ s.body.torque[w, b]
        s.body.force[w, b] = Vec3(0.0, 0.0, 0.0)
        s.body.torque[w, b] = Vec3(0.0, 0.0, 0.0)
    if ti.static(s.effects):
        force = body_force(s, w, b)
        velocity += dt * s.body.inverse_mass[w, b] * force
        s.world.dissipated[w] = s.world.dissipated[w] - 0.5 * dt * force.dot(velocity + s.body.velocity[w, b])
    if s.pull.body[w] == b + 1:
        pull = s.pull.force[w]
        velocity += dt * s.body.inverse_mass[w, b] * pull
        s.world.wall_work[w] = s.world.wall_work[w] + 0.5 * dt * pull.dot(velocity + s.body.velocity[w, b])
    spin = spun(s.body.spin[w, b], s.body.inertia[w, b], s.body.inverse_inertia[w, b], torque, dt)
    s.body.velocity[w, b] = velocity
    s.body.spin[w, b] = spin
    s.body.position[w, b] = s.body.position[w, b] + dt * velocity
    s.body.quaternion[w, b] = turned(s.body.quaternion[w, b], spin, dt)
    speed = ti.sqrt(velocity.dot(velocity))
    if s.body.swing[w, b] > 0.0:
        speed += ti.sqrt(spin.dot(spin)) * s.body.swing[w, b]
    travel = s.body.travel[w, b] + dt * speed
    s.body.travel[w, b] = travel
    if travel > s.body.margin[w, b]:
        s.world.outdated[w] = 1
