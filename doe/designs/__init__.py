"""Designs: which combinations of coded factor levels are run. One file per family; a design is an integer
array.
"""

from doe.designs.box_behnken import box_behnken
from doe.designs.plackett_burman import fold_over, interaction_aliases, plackett_burman

__all__ = ["box_behnken", "fold_over", "interaction_aliases", "plackett_burman"]
