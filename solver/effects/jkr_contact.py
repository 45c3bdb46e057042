"""The contact of two adhesive elastic spheres (Johnson, Kendall & Roberts 1971).

    overlap     δ = a²/R* − √(2π w a/E*)
    force       F = 4 E* a³/(3 R*) − √(8π w E* a³)          tensile where negative

w is the work of adhesion [J/m²] (twice the surface energy of one surface). Surfaces meet at δ = 0 and separate at the
largest gap that the contact bridges, δ = −3 a_c²/R* with a_c = (2π w R*²/(16 E*))^⅓. The pull-off force is
3/2 π w R*, the largest tension before separation; the Coulomb limit adds twice this force (Thornton 1991, Journal of
Physics D 24:1942: μ (F + 2 F_c)). Damping is that of a Hertzian contact with the same overlap: none at a gap.

In terms of x = √a the overlap is the convex polynomial x⁴/R* − k x with k = √(2π w/E*); its right branch is the stable
one. A contact moves little in a step, so Newton's method from the last radius finds x in two or three iterations of one
division each, and separation is tested on cubes: a step takes no other roots than square roots.
"""

import math

from solver.effects.kernel import kernel_function, ti

CLOSE = 1e-7
"""Relative step at which Newton's method ends: the next one would be about its square."""
ITERATIONS = 60
"""Largest number of iterations; close to separation, where the root is a double one, each only halves the error."""


@kernel_function
def pulls(k, reduced_radius, overlap):
    """Whether the contact still holds: δ > −3 a_c²/R*, where a_c³ = (k R*/4)²."""
    gap = ti.max(0.0, -overlap * reduced_radius)
    least = 0.25 * k * reduced_radius
    return gap * gap * gap < 27.0 * least * least * least * least


@kernel_function
def root(k, reduced_radius, overlap, before):
    """x = √a [√m] on the stable branch of x⁴/R* − k x = δ; ``before`` is the last contact radius [m], or 0.

    Started to the right of the polynomial's minimum, Newton's method overshoots at most once, to the right. If the last
    radius is not there (first step, or a parameter was changed), it starts at (k R*)^⅓ + (R* δ₊)^¼, beyond the root.
    """
    curvature = 1.0 / reduced_radius
    x = ti.sqrt(before)
    if 4.0 * x * x * x * curvature <= k:
        x = (k * reduced_radius) ** (1.0 / 3.0) + ti.sqrt(ti.sqrt(reduced_radius * ti.max(0.0, overlap)))
    left = ITERATIONS
    while left > 0:
        cube = x * x * x * curvature
        move = (x * (cube - k) - overlap) / (4.0 * cube - k)
        x -= move
        left -= 1
        if ti.abs(move) <= CLOSE * x:
            left = 0
    return x


@kernel_function
def adhere(w, c):
    """Make contact ``c`` adhesive with the work of adhesion ``w`` [J/m²], in addition to that which it already has.

    In terms of x = √a the force is E* x³ (4 x³/(3 R*) − 2 k). Surfaces that a liquid bridge holds at a gap do not count
    as touching.
    """
    c.work += w
    k = ti.sqrt(2.0 * math.pi * c.work / c.e_star)
    if (c.overlap > 0.0 or c.before > 0.0) and pulls(k, c.reduced_radius, c.overlap):
        x = root(k, c.reduced_radius, c.overlap, c.before)
        cube = x * x * x
        force = c.e_star * cube * (4.0 / 3.0 * cube / c.reduced_radius - 2.0 * k)
        # Only the difference to the whole elastic force is added, so changes to the Hertzian force by earlier stages
        # remain, as does this contact's share of it. Adhesion, like a bridge, is not shared, and persists at a gap.
        c.elastic += force - c.adhesive
        c.adhesive = force
        pull_off = 1.5 * math.pi * c.work * c.reduced_radius
        more = pull_off - c.pull_off
        c.pull += 2.0 * more
        c.floor -= more
        c.pull_off = pull_off
        c.radius = x * x
        c.held = 1
    return c


def grip(w: float, e_star: float, reduced_radius: float) -> float:
    """Gap [m] at which surfaces separate, 3 a_c²/R*."""
    least = (2.0 * math.pi * w * reduced_radius**2 / (16.0 * e_star)) ** (1.0 / 3.0)
    return 3.0 * least**2 / reduced_radius
