"""Rotations, and nearest points on primitives and triangles."""

from solver.backend import ti
from solver.engine.state import Mat3, Vec3, Vec4


@ti.func
def rotation(q):
    """Rotation matrix of a unit quaternion wxyz (local frame → world)."""
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
    """Quaternion after rotation with ``spin`` [rad/s, local frame] for ``dt`` [s]; exact to O(|spin dt|³)."""
    h = 0.5 * dt * spin
    new = Vec4(
        q[0] - q[1] * h[0] - q[2] * h[1] - q[3] * h[2],
        q[1] + q[0] * h[0] + q[2] * h[2] - q[3] * h[1],
        q[2] + q[0] * h[1] + q[3] * h[0] - q[1] * h[2],
        q[3] + q[0] * h[2] + q[1] * h[1] - q[2] * h[0],
    )
    # One step of Newton's method for 1/√(q·q), started from 1: the length 1 + ε becomes 1 − 3/2 ε².
    return new * (1.5 - 0.5 * new.dot(new))


@ti.func
def nearest_on_revolved(geometry, point):
    """Unit vector to ``point`` from the nearest point of a revolved segment, and the distance [m]; all in its frame.

    The nearest point is found in the half plane (r, z), including the ends of the segment; a sphere whose centre is
    exactly on the surface has no normal and feels no force.
    """
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


@ti.func
def nearest_on_triangle(a, b, c, point):
    """Nearest point of a triangle (3) and where it lies: 0 face; 1, 2, 3 edge ab, bc, ca; 4, 5, 6 corner a, b, c.

    Source: Ericson, Real-Time Collision Detection (2005), §5.1.5.
    """
    ab, ac, ap = b - a, c - a, point - a
    d1, d2 = ab.dot(ap), ac.dot(ap)
    bp, cp = point - b, point - c
    d3, d4 = ab.dot(bp), ac.dot(bp)
    d5, d6 = ab.dot(cp), ac.dot(cp)
    on_ab, on_bc, on_ca = d1 * d4 - d3 * d2, d3 * d6 - d5 * d4, d5 * d2 - d1 * d6
    place, found = 0, a
    if d1 <= 0.0 and d2 <= 0.0:
        place = 4
    elif d3 >= 0.0 and d4 <= d3:
        place, found = 5, b
    elif d6 >= 0.0 and d5 <= d6:
        place, found = 6, c
    elif on_ab <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        place, found = 1, a + (d1 / (d1 - d3)) * ab
    elif on_ca <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        place, found = 3, a + (d2 / (d2 - d6)) * ac
    elif on_bc <= 0.0 and d4 >= d3 and d5 >= d6:
        place, found = 2, b + ((d4 - d3) / ((d4 - d3) + (d5 - d6))) * (c - b)
    else:
        found = a + (on_ca * ab + on_ab * ac) / (on_ab + on_bc + on_ca)
    return Vec4(found[0], found[1], found[2], ti.cast(place, ti.f64))


@ti.func
def offset(hit):
    """The nearest point in a result of :func:`nearest_on_triangle`."""
    return Vec3(hit[0], hit[1], hit[2])
