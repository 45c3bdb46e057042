"""Why a picture gives no angle: a name and a sentence, in place of a number."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Reason(StrEnum):
    """What a picture lacks."""

    BLANK = "blank"
    NO_CLEAR_SILHOUETTE = "no clear silhouette"
    TOO_SMALL = "too small"
    CUT_BY_FRAME = "cut by the frame"
    TWO_PILES = "two piles"
    TILTED_CAMERA = "tilted camera"
    CAMERA_LOOKS_DOWN = "camera looks down"
    NO_FLANK = "no flank"
    NO_SCALE = "no reference length"


@dataclass(frozen=True)
class Refusal:
    """A picture that is not taken for a pile."""

    name: str
    """Of the picture."""
    reason: Reason
    detail: str
    """One sentence: what was seen, and what would help."""


class NotAPile(Exception):
    """Ends the reading of a picture; :func:`~solver.photograph.read.read_photograph` makes it a :class:`Refusal`."""

    def __init__(self, reason: Reason, detail: str) -> None:
        super().__init__(f"{reason}: {detail}")
        self.reason, self.detail = reason, detail
