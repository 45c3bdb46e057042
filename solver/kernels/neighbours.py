"""The contact list of a world: pairs of member spheres, and spheres near a surface, that may touch soon.

Bodies are sorted out by bounding boxes, then member against box, then member against member. The list holds while no
two points have approached by more than the skin; tangential springs are carried over by merging two ordered lists.
"""

from solver.backend import ti
from solver.kernels.geometry import nearest, rotation
from solver.state import Vec3


@ti.func
def keep_history(contact: ti.template(), history: ti.template(), world: ti.template(), w):
    """Copy the touching entries of the old list to ``history``; returns how many."""
    kept = 0
    for k in range(world.contacts[w]):
        if contact.radius[w, k] > 0.0:
            history.i[w, kept] = contact.i[w, k]
            history.j[w, kept] = contact.j[w, k]
            history.spring[w, kept] = contact.spring[w, k]
            history.radius[w, kept] = contact.radius[w, k]
            kept += 1
    return kept


@ti.func
def place_members(body: ti.template(), member: ti.template(), w, b, every: ti.template()):
    """Rotation matrix of one body and the centres of its listed members, or of ``every`` member."""
    turn = rotation(body.quaternion[w, b])
    body.rotation[w, b] = turn
    origin = body.position[w, b]
    for m in range(body.first[w, b], body.first[w, b] + body.members[w, b]):
        if ti.static(every):
            member.centre[w, m] = origin + turn @ member.local[w, m]
        elif member.listed[w, m] == 1:
            member.centre[w, m] = origin + turn @ member.local[w, m]


@ti.func
def bound(body: ti.template(), member: ti.template(), w, b):
    """Bounding box of one body, from its member spheres, none of which is listed yet."""
    low, high = body.position[w, b], body.position[w, b]
    for m in range(body.first[w, b], body.first[w, b] + body.members[w, b]):
        member.listed[w, m] = 0
        r = Vec3(1.0, 1.0, 1.0) * member.radius[w, m]
        low = ti.min(low, member.centre[w, m] - r)
        high = ti.max(high, member.centre[w, m] + r)
    body.low[w, b] = low
    body.high[w, b] = high


@ti.func
def append(
    world: ti.template(),
    body: ti.template(),
    member: ti.template(),
    contact: ti.template(),
    history: ti.template(),
    surface: ti.template(),
    w,
    i,
    j,
    old,
    n_old,
):
    """Add entry (i, j) with its old spring, if any; returns the position reached in the old list."""
    while old < n_old and (history.i[w, old] < i or (history.i[w, old] == i and history.j[w, old] < j)):
        old += 1
    k = world.contacts[w]
    if k >= contact.i.shape[1]:
        world.overflow[w] = 1
    else:
        a, radius = member.body[w, i], member.radius[w, i]
        mass, kind = body.mass[w, a], 0
        body.listed[w, a] = 1
        member.listed[w, i] = 1
        if j < member.body.shape[1]:
            b, other = member.body[w, j], member.radius[w, j]
            body.listed[w, b] = 1
            member.listed[w, j] = 1
            radius *= other / (radius + other)
            mass *= body.mass[w, b] / (mass + body.mass[w, b])
            kind = body.kind[w, b]
        else:
            kind = surface.kind[w, j - member.body.shape[1]]
        contact.i[w, k] = i
        contact.j[w, k] = j
        contact.reduced_radius[w, k] = radius
        contact.reduced_mass[w, k] = mass
        contact.kind[w, k] = kind
        contact.radius[w, k] = 0.0
        contact.spring[w, k] = Vec3(0.0, 0.0, 0.0)
        if old < n_old and history.i[w, old] == i and history.j[w, old] == j:
            contact.spring[w, k] = history.spring[w, old]
            contact.radius[w, k] = history.radius[w, old]
        world.contacts[w] = k + 1
    return old


@ti.func
def rebuild(
    world: ti.template(),
    body: ti.template(),
    member: ti.template(),
    contact: ti.template(),
    history: ti.template(),
    surface: ti.template(),
    w,
):
    """Build the contact list of world ``w``; entries come out ordered by (i, j)."""
    n_old = keep_history(contact, history, world, w)
    world.contacts[w] = 0
    world.moved[w] = 0.0
    world.rebuilds[w] += 1
    skin = world.skin[w]
    n = world.bodies[w]
    for b in range(n):
        body.listed[w, b] = 0
        body.travel[w, b] = 0.0
        if body.alive[w, b] == 1:
            place_members(body, member, w, b, True)
            bound(body, member, w, b)
    old = 0
    for a in range(n):
        if body.alive[w, a] == 1:
            low, high = body.low[w, a] - skin, body.high[w, a] + skin
            near = 0
            for b in range(a + 1, n):
                if body.alive[w, b] == 1:
                    apart = 0
                    for d in ti.static(range(3)):
                        if body.low[w, b][d] > high[d] or body.high[w, b][d] < low[d]:
                            apart = 1
                    if apart == 0:
                        body.near[w, near] = b
                        near += 1
            for i in range(body.first[w, a], body.first[w, a] + body.members[w, a]):
                centre, reach = member.centre[w, i], member.radius[w, i] + skin
                for k in range(near):
                    b = body.near[w, k]
                    apart = 0
                    for d in ti.static(range(3)):
                        if body.low[w, b][d] > centre[d] + reach or body.high[w, b][d] < centre[d] - reach:
                            apart = 1
                    if apart == 0:
                        for j in range(body.first[w, b], body.first[w, b] + body.members[w, b]):
                            gap = centre - member.centre[w, j]
                            limit = reach + member.radius[w, j]
                            if gap.dot(gap) < limit * limit:
                                old = append(world, body, member, contact, history, surface, w, i, j, old, n_old)
                for s in range(world.surfaces[w]):
                    if surface.active[w, s] == 1:
                        if nearest(surface.shape[w, s], surface.geometry[w, s], centre)[3] < reach:
                            j = member.body.shape[1] + s
                            old = append(world, body, member, contact, history, surface, w, i, j, old, n_old)
