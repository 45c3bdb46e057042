"""The contact of two adhesive elastic spheres (Johnson, Kendall & Roberts 1971).

    overlap     δ = a²/R* − √(2π w a/E*)
    force       F = 4 E* a³/(3 R*) − √(8π w E* a³)          tensile where negative

w is the work of adhesion [J/m²] (twice the surface energy of one surface). Surfaces meet at δ = 0 and part at the
largest distance that the contact bridges, δ = −3 a_c²/R* with a_c = (2π w R*²/(16 E*))^⅓. The pull-off force is
3/2 π w R*, the largest tension on the way; it is what the Coulomb limit takes twice (Thornton 1991, Journal of
Physics D 24:1942: μ (F + 2 F_c)). Damping is that of the Hertzian contact of the same overlap: none at a gap.
"""

import math

from solver.effects.kernel import kernel_function, ti


@kernel_function
def parting_radius(w, e_star, reduced_radius):
    """a_c [m], the contact radius at which the surfaces part: (2π w R*²/(16 E*))^⅓."""
    return (math.pi * w * reduced_radius * reduced_radius / (8.0 * e_star)) ** (1.0 / 3.0)


@kernel_function
def root(d):
    """y = √(a/a_c) on the stable branch for the overlap d ≥ −3 in units of a_c²/R*: y⁴ − 4 y = d.

    Ferrari: the resolvent is m³ + d m − 2 = 0, and y = ½ (√(2m) + √(4 √(2/m) − 2m)). Cardano's root m cancels for
    large d; two Newton steps mend it.
    """
    u = (1.0 + ti.sqrt(ti.max(0.0, 1.0 + d * d * d / 27.0))) ** (1.0 / 3.0)
    m = u - d / (3.0 * u)
    for _ in ti.static(range(2)):
        m = (2.0 * m * m * m + 2.0) / (3.0 * m * m + d)
    return 0.5 * (ti.sqrt(2.0 * m) + ti.sqrt(ti.max(0.0, 4.0 * ti.sqrt(2.0 / m) - 2.0 * m)))


@kernel_function
def adhere(w, c):
    """Let contact ``c`` be adhesive with the work of adhesion ``w`` [J/m²], in addition to what it has already.

    In terms of y the force is π w R* y³ (y³/6 − 1).
    """
    c.work += w
    least = parting_radius(c.work, c.e_star, c.reduced_radius)
    d = c.overlap * c.reduced_radius / (least * least)
    if d > -3.0:
        y = root(d)
        cube = y * y * y
        force = math.pi * c.work * c.reduced_radius * cube * (cube / 6.0 - 1.0)
        # What earlier stages have made of the Hertzian force stays beside the adhesive one.
        c.elastic += force - c.adhesive
        c.adhesive = force
        pull_off = 1.5 * math.pi * w * c.reduced_radius
        c.pull += 2.0 * pull_off
        c.floor -= pull_off
        c.radius = least * y * y
        c.held = 1
    return c


def grip(w: float, e_star: float, reduced_radius: float) -> float:
    """Distance [m] at which surfaces part, 3 a_c²/R*."""
    least = (2.0 * math.pi * w * reduced_radius**2 / (16.0 * e_star)) ** (1.0 / 3.0)
    return 3.0 * least**2 / reduced_radius
