"""The parts of a report. It is built once from a typed result; HTML, Markdown and the files beside it render it.

Text may hold code spans between backticks; everything else in it is plain, and the renderers escape it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from doe.provenance import About

Spec = dict[str, Any]
"""A chart in plotly's form: {"data": [traces], "layout": {…}}, plain JSON types."""


class Word(StrEnum):
    """The verdicts of all reports. Every report begins with one of them."""

    CALIBRATED = "CALIBRATED WITHIN"
    NOT_CALIBRATED = "NOT CALIBRATED"
    OUT_OF_REACH = "OUT OF REACH"
    TARGET_REACHED = "TARGET REACHED"
    EFFECT_FOUND = "EFFECT FOUND"
    NO_EFFECT = "NO EFFECT FOUND"
    NOTHING_MISSING = "NOTHING MISSING"
    UNEXPLAINED = "UNEXPLAINED"
    NO_ANSWER = "NO ANSWER"
    MEASURED = "MEASURED"
    REPRODUCED = "REPRODUCED"
    DIFFERS = "DIFFERS"
    REFUSED = "REFUSED"
    PLANNED = "PLANNED"

    @property
    def tone(self) -> str:
        """ "good", "bad" or "open": the colour of the banner, which says no more than the word."""
        if self in (Word.NOT_CALIBRATED, Word.OUT_OF_REACH, Word.UNEXPLAINED, Word.DIFFERS, Word.REFUSED):
            return "bad"
        return "open" if self in (Word.NO_ANSWER, Word.NO_EFFECT) else "good"


@dataclass(frozen=True)
class Banner:
    """The verdict: its word with an addition ("± 1.50°"), one sentence on why, and one on what to do next."""

    word: Word
    of: str
    why: str
    then: str

    @property
    def headline(self) -> str:
        """The word with its addition."""
        return f"{self.word} {self.of}".strip()


class Strong(str):
    """A cell that is the answer among the others of its row."""

    __slots__ = ()


class Struck(str):
    """A cell whose number is not valid: it is struck out."""

    __slots__ = ()


@dataclass(frozen=True)
class Text:
    """One paragraph."""

    text: str


@dataclass(frozen=True)
class Caution:
    """A sentence that keeps the reader from overrating a number."""

    text: str


@dataclass(frozen=True)
class Facts:
    """Pairs of (what, value), to be read at a glance."""

    pairs: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Bullets:
    """A list of sentences or names."""

    items: tuple[str, ...]


@dataclass(frozen=True)
class Code:
    """Lines to type into a terminal."""

    text: str


@dataclass(frozen=True)
class Table:
    """A table; every row has as many cells as ``header``."""

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    caption: str = ""


@dataclass(frozen=True)
class Figure:
    """A chart. ``name`` is its id on the page, ``caption`` gives what is drawn, n and method; Markdown omits it."""

    name: str
    spec: Spec
    caption: str


@dataclass(frozen=True)
class Drawing:
    """A line drawing: ``svg`` is a complete element made by this program, ``alt`` says in words what it shows."""

    name: str
    svg: str
    alt: str
    caption: str


@dataclass(frozen=True)
class Picture:
    """A photograph, or a drawing over one, as PNG."""

    name: str
    png: bytes
    alt: str
    caption: str


@dataclass(frozen=True)
class Folded:
    """Blocks that the reader can unfold."""

    title: str
    blocks: tuple[Block, ...]


Block = Text | Caution | Facts | Bullets | Code | Table | Figure | Drawing | Picture | Folded
Shown = Figure | Drawing | Picture
"""Blocks that are numbered: "Figure 3."."""


@dataclass(frozen=True)
class Section:
    """A heading and the blocks under it."""

    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class DataTable:
    """A table of plain data, written as ``NAME.csv``; numbers are in SI or in the unit in the column's name."""

    name: str
    header: tuple[str, ...]
    rows: tuple[tuple[str | float | int | None, ...], ...]


@dataclass(frozen=True)
class Reference:
    """A source that the methods cite. ``key``: as in BibTeX; ``kind``: "article", "book", "software", …"""

    key: str
    kind: str
    fields: Mapping[str, str]


@dataclass(frozen=True)
class Report:
    """A complete report; ``about``: who, when, and notes."""

    title: str
    subtitle: str
    banner: Banner | None
    sections: tuple[Section, ...]
    about: About = field(default_factory=About)
    data: tuple[DataTable, ...] = ()
    references: tuple[Reference, ...] = ()

    @property
    def shown(self) -> dict[str, Shown]:
        """Figures, drawings and pictures by name, in the order of their numbers."""
        return {block.name: block for section in self.sections for block in shown_in(section.blocks)}


def shown_in(blocks: Iterable[Block]) -> Iterator[Shown]:
    """The numbered ones among ``blocks``, in order, folded ones included."""
    for block in blocks:
        if isinstance(block, Folded):
            yield from shown_in(block.blocks)
        elif isinstance(block, Figure | Drawing | Picture):
            yield block
