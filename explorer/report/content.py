"""What a report consists of. Sections are built once from a result; HTML and Markdown render the same ones.

Text may hold code spans between backticks; everything else in it is plain and is escaped by the renderers.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

Spec = dict[str, Any]
"""A chart as plotly reads it: {"data": [traces], "layout": {…}}, plain JSON types."""


@dataclass(frozen=True)
class Text:
    """One paragraph."""

    text: str


@dataclass(frozen=True)
class Caution:
    """A sentence without which a reader could take a number for more than it is."""

    text: str


@dataclass(frozen=True)
class Facts:
    """Pairs of (what, value), read at a glance."""

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
    """A chart with its caption. ``name`` is its id on the page; Markdown leaves it out."""

    name: str
    spec: Spec
    caption: str


@dataclass(frozen=True)
class Folded:
    """Blocks that a reader opens when wanted."""

    title: str
    blocks: tuple[Block, ...]


Block = Text | Caution | Facts | Bullets | Code | Table | Figure | Folded


@dataclass(frozen=True)
class Section:
    """A heading and what stands under it."""

    title: str
    blocks: tuple[Block, ...]
