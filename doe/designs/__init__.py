"""Designs: which combinations of coded factor levels are run. One file per family; a design is an array
(rows, factors), of integers where its levels are.
"""

from doe.designs.box_behnken import box_behnken
from doe.designs.central_composite import central_composite
from doe.designs.factorial import factorial
from doe.designs.plackett_burman import fold_over, interaction_aliases, plackett_burman
from doe.designs.space_filling import latin_hypercube, sobol

__all__ = [
    "box_behnken",
    "central_composite",
    "factorial",
    "fold_over",
    "interaction_aliases",
    "latin_hypercube",
    "plackett_burman",
    "sobol",
]
