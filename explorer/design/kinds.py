"""Names that the command line offers: designs, axial points, orders of the model."""

from __future__ import annotations

from enum import StrEnum


class Kind(StrEnum):
    """The designs."""

    PLACKETT_BURMAN = "plackett-burman"
    BOX_BEHNKEN = "box-behnken"
    CENTRAL_COMPOSITE = "central-composite"
    FACTORIAL = "factorial"
    LHS = "lhs"
    SOBOL = "sobol"


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
