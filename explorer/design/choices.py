"""Names that the command line of a design offers: axial points, orders of the model.

In a file without NumPy, so that `--help` does not wait for it.
"""

from enum import StrEnum


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
