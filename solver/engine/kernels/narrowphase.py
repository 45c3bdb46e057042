"""Where the surfaces of an entry of the contact list meet, whether they act on each other, and on what of a clump.

Of a clump a contact feels the mass that damps it, and a share where several spheres touch the same partner.

The normal dashpot c = c_n √(2 E* a m) gives the declared restitution e when m is the mass that the contact moves. A
sphere off the centre of its body moves less than the whole:

    body_mass           m = m*, of whole bodies: as EDEM and LIGGGHTS. Too much damping off the centre, √N-fold too much
                        where N spheres land flat.
    local_mass          1/m = Σ over both bodies of 1/m_b + q·I_b⁻¹ q,  q = r × n, r the arm from the centre of mass.
    local_mass_shared   the same, and contacts of one pair of bodies (or of a body and a wall) act as one. With overlaps
                        δ_j and normals n_j, S = Σ δ_j n_j, contact k has the share w = δ_k / max(δ_k, S·n_k) of
                        stiffness and damping. Its mass is taken at its own point where it is alone in its direction,
                        at the mean of the points (weights δ_j) where all normals agree, and in between as they agree,
                        (S·n_k)/Σδ_j. Shares change without a jump when a sphere touches or lets go.
                        The energy account takes springs as if they did not share: it closes, but what it calls elastic
                        is too much by the shares, and what it calls dissipated too little while bodies are pressed.

The locally reduced mass, and one contact per pair as the cure of too much stiffness and damping: Berry, Zhang & Haeri
2023, Powder Technology 416:118209 (DOI 10.1016/j.powtec.2022.118209). The weights are ours.
"""

from solver.backend import ti
from solver.engine.kernels.walls import from_patch, from_primitive
from solver.engine.state import Vec3, Vec4

BODY_MASS, LOCAL_MASS, SHARED = 0, 1, 2
"""Places in ``contact_model.CLUMP_RULES``."""


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


@ti.func
def pliancy(s: ti.template(), w, b, q):
    """How easily the point of body ``b`` with the arm's product ``q`` = r × n [m] gives way along n [1/kg]."""
    turned = s.body.rotation[w, b].transpose() @ q
    return s.body.inverse_mass[w, b] + turned.dot(s.body.inverse_inertia[w, b] * turned)


@ti.func
def local_mass(s: ti.template(), w, a, b, point, n):
    """Mass [kg] that bodies ``a`` and ``b`` (a wall if negative) show at ``point`` along ``n``."""
    inverse = pliancy(s, w, a, (point - s.body.position[w, a]).cross(n))
    if b >= 0:
        inverse += pliancy(s, w, b, (point - s.body.position[w, b]).cross(n))
    return 1.0 / inverse


@ti.func
def contact_point(s: ti.template(), w, i, n, overlap):
    """The middle of the overlap of member ``i`` and its partner [m]."""
    return s.member.centre[w, i] - n * (s.member.radius[w, i] - 0.5 * overlap)


@ti.func
def find_leads(s: ti.template(), w):
    """Note for every entry of the list the first one of its pair, where the sums over the pair stand."""
    for k in range(s.world.contacts[w]):
        a, b = s.contact.a[w, k], s.contact.b[w, k]
        # What an earlier entry, or an earlier list, has left here says by itself whether it is of this pair.
        lead = k
        known = s.lead.wall[w, -1 - b] if b < 0 else s.lead.body[w, b]
        if known >= 0 and known < k:
            if s.contact.a[w, known] == a and s.contact.b[w, known] == b:
                lead = known
        if b < 0:
            s.lead.wall[w, -1 - b] = lead
        else:
            s.lead.body[w, b] = lead
        s.pair.lead[w, k] = lead


@ti.func
def sum_pairs(s: ti.template(), w, entries):
    """Overlaps, normals and points of all touching contacts of each pair in the first ``entries`` of the live list."""
    for item in range(entries):
        lead = s.pair.lead[w, s.contact.live[w, item]]
        s.pair.overlap[w, lead] = 0.0
        s.pair.normal[w, lead] = Vec3(0.0, 0.0, 0.0)
        s.pair.point[w, lead] = Vec3(0.0, 0.0, 0.0)
    for item in range(entries):
        k = s.contact.live[w, item]
        hit = meet(s, w, k)
        overlap = hit[3]
        if overlap > 0.0:
            n, lead = Vec3(hit[0], hit[1], hit[2]), s.pair.lead[w, k]
            point = contact_point(s, w, s.contact.i[w, k], n, overlap)
            s.pair.overlap[w, lead] = s.pair.overlap[w, lead] + overlap
            s.pair.normal[w, lead] = s.pair.normal[w, lead] + overlap * n
            s.pair.point[w, lead] = s.pair.point[w, lead] + overlap * (point - s.body.position[w, s.contact.a[w, k]])


@ti.func
def shared_point(s: ti.template(), w, k, n, point):
    """Where entry ``k`` takes its mass: at its own ``point`` [m], or nearer to the mean of those that push with it."""
    lead, origin = s.pair.lead[w, k], s.body.position[w, s.contact.a[w, k]]
    total, found = s.pair.overlap[w, lead], point
    if total > 0.0:
        agreement = ti.max(0.0, s.pair.normal[w, lead].dot(n) / total)
        mean = origin + s.pair.point[w, lead] / total
        found = point + ti.min(1.0, agreement) * (mean - point)
    return found


@ti.func
def share(s: ti.template(), w, k, n, overlap):
    """Share of entry ``k`` in the stiffness and damping of its pair, 0 … 1."""
    together = s.pair.normal[w, s.pair.lead[w, k]].dot(n)
    found = 1.0
    if overlap > 0.0 and together > overlap:
        found = overlap / together
    return found
