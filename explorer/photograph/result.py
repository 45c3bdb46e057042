"""What was read off photographs of piles: as it is in memory, and as ``photograph.json`` keeps it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Self

import numpy as np
from scipy import stats

from doe.provenance import About
from doe.record import Document, Record
from explorer.files.run_result import made_today, versions
from explorer.photograph.simulated import SimulatedPiles
from solver.photograph import Board, PhotographedPile, Refusal
from solver.photograph.reading_error import COVERAGE

MOST_POINTS = 500
"""Of an outline."""
BASES = {
    "plate": "the plate beside the pile",
    "foot": "the foot of the pile",
    "given": "--baseline",
    "support": "the top of what is under the pile",
}


@dataclass(frozen=True)
class OverPictures(Record):
    """Mean angle over ``n`` pictures, SD, and the 95 % interval of the mean (Student's t); NaN below two pictures."""

    n: int
    mean_deg: float
    sd_deg: float
    interval_deg: tuple[float, float]

    @classmethod
    def of(cls, angles_deg: Sequence[float]) -> Self:
        """Over one angle a picture."""
        n = len(angles_deg)
        mean = float(np.mean(angles_deg)) if n else math.nan
        if n < 2:
            return cls(n, mean, math.nan, (math.nan, math.nan))
        sd = float(np.std(angles_deg, ddof=1))
        reach = float(stats.t.ppf(0.975, n - 1)) * sd / math.sqrt(n)
        return cls(n, mean, sd, (mean - reach, mean + reach))

    def __str__(self) -> str:
        low, high = self.interval_deg
        return (
            f"{self.n} pictures: mean {self.mean_deg:.2f}°, SD {self.sd_deg:.2f}°, 95 % {low:.2f} … {high:.2f}° "
            "(Student's t over the pictures)"
        )


@dataclass(frozen=True, eq=False)
class MeasuredPhotographs:
    """What came out, in the order of the pictures."""

    readings: tuple[PhotographedPile | Refusal, ...]
    simulated: SimulatedPiles | None
    board: Board | None = None
    """The checkerboard that told the lens."""
    scale_from: str = ""
    """What told the length of a pixel, in words; empty: nothing."""

    @property
    def piles(self) -> tuple[PhotographedPile, ...]:
        """Of the pictures that show one."""
        return tuple(reading for reading in self.readings if isinstance(reading, PhotographedPile))

    @property
    def refusals(self) -> tuple[Refusal, ...]:
        """Of the others."""
        return tuple(reading for reading in self.readings if isinstance(reading, Refusal))

    @property
    def over_pictures(self) -> OverPictures:
        """Over the piles."""
        return OverPictures.of([pile.angles.mean.value_deg for pile in self.piles])


@dataclass(frozen=True, kw_only=True)
class ReadPile(Record):
    """A pile on a picture; lengths in ``unit`` ("m" or "px"), angles [°], each with half its 95 % interval."""

    name: str
    unit: str
    left: tuple[float, float]
    right: tuple[float, float]
    mean: tuple[float, float]
    height: float
    half_width: float
    u: tuple[float, ...]
    z: tuple[float, ...]
    """The outline over the base line."""
    left_thirds: tuple[float, ...] = ()
    right_thirds: tuple[float, ...] = ()
    """Angles of the lower, the middle and the upper third of the fit [°]."""
    lens: float = 0.0
    """k of the lens that was taken out of the picture; 0: none."""
    checkerboard: str = ""
    """Name of the picture that told the lens; empty: the base line told it."""
    size: tuple[int, int] = (0, 0)
    """Of the picture [px]: columns, rows."""
    pixel: float = 0.0
    """Length of a pixel in ``unit``."""
    scale_from: str = ""
    """What told it, in words."""
    base: tuple[float, float] = (math.nan, math.nan)
    """y of the base line at the left and the right edge of the picture [px]."""
    base_error: float = math.nan
    """Standard error of its height [px]."""
    base_from: str = ""
    """What the base line was found by, in words."""
    parts: dict[str, float] = field(default_factory=dict)
    """Source → its standard error of the mean angle [°]."""


@dataclass(frozen=True, kw_only=True)
class PhotographResult(Document):
    """What was read off photographs: the content of ``photograph.json``. ``refused``: picture → why it has no angle."""

    SCHEMA: ClassVar[int] = 1
    NAME: ClassVar[str] = "photograph.json"

    kind: str = "photograph"
    piles: tuple[ReadPile, ...]
    refused: dict[str, str]
    versions: dict[str, str | None]
    about: About = field(default_factory=About)
    simulated: str = ""
    """What was poured beside it, if anything."""
    kept: bool | None = None
    """Whether the names are those of pictures kept as a target (`target.py`); None in a record of before."""

    @property
    def over_pictures(self) -> OverPictures:
        """Over the piles."""
        return OverPictures.of([pile.mean[0] for pile in self.piles])


def photograph_result(measured: MeasuredPhotographs, author: str, notes: str) -> PhotographResult:
    """The record of what was measured."""
    return PhotographResult(
        piles=tuple(_read(one, measured) for one in measured.piles),
        refused={one.name: f"{one.reason}: {one.detail}" for one in measured.refusals},
        versions=versions(),
        about=made_today(author, notes),
        simulated=measured.simulated.source if measured.simulated else "",
        kept=False,
    )


def _read(pile: PhotographedPile, measured: MeasuredPhotographs) -> ReadPile:
    step = max(1, -(-pile.outline.u.size // MOST_POINTS))
    left, right, mean = (
        (one.value_deg, COVERAGE * one.error_deg) for one in (pile.angles.left, pile.angles.right, pile.angles.mean)
    )
    return ReadPile(
        name=pile.name,
        unit=pile.unit,
        left=left,
        right=right,
        mean=mean,
        height=pile.height,
        half_width=pile.half_width,
        u=tuple(pile.outline.u[::step].tolist()),
        z=tuple(pile.outline.top[::step].tolist()),
        left_thirds=pile.angles.left.thirds_deg,
        right_thirds=pile.angles.right.thirds_deg,
        lens=pile.lens,
        checkerboard="" if measured.board is None else measured.board.name,
        size=pile.size,
        pixel=pile.pixel,
        scale_from=measured.scale_from,
        base=pile.base_ends,
        base_error=pile.base.offset_error,
        base_from=BASES[pile.base.kind],
        parts=dict(pile.angles.mean.parts_deg),
    )
