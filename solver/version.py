"""The versions of what a pour does and of how member spheres are fitted: raised by hand, held to by golden bits."""

PHYSICS = 3
"""Raise it with every change to the bits of any pour, and never otherwise: it is part of every stored pour's key.
A change that only pours with one effect see raises that effect's ``revision`` instead, and theirs alone are anew.

The golden bits are those of short pours of every contact law, effect, rig, shape and batch size. Their test fails
where bits change under the same number, and where the number is raised while every bit stays as it was. After raising
it, `make golden` records the new bits.
"""

FITTING = 1
"""Raise it with every change to the member spheres that are fitted to a solid: fits are kept under it, and shipped.

Such a change is one of the physics as well. Then `make golden` records the bits and fits the shipped bodies anew.
"""
