"""The contact of two adhesive elastic spheres (Johnson, Kendall & Roberts 1971).

    overlap     δ = a²/R* − √(2π w a/E*)
    force       F = 4 E* a³/(3 R*) − √(8π w E* a³)          tensile where negative

w is the work of adhesion [J/m²] (twice the surface energy of one surface). Surfaces meet at δ = 0 and part at the
largest tension that a controlled distance allows, δ = −3 a_c²/R* with a_c = (2π w R*²/(16 E*))^⅓. The pull-off force is
3/2 π w R*, the tension at δ where the contact carries no load; it is what the Coulomb limit takes twice
(Thornton 1991, Journal of Physics D 24:1942: μ (F + 2 F_c)).
"""

import math

from solver.effects.kernel import kernel_function, ti

ITERATIONS = 6
"""Of Newton's method; the function is convex and the start is right of the root, so it only comes closer."""


@kernel_function
def contact_radius(w, e_star, reduced_radius, overlap):
    """Contact radius a [m] on the stable branch, for overlaps above −:func:`grip`."""
    lift = ti.sqrt(2.0 * math.pi * w / e_star)
    least = (lift * reduced_radius / 4.0) ** (2.0 / 3.0)
    a = (lift * reduced_radius) ** (2.0 / 3.0) + ti.sqrt(reduced_radius * ti.max(0.0, overlap))
    for _ in range(ITERATIONS):
        root = ti.sqrt(a)
        excess = a * a / reduced_radius - lift * root - overlap
        slope = 2.0 * a / reduced_radius - 0.5 * lift / root
        if slope > 0.0:
            a = ti.max(least, a - excess / slope)
    return a


@kernel_function
def adhere(w, c):
    """Let contact ``c`` be adhesive with the work of adhesion ``w`` [J/m²]."""
    least = (2.0 * math.pi * w * c.reduced_radius**2 / (16.0 * c.e_star)) ** (1.0 / 3.0)
    if c.overlap > -3.0 * least * least / c.reduced_radius:
        a = contact_radius(w, c.e_star, c.reduced_radius, c.overlap)
        hertz = 4.0 / 3.0 * c.e_star * c.radius * ti.max(0.0, c.overlap)
        # What earlier stages have made of the Hertzian force is kept beside the adhesive one.
        force = 4.0 * c.e_star * a**3 / (3.0 * c.reduced_radius) - ti.sqrt(8.0 * math.pi * w * c.e_star * a**3)
        c.elastic += force - hertz
        pull_off = 1.5 * math.pi * w * c.reduced_radius
        c.pull += 2.0 * pull_off
        c.floor -= pull_off
        c.radius = a
        c.held = 1
    return c


def grip(w: float, e_star: float, reduced_radius: float) -> float:
    """Distance [m] at which surfaces part, 3 a_c²/R*."""
    least = (2.0 * math.pi * w * reduced_radius**2 / (16.0 * e_star)) ** (1.0 / 3.0)
    return 3.0 * least**2 / reduced_radius
