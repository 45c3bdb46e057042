"""Where the surfaces of a contact list entry meet, whether they act on each other, and on which mass of a clump.

For clumps, ``contact.clump_rule`` decides which mass the dashpots of a contact damp, and which share of stiffness and
damping a contact has where several spheres touch the same partner.

The normal dashpot c = c_n √(2 E* a m) gives the declared restitution e when m is the mass that the contact moves. A
sphere that is off the centre of its body moves less than the body's whole mass:

    body_mass           m = m* of the whole bodies, as in EDEM and LIGGGHTS. Too much damping off the centre, √N times
                        too much where N spheres land flat.
    local_mass          1/m = Σ over both bodies of 1/m_b + q·I_b⁻¹ q,  q = r × n, r the arm from the centre of mass.
    local_mass_shared   the same, and contacts of one pair of bodies (or of a body and a wall) act as one. With overlaps
                        δ_j and normals n_j, S = Σ δ_j n_j, contact k has the share w = δ_k / max(δ_k, S·n_k) of
                        stiffness and damping. Its mass is taken at its own point where it is alone in its direction,
                        at the mean of the points (weights δ_j) where all normals agree, and otherwise in between, by
                        the agreement (S·n_k)/Σδ_j. Shares change continuously when a sphere touches or separates.
                        The energy account treats springs as if they did not share: it closes, but while bodies are
                        pressed together its elastic energy is too high and its dissipated energy too low.

Source of the local mass, and of one contact per pair as the remedy for too much stiffness and damping: Berry, Zhang &
Haeri 2023, Powder Technology 416:118209 (DOI 10.1016/j.powtec.2022.118209). The weights are our own.
"""

from solver.backend import ti
from solver.engine.kernels.walls import from_patch, from_primitive
from solver.engine.state import Vec3, Vec4

BODY_MASS, LOCAL_MASS, SHARED = 0, 1, 2
"""Indices in ``contact_model.CLUMP_RULES``."""


@ti.func
def meet_surface(s: ti.template(), w, k):
    """Normal and overlap [m] of entry ``k`` of the list, whose partner is a surface: (nx, ny, nz, overlap)."""
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

    Of two spheres that neither overlap nor may be held at a gap, only the sign of the overlap is right.
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
    """Whether entry ``k`` may act: its surfaces overlap, or have touched and an effect may still hold them."""
    acts = overlap > 0.0
    if ti.static(s.effects):
        acts = overlap > 0.0 or may_hold(s, w, k)
    return acts


@ti.func
def pliancy(s: ti.template(), w, b, q):
    """Inverse effective mass [1/kg] of body ``b`` along n at the point with arm r; ``q`` = r × n [m]."""
    turned = s.body.rotation[w, b].transpose() @ q
    return s.body.inverse_mass[w, b] + turned.dot(s.body.inverse_inertia[w, b] * turned)


@ti.func
def local_mass(s: ti.template(), w, a, b, point, n):
    """Effective mass [kg] of bodies ``a`` and ``b`` (a wall if negative) at ``point`` along ``n``."""
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
    """Store for every entry the first entry of its pair (its lead), where the sums over the pair are kept."""
    for k in range(s.world.contacts[w]):
        a, b = s.contact.a[w, k], s.contact.b[w, k]
        # The value may be left over from another body or an earlier list; the checks below tell if it is of this pair.
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
    """Sum overlaps, normals and points of touching contacts, by pair, in the first ``entries`` of the live list."""
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
    """Point [m] at which entry ``k`` takes its mass: its own ``point``, or nearer to the mean of those of its pair."""
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
