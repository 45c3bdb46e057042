"""What a person marks in a photograph: where the plate is, and the ends of a length that he knows."""

from __future__ import annotations

import math
from dataclasses import dataclass

from explorer.errors import CommandError

Point = tuple[float, float]
"""x and y in the picture [px]: to the right and down, (0, 0) the middle of the top left pixel."""
LEAST_APART = 20.0
"""Distance of two marks [px], below which a click's own error decides."""
LONGEST_MM = 10_000.0


@dataclass(frozen=True)
class Marks:
    """Marks in one photograph, in its pixels; None for what is left to be found."""

    base_line: tuple[float, float] | None = None
    """y of the plate at the left and the right edge of the picture."""
    ends: tuple[float, float, float, float] | None = None
    """x, y of one end of a known length and x, y of the other."""
    length_mm: float | None = None
    """That length."""

    def __bool__(self) -> bool:
        return self != UNMARKED

    @property
    def base_line_text(self) -> str:
        """What `explorer measure --baseline` takes."""
        return "auto" if self.base_line is None else _text(self.base_line)

    @property
    def ends_text(self) -> str | None:
        """What `explorer measure --reference` takes."""
        return None if self.ends is None else _text(self.ends)

    @property
    def words(self) -> list[str]:
        """Options of `explorer measure` that say the same."""
        words = [] if self.base_line is None else ["--baseline", self.base_line_text]
        return words if self.ends_text is None else [*words, "--reference", self.ends_text]


UNMARKED = Marks()


def base_line_through(one: Point, other: Point, width: int) -> tuple[float, float]:
    """The line through two points, as y at both edges of a picture of ``width`` [px].

    Raises CommandError for points too near to each other, or above one another.
    """
    if abs(one[0] - other[0]) < LEAST_APART:
        raise CommandError(f"base line: its points are less than {LEAST_APART:g} px apart; mark both ends of the plate")
    slope = (other[1] - one[1]) / (other[0] - one[0])
    return one[1] - slope * one[0], one[1] + slope * (width - 1 - one[0])


def known_length(one: Point, other: Point, length_mm: float | None) -> Marks:
    """A length between two points. Raises CommandError where it is not said, or they are too near to each other."""
    if math.dist(one, other) < LEAST_APART:
        raise CommandError(f"known length: its ends are less than {LEAST_APART:g} px apart; mark both ends")
    if length_mm is None or not 0.0 < length_mm <= LONGEST_MM:
        raise CommandError(f"known length: enter it; allowed: above 0 up to {LONGEST_MM:g} mm")
    return Marks(ends=(*one, *other), length_mm=length_mm)


def _text(numbers: tuple[float, ...]) -> str:
    return ",".join(f"{number:.1f}" for number in numbers)
