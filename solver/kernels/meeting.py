"""Where the surfaces of an entry of the contact list meet, and whether they may act on each other."""

from solver.backend import ti
from solver.kernels.walls import from_patch, from_primitive
from solver.state import Vec4


@ti.func
def meet_surface(s: ti.template(), w, k):
    """Normal and overlap of entry ``k`` of the list, which is one with a surface: (nx, ny, nz, overlap)."""
    i = s.contact.i[w, k]
    p = s.contact.j[w, k] - s.member.body.shape[1]
    hit = Vec4(0.0, 0.0, 0.0, 0.0)
    if s.surface.shape[w, p] < 2:
        hit = from_primitive(s, w, p, s.member.centre[w, i])
    else:
        wall = s.surface.wall[w, p]
        hit = from_patch(s, w, wall, s.contact.first[w, k], s.contact.triangles[w, k], s.member.centre[w, i])
    return Vec4(hit[0], hit[1], hit[2], s.member.radius[w, i] - hit[3])


@ti.func
def may_hold(s: ti.template(), w, k):
    """Whether the surfaces of entry ``k`` have touched and an effect that pulls may hold them at a gap."""
    return s.contact.radius[w, k] > 0.0 and s.world.grip[w] > 0.0


@ti.func
def meet(s: ti.template(), w, k):
    """Normal from j to i and overlap [m] of entry ``k``: (nx, ny, nz, overlap); the overlap is ≤ 0 when apart.

    The true distance is found only of surfaces that overlap or may hold each other.
    """
    i, j = s.contact.i[w, k], s.contact.j[w, k]
    found = Vec4(0.0, 0.0, 0.0, -1.0)
    if j < s.member.body.shape[1]:
        gap = s.member.centre[w, i] - s.member.centre[w, j]
        reach = s.member.radius[w, i] + s.member.radius[w, j]
        distance2 = gap.dot(gap)
        near = distance2 < reach * reach
        if ti.static(s.effects):
            near = near or may_hold(s, w, k)
        if near and distance2 > 0.0:
            distance = ti.sqrt(distance2)
            n = (1.0 / distance) * gap
            found = Vec4(n[0], n[1], n[2], reach - distance)
    else:
        found = meet_surface(s, w, k)
    return found


@ti.func
def lasts(s: ti.template(), w, k, overlap):
    """Whether entry ``k`` may act: its surfaces overlap, or have touched and something may hold them still."""
    acts = overlap > 0.0
    if ti.static(s.effects):
        acts = overlap > 0.0 or may_hold(s, w, k)
    return acts
