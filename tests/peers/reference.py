"""One clump on the plate in plain NumPy, with the tangential law of each engine: says what a difference comes from.

Written apart from the solver's kernels, after the engines' documents and sources. All share Hertz's normal force with
the clamp and c_n of our law (ours takes the damper at the middle of the step, which is of the order of the step); the
tangential laws differ:

- ``ours``: a force; scaled with a/a_prev while unloading; spring and spring + dashpot capped at μ F_n.
- ``yade``: a force; never scaled; the spring is capped at μ F_n, the dashpot comes on top while it is below.
- ``liggghts``: a displacement times the present 8 G* a; cap and dashpot as YADE; c_t = c_n (the restitution given to it
  is the one whose normal damping is ours).
"""

import numpy as np

from solver.laws.hertz_mindlin import tangential_damping
from solver.laws.restitution import normal_damping
from solver.scenes.insertion import rotation_matrix
from solver.scenes.material import effective_shear_modulus, effective_youngs_modulus

MIDPOINT_ITERATIONS = 3


def drop(scene, dt, steps, every, position, quaternion, velocity, law):
    """Centres of mass (k, 3), velocities (k, 3) and spins in the world's frame (k, 3), every so many steps."""
    body = scene.bodies[0]
    clump, wall = body.clump, scene.rig.wall
    pair, grain, steel = scene.contact_pair(body, wall), scene.material(body.material), scene.material(wall)
    e_star, g_star = effective_youngs_modulus(grain, steel), effective_shear_modulus(grain, steel)
    c_n, c_t = normal_damping(pair.restitution), tangential_damping(pair.restitution)
    c_t = c_n if law == "liggghts" else c_t
    inertia, gravity = np.asarray(clump.inertia), np.array(scene.gravity)
    x, q, v, w = np.array(position, float), np.array(quaternion, float), np.array(velocity, float), np.zeros(3)
    memory, a_before = np.zeros((len(clump.radii), 2)), np.zeros(len(clump.radii))
    expected = np.zeros(len(clump.radii))
    rows = []
    for step in range(steps + 1):
        turn = rotation_matrix(q)
        if step % every == 0:
            rows.append((x.copy(), v.copy(), turn @ w))
        arms = clump.centres @ turn.T
        overlap = clump.radii - x[2] - arms[:, 2]
        force, torque = np.zeros(3), np.zeros(3)
        memory[overlap <= 0.0], a_before[overlap <= 0.0] = 0.0, 0.0
        for i in np.flatnonzero(overlap > 0.0):
            a = np.sqrt(clump.radii[i] * overlap[i])
            arm = arms[i] - np.array([0.0, 0.0, clump.radii[i] - 0.5 * overlap[i]])
            slip = v + np.cross(turn @ w, arm)
            elastic, damper = 4 / 3 * e_star * a * overlap[i], c_n * np.sqrt(2 * e_star * a * clump.mass)
            if law == "ours":
                damper *= _first_step(slip[2], overlap[i], dt) if a_before[i] == 0.0 else 1.0
                others = slip[2] - expected[i] if a_before[i] > 0.0 else 0.0
                middle = slip[2] + 0.5 * others
                normal = max(0.0, (elastic - damper * middle) / (1 + 0.5 * dt * damper / clump.mass))
                expected[i] = slip[2] + dt * normal / clump.mass
            else:
                normal = max(0.0, elastic - damper * slip[2])
            stiffness, limit = 8 * g_star * a, pair.static_friction * normal
            dashpot = -c_t * np.sqrt(stiffness * clump.mass) * slip[:2]
            spring = memory[i] * (stiffness if law == "liggghts" else 1.0)
            if law == "ours" and a < a_before[i]:
                spring = spring * a / a_before[i]
            spring = spring - stiffness * dt * slip[:2]
            slips = np.linalg.norm(spring) > limit
            if slips:
                spring = spring * limit / np.linalg.norm(spring)
            memory[i], a_before[i] = spring / (stiffness if law == "liggghts" else 1.0), a
            tangential = spring if slips else spring + dashpot
            if law == "ours" and np.linalg.norm(tangential) > limit:
                tangential = tangential * limit / np.linalg.norm(tangential)
            contact = np.array([*tangential, normal])
            force, torque = force + contact, torque + np.cross(arm, contact)
        v = v + dt * (force / clump.mass + gravity)
        x = x + dt * v
        w = _spun(w, inertia, turn.T @ torque, dt)
        q = _turned(q, w, dt)
    return tuple(np.array(column) for column in zip(*rows, strict=True))


def _first_step(speed, overlap, dt):
    """Mean of δ^(1/4) from the touch to half a step ahead, over that at the present overlap."""
    way = -speed * dt
    ahead = overlap + 0.5 * way
    return 0.8 * ahead / way * (ahead / overlap) ** 0.25 if way > 0.0 else 1.0


def _spun(w, inertia, torque, dt):
    new = w
    for _ in range(MIDPOINT_ITERATIONS):
        mid = 0.5 * (w + new)
        new = w + dt * (torque - np.cross(mid, inertia * mid)) / inertia
    return new


def _turned(q, w, dt):
    half = np.array([0.0, *(0.5 * dt * w)])
    scalar = q[0] * half[0] - q[1:] @ half[1:]
    vector = q[0] * half[1:] + half[0] * q[1:] + np.cross(q[1:], half[1:])
    new = q + np.array([scalar, *vector])
    return new / np.linalg.norm(new)
