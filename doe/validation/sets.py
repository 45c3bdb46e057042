"""``sets.csv``: one row per data set, appended as it is judged, and what an answer is worth.

right        the effect's name; or ambiguous with it, where all signatures that are named have a cosine above 0.9 to it
undecided    ambiguous with the truth in it, but the others do look different
wrong        another name, or ambiguous without the truth
unexplained  more than noise, and no name
nothing      no missing effect
"""

import csv
import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Literal

Answer = Literal["right", "undecided", "wrong", "unexplained", "nothing", "out of reach"]

ALIKE = 0.9
"""Cosine of signatures above which nobody could tell two effects apart."""
OUT_OF_REACH = "out of reach: "
"""Start of the verdict on a truth that cannot be, followed by the reason."""


@dataclass(frozen=True)
class Row:
    """One data set."""

    number: int
    """Seed of the set: it gives truth and pours."""
    kind: str
    label: str
    """Name of what is true: library effect, "a+b", outside effect, or "none"."""
    strength: float
    """Shift that was asked for [σ]; NaN where none was."""
    amplitude: str
    """Of the truth's library effects, natural units."""
    shift: float
    """Shift of the measured means [σ], freed from noise."""
    verdict: str
    p_detect: float
    """Smaller p of the two tests of gate 1."""
    cosine: float
    """Least cosine of the truth's signature and the named ones."""
    before: float
    """Holdout error ÷ noise floor of the calibrated base model; NaN unless the name is right."""
    after: float
    """The same of the named model."""
    pours: int
    seconds: float

    @property
    def answer(self) -> Answer:
        """What the verdict is worth."""
        return answer_to(self.verdict, self.label, self.cosine)


def answer_to(verdict: str, label: str, cosine: float) -> Answer:
    """What ``verdict`` is worth where ``label`` is true, see above."""
    if verdict.startswith(OUT_OF_REACH):
        return "out of reach"
    kind, _, named = verdict.partition(":")
    names = {frozenset(name.split("+")) for name in named.split(",")}
    truth = frozenset(label.split("+"))
    if kind == "no_missing_effect":
        return "nothing"
    if kind == "unexplained":
        return "unexplained"
    if kind in ("effect", "effects"):
        return "right" if names == {truth} else "wrong"
    if truth not in names:
        return "wrong"
    return "right" if cosine > ALIKE else "undecided"


def read_rows(path: Path) -> list[Row]:
    """Rows in ``path``, in order of their numbers; none where there is no such file."""
    if not path.is_file():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        rows = [_row(cells) for cells in csv.DictReader(file)]
    return sorted(rows, key=lambda row: row.number)


def append_row(path: Path, row: Row) -> None:
    """Add ``row`` to the file, which is begun with a header."""
    names = [field.name for field in fields(Row)]
    begun = path.is_file()
    with path.open("a", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        if not begun:
            writer.writerow(names)
        writer.writerow([_cell(getattr(row, name)) for name in names])


def _cell(value: object) -> str:
    if isinstance(value, float):
        return "" if math.isnan(value) else f"{value:.6g}"
    return str(value)


def _row(cells: dict[str, str]) -> Row:
    kinds: dict[str, Callable[[str], object]] = {"int": int, "float": lambda text: float(text or "nan"), "str": str}
    values: dict[str, Any] = {
        field.name: kinds[getattr(field.type, "__name__", str(field.type))](cells[field.name]) for field in fields(Row)
    }
    return Row(**values)
