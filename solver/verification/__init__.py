"""Verification: the solver beside closed forms, conservation laws and the benchmark of Chung & Ooi (2011).

``verify()`` runs it and yields the rows of the table; one file per family. What they say stands in README.md here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from solver import backend
from solver.verification import (
    conservation,
    discretisation,
    friction,
    hertz,
    micro_slip,
    oblique,
    restitution,
    spinning,
    two_spheres,
)
from solver.verification.row import Row

Family = Callable[[], Iterator[Row]]

FAMILIES: dict[str, tuple[Family, ...]] = {
    "T1": (hertz.t1,),
    "T2": (hertz.t2,),
    "T3": (restitution.t3,),
    "T4": (oblique.t4, oblique.t4_conventions),
    "T5": (micro_slip.t5, micro_slip.t5_conventions),
    "T6": (spinning.t6, spinning.t6_elastic),
    "T7": (two_spheres.t7,),
    "T8": (two_spheres.t8,),
    "restitution": (restitution.table,),
    "momentum": (conservation.momentum,),
    "energy": (conservation.energy,),
    "tumbling": (conservation.tumbling,),
    "rolling": (friction.rolling,),
    "slider": (friction.slider,),
    "slope": (friction.slope,),
    "halving": (discretisation.halving,),
    "coincident": (discretisation.coincident,),
}
"""What ``verify`` can select, in the order of the table."""


def verify(only: Sequence[str] = tuple(FAMILIES)) -> Iterator[Row]:
    """Rows of the families named in ``only``, each as soon as it is known."""
    backend.init()
    for name in only:
        for family in FAMILIES[name]:
            yield from family()


__all__ = ["FAMILIES", "Row", "verify"]
