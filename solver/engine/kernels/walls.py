"""Walls: how they move, and how far a member sphere is from their surfaces.

A triangle mesh acts through smooth patches (``solver/engine/tables.py``): one contact per sphere and patch, at the
nearest point of the patch, so a sphere that rolls from facet to facet keeps its spring and feels no edge. Where two
patches meet in an edge, only one of them responds.
"""

from solver.backend import ti
from solver.engine.kernels.geometry import nearest_on_revolved, nearest_on_triangle, offset, rotation, turned
from solver.engine.state import Vec3, Vec4

APART = 1e30
"""Distance [m] that means "does not touch"."""


@ti.func
def clear_walls(s: ti.template(), w):
    """Reset the forces on walls to those of sleeping bodies, which are summed anew after a body woke or fell asleep."""
    for k in range(s.world.walls[w]):
        if s.world.stirred[w] == 1:
            s.wall.held[w, k] = Vec3(0.0, 0.0, 0.0)
            s.wall.held_torque[w, k] = Vec3(0.0, 0.0, 0.0)
        s.wall.force[w, k] = s.wall.held[w, k]
        s.wall.torque[w, k] = s.wall.held_torque[w, k]


@ti.func
def move_walls(s: ti.template(), w):
    """Advance the poses of moving walls by a step."""
    for k in range(s.world.walls[w]):
        if s.wall.moving[w, k] == 1:
            dt, omega = s.world.dt[w], s.wall.omega[w, k]
            s.wall.origin[w, k] = s.wall.origin[w, k] + dt * s.wall.velocity[w, k]
            # ``turned`` takes the spin in the local frame.
            local = s.wall.turn[w, k].transpose() @ omega
            s.wall.quaternion[w, k] = turned(s.wall.quaternion[w, k], local, dt)
            s.wall.turn[w, k] = rotation(s.wall.quaternion[w, k])
            speed = s.wall.velocity[w, k].norm() + omega.norm() * s.wall.extent[w, k]
            s.wall.travel[w, k] = s.wall.travel[w, k] + dt * speed
            if s.wall.travel[w, k] > s.wall.margin[w, k]:
                s.world.outdated[w] = 1


@ti.func
def into_wall(s: ti.template(), w, k, point):
    """``point`` of the world in the frame of wall ``k``."""
    return s.wall.turn[w, k].transpose() @ (point - s.wall.origin[w, k])


@ti.func
def from_primitive(s: ti.template(), w, p, point):
    """Unit normal towards ``point`` from primitive ``p`` and the distance [m], in the world: (nx, ny, nz, distance).

    Plane: the distance is signed, so that a body below it is pushed up.
    """
    k = s.surface.wall[w, p]
    found = Vec4(0.0, 0.0, 0.0, APART)
    if s.surface.shape[w, p] == 0:
        turn = s.wall.turn[w, k]
        n = Vec3(turn[0, 2], turn[1, 2], turn[2, 2])
        found = Vec4(n[0], n[1], n[2], n.dot(point - s.wall.origin[w, k]))
    else:
        hit = nearest_on_revolved(s.surface.geometry[w, p], into_wall(s, w, k, point))
        n = s.wall.turn[w, k] @ offset(hit)
        found = Vec4(n[0], n[1], n[2], hit[3])
    return found


@ti.func
def answers(s: ti.template(), w, t, place, gap):
    """1 if triangle ``t`` responds at a nearest point at ``place``; ``gap`` leads from there to the sphere's centre."""
    mine = 1
    for e in ti.static(range(3)):
        if place == 1 + e:
            duty = s.triangle.edges[w, t][e]
            guard = Vec3(s.triangle.guards[w, t][e, 0], s.triangle.guards[w, t][e, 1], s.triangle.guards[w, t][e, 2])
            # Above the neighbour's face, that face is nearest and responds.
            if duty == 1 or (duty == 2 and guard.dot(gap) > 0.0):
                mine = 0
        if place == 4 + e and s.triangle.corners[w, t][e] == 1:
            mine = 0
    return mine


@ti.func
def from_patch(s: ti.template(), w, k, first, count, point):
    """The same as :func:`from_primitive` for triangles ``candidate[first : first + count]`` of a patch of wall k."""
    local = into_wall(s, w, k, point)
    best, owner, place = APART, -1, 0
    gap = Vec3(0.0, 0.0, 0.0)
    for c in range(first, first + count):
        t = s.candidate.triangle[w, c]
        hit = nearest_on_triangle(s.triangle.a[w, t], s.triangle.b[w, t], s.triangle.c[w, t], local)
        other = local - offset(hit)
        distance2 = other.dot(other)
        if distance2 < best:
            best, owner, place, gap = distance2, t, ti.cast(hit[3], ti.i32), other
    found = Vec4(0.0, 0.0, 0.0, APART)
    if owner >= 0 and best > 0.0:
        if answers(s, w, owner, place, gap) == 1:
            distance = ti.sqrt(best)
            n = s.wall.turn[w, k] @ (gap / distance)
            found = Vec4(n[0], n[1], n[2], distance)
    return found


@ti.func
def surface_velocity(s: ti.template(), w, k, point):
    """Velocity [m/s] of wall ``k`` at ``point``."""
    velocity = Vec3(0.0, 0.0, 0.0)
    if s.wall.moving[w, k] == 1:
        velocity = s.wall.velocity[w, k] + s.wall.omega[w, k].cross(point - s.wall.origin[w, k])
    return velocity
