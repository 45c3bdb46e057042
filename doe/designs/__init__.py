"""Designs: which combinations of coded factor levels are run. One file per family (``design.py`` says how to add one);
a design is an array of shape (rows, factors), of integers if its levels are integers.
"""

from doe.designs.box_behnken import BoxBehnken, box_behnken
from doe.designs.central_composite import CentralComposite, central_composite
from doe.designs.definitive_screening import DefinitiveScreening, definitive_screening
from doe.designs.design import ALPHAS, ChosenDesign, Design, DesignOptions, Points, factor_letters
from doe.designs.factorial import Factorial, factorial
from doe.designs.mixture import Mixture
from doe.designs.morris import Morris, morris
from doe.designs.optimal import DOptimal, IOptimal
from doe.designs.plackett_burman import PlackettBurman, fold_over, interaction_aliases, plackett_burman
from doe.designs.space_filling import LatinHypercube, Sobol, latin_hypercube, sobol
from solver import Registry, instance_of

DESIGNS: Registry[Design] = Registry(
    "design",
    (
        PlackettBurman(),
        DefinitiveScreening(),
        BoxBehnken(),
        CentralComposite(),
        Factorial(),
        DOptimal(),
        IOptimal(),
        Mixture(),
        LatinHypercube(),
        Sobol(),
        Morris(),
    ),
    instance_of(Design),
)

__all__ = [
    "ALPHAS",
    "DESIGNS",
    "BoxBehnken",
    "ChosenDesign",
    "Design",
    "DesignOptions",
    "PlackettBurman",
    "Points",
    "box_behnken",
    "central_composite",
    "definitive_screening",
    "factor_letters",
    "factorial",
    "fold_over",
    "interaction_aliases",
    "latin_hypercube",
    "morris",
    "plackett_burman",
    "sobol",
]
