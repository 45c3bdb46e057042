"""Names that the command line offers: axial points, orders of the model. Loads nothing, for help is made from it."""

from enum import StrEnum


class Alpha(StrEnum):
    """Where the axial points of a central composite design stand."""

    ROTATABLE = "rotatable"
    FACE_CENTRED = "face-centred"
    INSCRIBED = "inscribed"


class ModelOrder(StrEnum):
    """Orders of the polynomial."""

    LINEAR = "linear"
    INTERACTIONS = "interactions"
    QUADRATIC = "quadratic"
