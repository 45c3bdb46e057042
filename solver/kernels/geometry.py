"""Rotations, and the nearest point of a surface."""

from solver.backend import ti
from solver.state import Mat3, Vec4


@ti.func
def rotation(q):
    """Rotation matrix of a unit quaternion wxyz (principal frame → world)."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    return Mat3(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


@ti.func
def turned(q, spin, dt):
    """Quaternion after turning by ``spin`` [rad/s, principal frame] for ``dt``; exact to O(|spin dt|³), length one."""
    h = 0.5 * dt * spin
    new = Vec4(
        q[0] - q[1] * h[0] - q[2] * h[1] - q[3] * h[2],
        q[1] + q[0] * h[0] + q[2] * h[2] - q[3] * h[1],
        q[2] + q[0] * h[1] + q[3] * h[0] - q[1] * h[2],
        q[3] + q[0] * h[2] + q[1] * h[1] - q[2] * h[0],
    )
    return new / ti.sqrt(new.dot(new))


@ti.func
def nearest(shape, geometry, point):
    """Unit vector from the nearest point of a surface to ``point``, and the distance [m]: (nx, ny, nz, distance).

    Plane: the distance is signed, so that a body below the plate is pushed up. Revolved segment: the nearest point
    in the half plane (r, z), the edges included; a centre exactly on the surface has no normal and feels nothing.
    """
    found = Vec4(0.0, 0.0, 1.0, point[2] - geometry[0])
    if shape == 1:
        r = ti.sqrt(point[0] * point[0] + point[1] * point[1])
        along_r, along_z = geometry[2] - geometry[0], geometry[3] - geometry[1]
        t = (r - geometry[0]) * along_r + (point[2] - geometry[1]) * along_z
        t = ti.min(1.0, ti.max(0.0, t / (along_r * along_r + along_z * along_z)))
        gap_r, gap_z = r - (geometry[0] + t * along_r), point[2] - (geometry[1] + t * along_z)
        distance = ti.sqrt(gap_r * gap_r + gap_z * gap_z)
        found = Vec4(0.0, 0.0, 0.0, distance)
        if distance > 0.0 and r > 0.0:
            found[0] = point[0] / r * gap_r / distance
            found[1] = point[1] / r * gap_r / distance
            found[2] = gap_z / distance
        elif distance > 0.0:
            found[2] = gap_z / distance
    return found
