"""The photograph to read, for clicking two points of the base line and both ends of a known length."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

from explorer.errors import CommandError
from explorer.photograph.marks import UNMARKED, Marks, Point, base_line_through, known_length
from explorer.viewer.actions import Post
from explorer.viewer.tables.table_server import TablePage, done_by
from solver.assets import asset_path
from solver.photograph import Picture, open_picture

if TYPE_CHECKING:
    from nicegui.events import MouseEventArguments

TITLE = "Marks in the photograph"
BASE, LENGTH = "Base line", "Known length"
HOW = (
    "Click two points of what is marked: two of the plate beside the pile, or both ends of a length that you know. "
    "What is not marked is found by the program. Two more clicks mark it anew."
)
TAKEN = "Taken for {}: now Read the angle."
MOST_SHOWN = 1800
"""Longest side of the picture as it is shown [px]; clicks are reported in pixels of the picture itself."""
COLOURS = {BASE: "#e69f00", LENGTH: "#56b4e9"}


@dataclass
class PhotographInHand:
    """The photograph to read: ``chosen`` returns its file or name, ``take`` receives the marks that a person made."""

    chosen: Callable[[], str]
    take: Callable[[str, Marks], None]


@dataclass
class Clicks:
    """Clicked points of a picture of ``width`` [px], by what they mark; at most two each.

    ``across``, ``down``: pixels of the picture per pixel that is shown.
    """

    width: int
    across: float = 1.0
    down: float = 1.0
    points: dict[str, list[Point]] = field(default_factory=lambda: {BASE: [], LENGTH: []})

    def add(self, what: str, x: float, y: float) -> None:
        """Add a point, measured from the top left corner of what is shown; the third point starts over."""
        point = (x * self.across - 0.5, y * self.down - 0.5)
        before = self.points[what]
        self.points[what] = [point] if len(before) == 2 else [*before, point]

    def marks(self, length_mm: float | None) -> Marks:
        """The marks that two points each define. Raises CommandError if one of two points is missing."""
        for what, points in self.points.items():
            if len(points) == 1:
                raise CommandError(f"{what.lower()}: one point is marked; click the other one")
        marks = UNMARKED
        if ends := self.points[LENGTH]:
            marks = known_length(ends[0], ends[1], length_mm)
        if base := self.points[BASE]:
            marks = replace(marks, base_line=base_line_through(base[0], base[1], self.width))
        return marks

    def drawn(self) -> str:
        """The points and the lines between them, as SVG for the picture that is shown."""
        shapes = []
        for what, points in self.points.items():
            places = [((x + 0.5) / self.across, (y + 0.5) / self.down) for x, y in points]
            style = f'stroke="{COLOURS[what]}" stroke-width="2" fill="none"'
            shapes += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="6" {style} />' for x, y in places]
            if len(places) == 2:
                (x0, y0), (x1, y1) = places
                shapes.append(f'<line x1="{x0:.1f}" y1="{y0:.1f}" x2="{x1:.1f}" y2="{y1:.1f}" {style} />')
        return "".join(shapes)


def marks_page(in_hand: PhotographInHand, post: Post) -> TablePage:
    """The page for marking the photograph in hand."""
    return TablePage("photograph", TITLE, lambda: _build(in_hand, post))


def _build(in_hand: PhotographInHand, post: Post) -> None:
    from nicegui import ui

    photo = in_hand.chosen()
    try:
        path = asset_path("photographs", photo)
        address, clicks = shown_picture(open_picture(path))
    except (ValueError, OSError) as error:
        ui.label(str(error)).props("role=alert")
        return
    ui.label(f"{TITLE}: {path.name}").classes("text-h6").props("role=heading aria-level=1")
    ui.label(HOW)
    with ui.row().classes("items-center"):
        what = ui.toggle([BASE, LENGTH], value=BASE).props("no-caps")
        length = ui.number(f"{LENGTH} [mm]", min=0.0, step=0.1)

    def clicked(event: MouseEventArguments) -> None:
        clicks.add(what.value, event.image_x, event.image_y)
        picture.content = clicks.drawn()

    picture = ui.interactive_image(address, on_mouse=clicked, events=["mousedown"], cross=True)
    picture.style("max-height: calc(100vh - 17rem)")
    told = ui.label("").props("role=status")

    async def use() -> None:
        try:
            marks = clicks.marks(length.value)
        except CommandError as error:
            told.text = str(error)
            return
        told.text = await done_by(post, lambda: in_hand.take(photo, marks)) or TAKEN.format(path.name)

    ui.button("Use these marks", on_click=use).props("no-caps")


def shown_picture(picture: Picture) -> tuple[str, Clicks]:
    """A photograph as the program sees it, scaled down to the size shown, as a data URL, and the clicks in it."""
    shown = Image.fromarray(np.clip(np.rint(picture.grey), 0, 255).astype(np.uint8))
    across, down = shown.width * picture.reduced, shown.height * picture.reduced
    shown.thumbnail((MOST_SHOWN, MOST_SHOWN))
    file = io.BytesIO()
    shown.save(file, "JPEG", quality=90)
    address = "data:image/jpeg;base64," + base64.b64encode(file.getvalue()).decode()
    return address, Clicks(picture.width, across / shown.width, down / shown.height)
