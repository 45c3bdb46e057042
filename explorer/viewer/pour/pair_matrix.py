"""The matrix of one parameter of all pairs of materials: the solver's present values, and a box for every pair.

viser has no table of inputs: a row of the lower triangle is a vector of up to three boxes, and a longer row takes
several vectors.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from html import escape
from typing import Any

import viser

from explorer.units import InputError, checked, quantity, screen_unit, title
from explorer.viewer.actions import Post, SharedBox
from explorer.viewer.pour.live_sliders import LINEAR_STEP, Apply, screen_range
from explorer.viewer.view import small_html
from solver.params import Parameter, declared
from solver.scenes.material import Pair
from solver.scenes.scene import Scene, value

BOXES = 3
"""Most boxes in a row: viser's longest vector."""


class PairMatrix:
    """The matrix of the parameter ``name``, in a folder of its own on the page."""

    def __init__(self, gui: viser.GuiApi, scene: Scene, name: str, post: Post, apply: Apply) -> None:
        self._name, self._apply = name, apply
        self._parameter = declared(Pair, "pair")[f"pair.{name}"]
        with gui.add_folder(f"{title(self._parameter)} of every pair (acts now)", expand_by_default=False):
            self._table = gui.add_html(matrix_html(scene, self._parameter, name))
            self._rows = [self._row(gui, scene, one, others) for one, others in triangle(scene)]
        for row in self._rows:
            row.box.listen(post, partial(self._take, row))

    def follow(self, scene: Scene) -> None:
        """Show the solver's values, except in a row that a person is editing."""
        html = matrix_html(scene, self._parameter, self._name)
        if self._table.content != html:
            self._table.content = html
        for row in self._rows:
            numbers = self._numbers(scene, row.paths)
            if row.box.held() or entries(row.box.value) == numbers:
                continue
            row.shown = numbers
            row.box.show(numbers if len(numbers) > 1 else numbers[0])

    def _row(self, gui: viser.GuiApi, scene: Scene, one: str, others: tuple[str, ...]) -> PairRow:
        paths = tuple(f"pair.{one}.{other}.{self._name}" for other in others)
        numbers, (low, high) = self._numbers(scene, paths), screen_range(self._parameter)
        hint = f"{one} with {', '.join(others)}. {self._parameter.doc}"
        if len(numbers) == 1:
            number = gui.add_number(one, numbers[0], min=low, max=high, step=LINEAR_STEP, hint=hint)
            return PairRow(SharedBox(number), paths, numbers)
        add: Any = gui.add_vector2 if len(numbers) == 2 else gui.add_vector3
        ends = {"min": (low,) * len(numbers), "max": (high,) * len(numbers)}
        return PairRow(SharedBox(add(one, numbers, **ends, step=LINEAR_STEP, hint=hint)), paths, numbers)

    def _numbers(self, scene: Scene, paths: tuple[str, ...]) -> tuple[float, ...]:
        return tuple(screen_unit(self._parameter).to_screen(float(value(scene, path))) for path in paths)

    def _take(self, row: PairRow, sent: object) -> None:
        """Set those pairs of a row whose number has changed."""
        low, high = screen_range(self._parameter)
        numbers = tuple(checked(number, low, high, title(self._parameter)) for number in entries(sent))
        if len(numbers) != len(row.paths):
            raise InputError(f"{title(self._parameter)}: {len(row.paths)} numbers are needed, not {len(numbers)}")
        unit = screen_unit(self._parameter)
        found = zip(row.paths, numbers, row.shown, strict=True)
        changed: dict[str, float | str] = {path: unit.to_si(new) for path, new, old in found if new != old}
        row.shown = numbers
        if changed:
            self._apply(changed)


@dataclass
class PairRow:
    """Boxes for the pairs of one material with some others."""

    box: SharedBox
    paths: tuple[str, ...]
    shown: tuple[float, ...]
    """What the boxes showed last, in the unit on the screen."""


def pair_parameters() -> tuple[str, ...]:
    """Names of the live parameters of pairs, each with a matrix of its own."""
    return tuple(path.partition(".")[2] for path, parameter in declared(Pair, "pair").items() if parameter.live)


def entries(sent: object) -> tuple[Any, ...]:
    """The values of one box or of several boxes, as a tuple."""
    return tuple(sent) if isinstance(sent, (tuple, list)) else (sent,)


def names_in_pairs(scene: Scene) -> tuple[str, ...]:
    """Materials (or bodies) that pairs name, in order of appearance."""
    return tuple(dict.fromkeys(name for pair in scene.pairs for name in (pair.a, pair.b)))


def triangle(scene: Scene) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Rows of the lower triangle: a name, and up to ``BOXES`` names that it has a pair with; no pair is left out."""
    names = names_in_pairs(scene)
    for k, one in enumerate(names):
        others = [other for other in names[: k + 1] if _pair(scene, one, other) is not None]
        for first in range(0, len(others), BOXES):
            yield one, tuple(others[first : first + BOXES])


def matrix_html(scene: Scene, parameter: Parameter, name: str) -> str:
    """The whole matrix with the solver's values; a dash where there is no such pair."""
    names = names_in_pairs(scene)
    style = "style='padding:0 0.5em; text-align:right; font-variant-numeric:tabular-nums'"
    head = "".join(f"<th {style}>{escape(other)}</th>" for other in names)
    rows = []
    for one in names:
        pairs = (_pair(scene, one, other) for other in names)
        cells = ("–" if pair is None else quantity(getattr(pair, name), parameter.unit) for pair in pairs)
        rows.append(f"<tr><th {style}>{escape(one)}</th>{''.join(f'<td {style}>{cell}</td>' for cell in cells)}</tr>")
    table = f"<table><tr><th></th>{head}</tr>{''.join(rows)}</table>"
    return small_html(f"In the solver:<div style='overflow-x:auto; overflow-wrap:normal'>{table}</div>")


def _pair(scene: Scene, one: str, other: str) -> Pair | None:
    return next((pair for pair in scene.pairs if pair.joins(one, other)), None)
