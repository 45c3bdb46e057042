"""The contact list of a world: pairs of member spheres, and spheres near a surface, that may touch soon.

Bodies near each other are found with a hashed grid of their centres and with their bounding boxes; then members are
tested against boxes and against members, so the cost grows with the number of bodies. The list contains pairs whose gap
is at most the largest one at which a pull may hold (``grip``) plus the margins of both partners; it is valid until
something has travelled further than its own margin. A margin is the distance that a body moves in ``AHEAD`` steps, so
one fast body does not make the list long for all the others. Tangential springs, and what effects keep of a contact,
are carried over by merging two ordered lists.
"""

from solver.backend import ti
from solver.engine.kernels.geometry import nearest_on_triangle, offset, rotation
from solver.engine.kernels.narrowphase import find_leads
from solver.engine.kernels.walls import from_primitive, into_wall
from solver.engine.state import Ints3, Vec3

AHEAD = 60.0
"""Steps that a body at its present speed takes to use up its margin."""
LEAST, MOST = 0.1, 1.5
"""Limits of a margin, in skins: a body at rest may be hit, and a fast one need not list partners that are far away."""


@ti.func
def bound(s: ti.template(), w, b):
    """Bounding box of one body, from its member spheres; marks all of them as not listed."""
    low, high = s.body.position[w, b], s.body.position[w, b]
    for m in range(s.body.first[w, b], s.body.first[w, b] + s.body.members[w, b]):
        s.member.listed[w, m] = 0
        r = Vec3(1.0, 1.0, 1.0) * s.member.radius[w, m]
        low = ti.min(low, s.member.centre[w, m] - r)
        high = ti.max(high, s.member.centre[w, m] + r)
    s.body.low[w, b] = low
    s.body.high[w, b] = high


@ti.func
def bucket(s: ti.template(), c):
    """Hash of a cell's whole-number coordinates (Teschner et al. 2003, Optimized spatial hashing)."""
    return ((c[0] * 73856093) ^ (c[1] * 19349663) ^ (c[2] * 83492791)) & (s.grid.bucket.shape[1] - 1)


@ti.func
def fill_grid(s: ti.template(), w):
    """Sort bodies into the hashed grid by their centres. A cell is as long as the largest body, grip and margins."""
    for h in range(s.grid.bucket.shape[1]):
        s.grid.bucket[w, h] = -1
    for b in range(s.world.bodies[w]):
        if s.body.alive[w, b] == 1:
            h = bucket(s, ti.floor(s.body.position[w, b] / s.world.cell[w], ti.i32))
            s.body.next[w, b] = s.grid.bucket[w, h]
            s.grid.bucket[w, h] = b


@ti.func
def find_near(s: ti.template(), w, a):
    """List bodies after ``a`` with bounding boxes within both margins of its own, ascending; returns how many."""
    reach = s.body.margin[w, a] + s.world.grip[w]
    low, high = s.body.low[w, a] - reach, s.body.high[w, a] + reach
    home = ti.floor(s.body.position[w, a] / s.world.cell[w], ti.i32)
    near = 0
    for c in range(27):
        h = bucket(s, home + Ints3(c % 3 - 1, (c // 3) % 3 - 1, c // 9 - 1))
        b = s.grid.bucket[w, h]
        while b > a:  # a bucket's bodies descend
            margin = s.body.margin[w, b]
            other_low, other_high = s.body.low[w, b] - margin, s.body.high[w, b] + margin
            apart = 0
            for d in ti.static(range(3)):
                if other_low[d] > high[d] or other_high[d] < low[d]:
                    apart = 1
            if apart == 0:
                # Keep the list ascending; two cells may share a bucket, so a body may be found twice.
                at = near
                while at > 0 and s.body.near[w, at - 1] > b:
                    at -= 1
                if at == 0 or s.body.near[w, at - 1] != b:
                    for k in range(near - at):
                        s.body.near[w, near - k] = s.body.near[w, near - k - 1]
                    s.body.near[w, at] = b
                    near += 1
            b = s.body.next[w, b]
    return near


@ti.func
def bodily_margin(s: ti.template(), w, b):
    """Margin [m] of body ``b``: how far its members may travel before the list is rebuilt."""
    speed = s.body.velocity[w, b].norm() + s.body.spin[w, b].norm() * s.body.swing[w, b]
    skin = s.world.skin[w]
    return ti.min(ti.max(AHEAD * s.world.dt[w] * speed, LEAST * skin), MOST * skin)


@ti.func
def keep_history(s: ti.template(), w):
    """Copy the touching entries of the old list to ``history``; returns how many."""
    kept = 0
    for k in range(s.world.contacts[w]):
        if s.contact.radius[w, k] > 0.0:
            s.history.i[w, kept] = s.contact.i[w, k]
            s.history.j[w, kept] = s.contact.j[w, k]
            s.history.spring[w, kept] = s.contact.spring[w, k]
            s.history.loss[w, kept] = s.contact.loss[w, k]
            s.history.radius[w, kept] = s.contact.radius[w, k]
            s.history.expected[w, kept] = s.contact.expected[w, k]
            if ti.static(s.effects):
                for column in ti.static(range(s.memory.number.shape[2])):
                    s.memory.kept[w, kept, column] = s.memory.number[w, k, column]
            kept += 1
    return kept


@ti.func
def place_members(s: ti.template(), w, b, every: ti.template()):
    """Rotation matrix of one body and the centres of its listed members, or of ``every`` member."""
    turn = rotation(s.body.quaternion[w, b])
    s.body.rotation[w, b] = turn
    origin = s.body.position[w, b]
    for m in range(s.body.first[w, b], s.body.first[w, b] + s.body.members[w, b]):
        if ti.static(every):
            s.member.centre[w, m] = origin + turn @ s.member.local[w, m]
        elif s.member.listed[w, m] == 1:
            s.member.centre[w, m] = origin + turn @ s.member.local[w, m]


@ti.func
def append(s: ti.template(), w, i, j, first, count):
    """Add entry (i, j) with ``count`` triangles from ``first``; :func:`complete` fills in the rest."""
    k = s.world.contacts[w]
    if k >= s.contact.i.shape[1]:
        s.world.overflow[w] = 1
    else:
        s.contact.i[w, k] = i
        s.contact.j[w, k] = j
        s.contact.first[w, k] = first
        s.contact.triangles[w, k] = count
        s.world.contacts[w] = k + 1


@ti.func
def complete(s: ti.template(), w, k):
    """Fill in bodies, law, reduced radius and reduced mass of entry ``k``."""
    i, j = s.contact.i[w, k], s.contact.j[w, k]
    a, b, radius = s.member.body[w, i], -1, s.member.radius[w, i]
    mass, kind = s.body.mass[w, a], 0
    s.body.listed[w, a] = 1
    s.member.listed[w, i] = 1
    if j < s.member.body.shape[1]:
        other = s.member.radius[w, j]
        b = s.member.body[w, j]
        s.body.listed[w, b] = 1
        s.member.listed[w, j] = 1
        radius *= other / (radius + other)
        mass *= s.body.mass[w, b] / (mass + s.body.mass[w, b])
        kind = s.body.kind[w, b]
    else:
        wall = s.surface.wall[w, j - s.member.body.shape[1]]
        b = -1 - wall
        kind = s.wall.kind[w, wall]
    s.contact.a[w, k] = a
    s.contact.b[w, k] = b
    s.contact.law[w, k] = s.body.kind[w, a] * s.world.kinds[w] + kind
    s.contact.reduced_radius[w, k] = radius
    s.contact.reduced_mass[w, k] = mass


@ti.func
def carry_over(s: ti.template(), w, n_old):
    """Complete the new entries and restore the springs of those that touched before."""
    old = 0
    for k in range(s.world.contacts[w]):
        complete(s, w, k)
        i, j = s.contact.i[w, k], s.contact.j[w, k]
        while old < n_old and (s.history.i[w, old] < i or (s.history.i[w, old] == i and s.history.j[w, old] < j)):
            old += 1
        s.contact.radius[w, k] = 0.0
        s.contact.spring[w, k] = Vec3(0.0, 0.0, 0.0)
        s.contact.loss[w, k] = Vec3(0.0, 0.0, 0.0)
        if ti.static(s.effects):
            for column in ti.static(range(s.memory.number.shape[2])):
                s.memory.number[w, k, column] = 0.0
        if old < n_old and s.history.i[w, old] == i and s.history.j[w, old] == j:
            s.contact.spring[w, k] = s.history.spring[w, old]
            s.contact.loss[w, k] = s.history.loss[w, old]
            s.contact.radius[w, k] = s.history.radius[w, old]
            s.contact.expected[w, k] = s.history.expected[w, old]
            if ti.static(s.effects):
                for column in ti.static(range(s.memory.number.shape[2])):
                    s.memory.number[w, k, column] = s.memory.kept[w, old, column]


@ti.func
def list_members(s: ti.template(), w, i, near):
    """Add entries of member ``i`` with members of the ``near`` bodies in ``body.near``."""
    centre = s.member.centre[w, i]
    own = s.member.radius[w, i] + s.body.margin[w, s.member.body[w, i]] + s.world.grip[w]
    for k in range(near):
        b = s.body.near[w, k]
        reach = own + s.body.margin[w, b]
        low, high = s.body.low[w, b], s.body.high[w, b]
        apart = 0
        for d in ti.static(range(3)):
            if low[d] > centre[d] + reach or high[d] < centre[d] - reach:
                apart = 1
        if apart == 0:
            for j in range(s.body.first[w, b], s.body.first[w, b] + s.body.members[w, b]):
                gap = centre - s.member.centre[w, j]
                limit = reach + s.member.radius[w, j]
                if gap.dot(gap) < limit * limit:
                    append(s, w, i, j, 0, 0)


@ti.func
def list_primitives(s: ti.template(), w, i):
    """Add entries of member ``i`` with planes and revolved segments."""
    own = s.member.radius[w, i] + s.body.margin[w, s.member.body[w, i]] + s.world.grip[w]
    for p in range(s.world.primitives[w]):
        wall = s.surface.wall[w, p]
        if s.wall.active[w, wall] == 1:
            distance = from_primitive(s, w, p, s.member.centre[w, i])[3]
            if distance < own + s.wall.margin[w, wall]:
                append(s, w, i, s.member.body.shape[1] + p, 0, 0)


@ti.func
def collect_triangles(s: ti.template(), w, k, i):
    """Add the triangles of mesh wall ``k`` near member ``i`` to ``candidate``, ascending; returns how many."""
    margin = s.body.margin[w, s.member.body[w, i]] + s.wall.margin[w, k]
    reach = s.member.radius[w, i] + margin + s.world.grip[w]
    local = into_wall(s, w, k, s.member.centre[w, i])
    cells = s.wall.cells[w, k]
    low = ti.floor((local - reach - s.wall.low[w, k]) / s.wall.cell[w, k], ti.i32)
    high = ti.floor((local + reach - s.wall.low[w, k]) / s.wall.cell[w, k], ti.i32)
    begin = s.world.candidates[w]
    count = 0
    for x in range(ti.max(low[0], 0), ti.min(high[0] + 1, cells[0])):
        for y in range(ti.max(low[1], 0), ti.min(high[1] + 1, cells[1])):
            for z in range(ti.max(low[2], 0), ti.min(high[2] + 1, cells[2])):
                cell = s.wall.first_cell[w, k] + (x * cells[1] + y) * cells[2] + z
                for item in range(s.mesh_cell.first[w, cell], s.mesh_cell.first[w, cell + 1]):
                    t = s.mesh_item.triangle[w, item]
                    hit = nearest_on_triangle(s.triangle.a[w, t], s.triangle.b[w, t], s.triangle.c[w, t], local)
                    gap = local - offset(hit)
                    if gap.dot(gap) < reach * reach:
                        at = count
                        while at > 0 and s.candidate.triangle[w, begin + at - 1] > t:
                            at -= 1
                        fresh = at == 0 or s.candidate.triangle[w, begin + at - 1] != t
                        if begin + count >= s.candidate.triangle.shape[1]:
                            s.world.overflow[w] = 1
                        elif fresh:
                            for m in range(count - at):
                                s.candidate.triangle[w, begin + count - m] = s.candidate.triangle[
                                    w, begin + count - m - 1
                                ]
                            s.candidate.triangle[w, begin + at] = t
                            count += 1
    s.world.candidates[w] = begin + count
    return count


@ti.func
def list_patches(s: ti.template(), w, i):
    """Add entries of member ``i`` with the patches of meshes."""
    for k in range(s.world.walls[w]):
        if s.wall.active[w, k] == 1 and s.wall.cell[w, k] > 0.0:
            begin = s.world.candidates[w]
            end = begin + collect_triangles(s, w, k, i)
            while begin < end:
                p = s.triangle.surface[w, s.candidate.triangle[w, begin]]
                stop = begin + 1
                while stop < end and s.triangle.surface[w, s.candidate.triangle[w, stop]] == p:
                    stop += 1
                append(s, w, i, s.member.body.shape[1] + p, begin, stop - begin)
                begin = stop


@ti.func
def rebuild(s: ti.template(), w):
    """Build the contact list of world ``w``; entries come out ordered by (i, j)."""
    n_old = keep_history(s, w)
    s.world.outdated[w] = 0
    s.world.rebuilds[w] = s.world.rebuilds[w] + 1
    s.world.stirred[w] = 1
    for k in range(s.world.walls[w]):
        s.wall.travel[w, k] = 0.0
        # A wall at rest needs no margin: the list is rebuilt as soon as the wall is set in motion.
        s.wall.margin[w, k] = 0.5 * s.world.skin[w] * s.wall.moving[w, k]
    for b in range(s.world.bodies[w]):
        s.body.listed[w, b] = 0
        s.body.travel[w, b] = 0.0
        if s.body.alive[w, b] == 1:
            s.body.margin[w, b] = bodily_margin(s, w, b)
            place_members(s, w, b, True)
            bound(s, w, b)
    fill_grid(s, w)
    # Once entries were lost, bodies may have passed through each other, so the flag stays set even if this list fits.
    overflowed = s.world.overflow[w]
    for narrow in range(2):
        if narrow == 0 or s.world.overflow[w] == 1:
            # A dense bed that moves fast as a whole may not fit; with the least margins it is rebuilt more often.
            s.world.overflow[w] = 0
            s.world.contacts[w] = 0
            s.world.candidates[w] = 0
            if narrow == 1:
                for b in range(s.world.bodies[w]):
                    s.body.margin[w, b] = LEAST * s.world.skin[w]
            for a in range(s.world.bodies[w]):
                if s.body.alive[w, a] == 1:
                    near = find_near(s, w, a)
                    for i in range(s.body.first[w, a], s.body.first[w, a] + s.body.members[w, a]):
                        list_members(s, w, i, near)
                        list_primitives(s, w, i)
                        list_patches(s, w, i)
    s.world.overflow[w] = ti.max(overflowed, s.world.overflow[w])
    carry_over(s, w, n_old)
    if ti.static(s.sharing):
        find_leads(s, w)
