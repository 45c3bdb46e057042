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
from solver.verification.impacts import OURS_BY_DISPLACEMENT, Engine
from solver.verification.row import Row

Family = Callable[[], Iterator[Row]]

FAMILIES: dict[str, tuple[Family, ...]] = {
    "T1": (hertz.t1,),
    "T2": (hertz.t2,),
    "T3": (restitution.t3,),
    "T4": (oblique.t4, oblique.t4_law, oblique.t4_conventions, oblique.t4_experiment),
    "T5": (micro_slip.t5, micro_slip.t5_law, micro_slip.t5_conventions, micro_slip.t5_elements),
    "T6": (spinning.t6, spinning.t6_law, spinning.t6_elastic),
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

BY_ANY_ENGINE: dict[str, tuple[Callable[[Engine], Iterator[Row]], ...]] = {
    "T4": (oblique.t4, oblique.t4_experiment),
    "T5": (micro_slip.t5, micro_slip.t5_elements),
    "T6": (spinning.t6,),
    "T8": (two_spheres.t8,),
}
"""The families of which another engine can run the same impacts: those whose reference is a curve of another code."""


def verify(only: Sequence[str] = tuple(FAMILIES)) -> Iterator[Row]:
    """Rows of the families named in ``only``, each as soon as it is known."""
    backend.init()
    for name in only:
        for family in FAMILIES[name]:
            yield from family()


def verify_engine(engine: Engine, only: Sequence[str] = tuple(BY_ANY_ENGINE)) -> Iterator[Row]:
    """Rows of ``verify`` with the numbers of another engine in place of ours; same test, quantity and point.

    Parameters
    ----------
    engine
        What runs the impacts: another program, or the solver under another law.
    only
        Names of ``BY_ANY_ENGINE``.

    Returns
    -------
    Each row as soon as it is known; ``Row.ours`` is the engine's number.
    """
    for name in only:
        for family in BY_ANY_ENGINE[name]:
            yield from family(engine)


__all__ = ["BY_ANY_ENGINE", "FAMILIES", "OURS_BY_DISPLACEMENT", "Engine", "Row", "verify", "verify_engine"]
