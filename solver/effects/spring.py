"""Springs that a contact carries along: turned with its normal, capped in length."""

from solver.effects.kernel import kernel_function, ti


@kernel_function
def turned_with(spring, n):
    """``spring`` laid into the plane across the new normal ``n``, with its length kept."""
    flat = spring - spring.dot(n) * n
    length2, flat2 = spring.dot(spring), flat.dot(flat)
    scale = 0.0
    if flat2 > 0.0:
        scale = ti.sqrt(length2 / flat2)
    return scale * flat


@kernel_function
def capped(vector, limit):
    """``vector``, shortened to the length ``limit`` if it is longer."""
    length2 = vector.dot(vector)
    scale = 1.0
    if length2 > limit * limit:
        scale = limit / ti.sqrt(length2)
    return scale * vector
