"""`explorer measure`: from options, checked before any picture is opened, to a reading per picture and its files.

Pictures are read, their scale is found, a simulation is put beside them, and what was asked for is drawn.
"""

from __future__ import annotations

import hashlib
import io
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from PIL import Image

from explorer.errors import CommandError
from explorer.files.output_file import check_new_file, write_whole, write_whole_bytes
from explorer.photograph.annotated import MOST_PANELS, sheet
from explorer.photograph.result import MeasuredPhotographs
from explorer.photograph.simulated import simulated_piles
from explorer.units import number
from solver.assets import asset_path
from solver.photograph import (
    Board,
    NotAPile,
    PhotographedPile,
    PhotographError,
    Picture,
    Refusal,
    board_of,
    open_picture,
    read_photograph,
    reference_pixels,
)
from solver.photograph.lens import centred, straight, straightened

FARTHEST = 1e5
"""Largest coordinate that a picture may be asked about [px]."""
MOST_DECODED = 24
"""Pictures that are kept in memory between their check and their reading."""
SAME_SHAPE = 0.01
"""By which the width over the height of two pictures of one camera may differ, relatively."""


@dataclass(frozen=True)
class MeasureOrder:
    """Pictures and options. Lengths [m]."""

    pictures: tuple[Path, ...]
    metres_per_pixel: float | None
    reference_length: float | None
    reference_ends: tuple[float, float, float, float] | None
    """x, y of one end and x, y of the other [px]; None: a bar in the picture."""
    base_line: tuple[float, float] | None
    """y [px] at the left and the right edge of the picture; None: found."""
    plot: Path | None
    outline: Path | None
    simulation: str | None
    checkerboard: Path | None = None
    """Picture of one, by the same camera; None: the base line tells the lens."""


def measure_order(
    photos: list[str],
    scale_mm: float | None,
    reference_mm: float | None,
    reference: str | None,
    baseline: str,
    plot: Path | None,
    outline: Path | None,
    simulation: str | None,
    checkerboard: str | None = None,
) -> MeasureOrder:
    """The order of a command line; CommandError or AssetNotFoundError in one line."""
    _positive(scale_mm, "--scale", "mm/px")
    _positive(reference_mm, "--reference-length", "mm")
    if scale_mm is not None and reference_mm is not None:
        raise CommandError("--scale and --reference-length exclude each other")
    if reference is not None and reference_mm is None:
        raise CommandError("--reference: its length is missing; add --reference-length MM")
    ends = None if reference is None else _numbers(reference, "--reference", "x0,y0,x1,y1")
    if ends is not None and math.dist(ends[:2], ends[2:]) < 2.0:
        raise CommandError(f"--reference {reference}: its ends are less than 2 px apart")
    base = None if baseline == "auto" else _numbers(baseline, "--baseline", "auto or y0,y1")
    if plot is not None:
        check_new_file(plot, suffix=".png")
    if outline is not None:
        check_new_file(outline, suffix=".csv")
        if len(photos) != 1 or (scale_mm is None and reference_mm is None):
            raise CommandError("--outline: needs one picture of known scale; add --scale or --reference-length")
    return MeasureOrder(
        pictures=tuple(asset_path("photographs", name) for name in photos),
        metres_per_pixel=None if scale_mm is None else 1e-3 * scale_mm,
        reference_length=None if reference_mm is None else 1e-3 * reference_mm,
        reference_ends=None if ends is None else (ends[0], ends[1], ends[2], ends[3]),
        base_line=None if base is None else (base[0], base[1]),
        plot=plot,
        outline=outline,
        simulation=simulation,
        checkerboard=None if checkerboard is None else Path(checkerboard),
    )


def _positive(number: float | None, option: str, unit: str) -> None:
    if number is not None and not 0.0 < number < math.inf:
        raise CommandError(f"{option} {number:g} {unit}: must be positive and finite")


def _numbers(text: str, option: str, form: str) -> tuple[float, ...]:
    n = form.rpartition(" ")[2].count(",") + 1
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) != n or not all(abs(number) <= FARTHEST for number in numbers):
        raise CommandError(f"{option} {text}: allowed: {form}, in pixels of the picture")
    return numbers


def run_measure(order: MeasureOrder) -> MeasuredPhotographs:
    """Every picture is opened before the first is measured, so that a bad file ends the command at once.

    Raises PhotographError for a file that is no picture, or no checkerboard, CommandError for a picture that stands
    twice, even in two files (its pile would be counted twice), and whatever the simulated source raises.
    """
    board = None if order.checkerboard is None else board_of(open_picture(order.checkerboard))
    names = _names(order.pictures)
    seen: dict[bytes, Path] = {}
    first: list[Picture] = []
    for path, name in zip(order.pictures, names, strict=True):
        picture = replace(open_picture(path), name=name)
        if (twin := seen.setdefault(hashlib.sha256(picture.grey.tobytes()).digest(), path)) is not path:
            raise CommandError(f"{path}: is the same picture as {twin}; name each pile once")
        if board is not None:
            _check_camera(picture, board)
        # Hundreds of decoded pictures do not fit into memory; a few need not be decoded again.
        first += [picture] if len(first) < MOST_DECODED else []
    rest = order.pictures[len(first) :]
    decoded = (replace(open_picture(path), name=name) for path, name in zip(rest, names[len(first) :], strict=True))
    return MeasuredPhotographs(
        tuple(_reading(picture, order, board) for pictures in (first, decoded) for picture in pictures),
        None if order.simulation is None else simulated_piles(order.simulation),
        board,
        _scale_from(order),
    )


def write_drawings(order: MeasureOrder, measured: MeasuredPhotographs) -> None:
    """Write the files of ``order`` that show what was ``measured``: the pictures with it drawn in, and an outline."""
    if order.plot is not None:
        file = io.BytesIO()
        drawn_sheet(order, measured).save(file, "PNG")
        write_whole_bytes(order.plot, file.getvalue())
    if order.outline is not None and measured.piles:
        write_whole(order.outline, outline_text(measured.piles[0]))


def drawn_sheet(order: MeasureOrder, measured: MeasuredPhotographs, thirds: bool = False) -> Image.Image:
    """The pictures of ``order`` with what was ``measured`` drawn in (:func:`explorer.photograph.annotated.sheet`)."""
    pictures = zip(map(open_picture, order.pictures[:MOST_PANELS]), measured.readings, strict=False)
    return sheet([(replace(one, name=read.name), read) for one, read in pictures], measured, thirds)


def _names(pictures: Sequence[Path]) -> list[str]:
    """File names of ``pictures``, with their folders where two have one name."""
    count = Counter(path.name for path in pictures)
    return [path.name if count[path.name] == 1 else str(path) for path in pictures]


def _scale_from(order: MeasureOrder) -> str:
    """What tells the length of a pixel, in words; empty: nothing."""
    if order.reference_length is None:
        return "" if order.metres_per_pixel is None else "as stated"
    places = "stated places" if order.reference_ends else "the ends of a bar in the picture"
    return f"by {number(1e3 * order.reference_length, 4)} mm between {places}"


def _check_camera(picture: Picture, board: Board) -> None:
    """Raise PhotographError where ``picture`` is of another shape than that of the checkerboard ``board``."""
    if abs(picture.width / picture.height / board.shape - 1.0) > SAME_SHAPE:
        raise PhotographError(
            f"checkerboard {board.name}: {board.shape:.2f} times as wide as high, {picture.name} "
            f"{picture.width / picture.height:.2f} times; allowed: whole pictures of one camera, held alike"
        )


def _reading(picture: Picture, order: MeasureOrder, board: Board | None) -> PhotographedPile | Refusal:
    bend = None if board is None else board.bend
    known = 0.0 if bend is None else bend.k
    try:
        found = read_photograph(picture, _metres_per_pixel(picture, order, known), order.base_line, bend)
        if isinstance(found, Refusal) or order.reference_length is None or found.lens == known:
            return found
        # The base line showed the bend of the lens, which the bar has as well.
        return read_photograph(picture, _metres_per_pixel(picture, order, found.lens), order.base_line, bend)
    except NotAPile as reason:
        return Refusal(picture.name, reason.reason, reason.detail)


def _metres_per_pixel(picture: Picture, order: MeasureOrder, bend: float) -> float | None:
    """Scale of ``picture``, or of its straight copy if the lens has a ``bend``."""
    if order.reference_length is None:
        return order.metres_per_pixel
    if order.reference_ends is None:
        return order.reference_length / reference_pixels(straightened(picture, bend) if bend else picture)
    x, y = np.array(order.reference_ends).reshape(2, 2).T
    u, v, half = centred(x, y, (picture.height, picture.width))
    u, v = straight(u, v, bend)
    return order.reference_length / (half * math.hypot(u[1] - u[0], v[1] - v[0]))


def outline_text(pile: PhotographedPile) -> str:
    """A measured outline as the page lays it over a simulated pile (`explorer/files/measured_curves.py`)."""
    rows = (f"{u:.6g},{z:.6g}\n" for u, z in zip(pile.outline.u, pile.outline.top, strict=True))
    return f"# {' '.join(pile.name.split())}\nu_m,z_m\n" + "".join(rows)
