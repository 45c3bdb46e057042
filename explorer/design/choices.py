"""What the command line of a design and the page offer: axial points, orders of the model, limits of numbers.

This file does without NumPy, so that `--help` does not wait for its import.
"""

from collections.abc import Mapping
from enum import StrEnum

FEWEST: Mapping[str, int] = {
    "runs": 2, "replicates": 1, "centre": 0, "blocks": 2, "fraction": 0, "lattice": 1, "seed": 0,
}  # fmt: skip
"""Field of a ``DesignOrder`` → its smallest whole number."""
MOST: Mapping[str, int] = {"replicates": 1000, "centre": 1000, "blocks": 512, "lattice": 50}
"""Field → its largest whole number, if that does not depend on the design."""


class Alpha(StrEnum):
    """Where the axial points of a central composite design stand."""

    ROTATABLE = "rotatable"
    FACE_CENTRED = "face-centred"
    INSCRIBED = "inscribed"


class Reduction(StrEnum):
    """Rules by which terms are dropped from a polynomial."""

    AICC = "aicc"
    P = "p"


class Surrogate(StrEnum):
    """Models without terms that are set beside the polynomial."""

    GP = "gp"


class ModelOrder(StrEnum):
    """Orders of the polynomial."""

    LINEAR = "linear"
    INTERACTIONS = "interactions"
    QUADRATIC = "quadratic"
