"""A picture file → grey levels, decoded no larger than is needed and never larger than is safe.

Grey is the luma of Rec. 601, 0.299 R + 0.587 G + 0.114 B, of the gamma-coded values, 0 … 255; what is transparent is
white. The orientation that a camera notes beside the picture is applied. Coordinates are those of the picture as it is
then seen: x to the right, y down, in its own pixels, (0, 0) the middle of the top left one.

Where a picture gives no angle, a name and a sentence say why, in place of a number.
"""

from __future__ import annotations

import math
import struct
import warnings
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import ExifTags, Image, UnidentifiedImageError

Grey = npt.NDArray[np.float32]

FORMATS = ("JPEG", "PNG", "TIFF", "BMP", "WEBP")
MOST_PIXELS = 60_000_000
MOST_BYTES = 150_000_000
LEAST_SIDE = 32
LONGEST = 2400
"""Longest side [px] of the grey levels used: more would not improve an angle."""
WHITE = 255.0
SENSOR_BITS = (10, 12, 14, 16)
"""Bits of a grey level that a file of sixteen may hold."""
FILM_DIAGONAL = math.hypot(36.0, 24.0)
"""Diagonal of a frame of 35 mm film [mm]."""
MOST_FOCAL = 5000
"""Longest plausible focal length [mm]."""
ODD_EXIF = (TypeError, AttributeError, KeyError, struct.error)
"""What reading tags of an unexpected type raises."""
TURNS = {
    2: Image.Transpose.FLIP_LEFT_RIGHT,
    3: Image.Transpose.ROTATE_180,
    4: Image.Transpose.FLIP_TOP_BOTTOM,
    5: Image.Transpose.TRANSPOSE,
    6: Image.Transpose.ROTATE_270,
    7: Image.Transpose.TRANSVERSE,
    8: Image.Transpose.ROTATE_90,
}
"""EXIF orientation → what sets the picture upright."""


class PhotographError(ValueError):
    """A picture, or an option about it, that cannot be used; the message is one line."""


@dataclass(frozen=True, eq=False)
class Picture:
    """Grey levels, reduced by a whole number."""

    name: str
    grey: Grey
    """0 … 255, shape (rows, columns), row 0 on top."""
    width: int
    """Width of the picture itself [px]."""
    height: int
    reduced: int
    """Pixels of the picture along a side of one of ``grey``."""
    focal: float | None = None
    """Focal length [px of the picture], if the file gives that of 35 mm film with the same diagonal."""

    def place(self, index: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """Coordinates in the picture of coordinates in ``grey`` (middles of pixels at whole numbers)."""
        return (index + 0.5) * self.reduced - 0.5

    def index(self, place: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """The inverse of :meth:`place`."""
        return (place + 0.5) / self.reduced - 0.5


class Reason(StrEnum):
    """Why a picture gives no reading."""

    BLANK = "blank"
    NO_CLEAR_SILHOUETTE = "no clear silhouette"
    TOO_SMALL = "too small"
    CUT_BY_FRAME = "cut by the frame"
    TWO_PILES = "two piles"
    TILTED_CAMERA = "tilted camera"
    CAMERA_LOOKS_DOWN = "camera looks down"
    NO_FLANK = "no flank"
    BENT_FLANK = "bent flank"
    SUPPORT = "a body under the pile"
    DRAWN = "a drawing"
    NO_SCALE = "no reference length"
    CAMERA_ASLANT = "camera looks aslant"
    NO_DRUM = "no drum"
    NO_SURFACE = "no free surface"


@dataclass(frozen=True)
class Refusal:
    """A picture that gives no reading."""

    name: str
    """Name of the picture."""
    reason: Reason
    detail: str
    """One sentence: what was seen, and what would help."""


class NotAPile(Exception):
    """Ends the reading of a picture of a pile or of a drum; the reader turns it into a :class:`Refusal`."""

    def __init__(self, reason: Reason, detail: str) -> None:
        super().__init__(f"{reason}: {detail}")
        self.reason, self.detail = reason, detail


def open_picture(path: Path) -> Picture:
    """The picture in ``path``; PhotographError for a file that is missing, none of ``FORMATS``, broken or too large."""
    if not path.is_file():
        raise PhotographError(f"{path}: no such file")
    size = path.stat().st_size
    if not 0 < size <= MOST_BYTES:
        raise PhotographError(f"{path}: {size} bytes; allowed: 1 … {MOST_BYTES}")
    try:
        with warnings.catch_warnings():
            # Pillow warns of large pictures and of odd metadata; the limit is checked here, before decoding.
            warnings.simplefilter("ignore")
            with Image.open(path, formats=FORMATS) as image:
                return _decoded(path, image)
    except UnidentifiedImageError:
        raise PhotographError(f"{path}: not a picture; allowed: {', '.join(FORMATS)}") from None
    except Image.DecompressionBombError:
        raise PhotographError(f"{path}: {_too_many()}") from None
    except PhotographError:
        raise
    except (OSError, ValueError, SyntaxError, EOFError, OverflowError, MemoryError, *ODD_EXIF) as error:
        raise PhotographError(f"{path}: cannot be decoded: {' '.join(str(error).split())[:120]}") from None


def _decoded(path: Path, image: Image.Image) -> Picture:
    columns, rows = image.size
    if columns * rows > MOST_PIXELS:
        raise PhotographError(f"{path}: {columns} × {rows} px = {columns * rows / 1e6:.0f} megapixels; {_too_many()}")
    if min(columns, rows) < LEAST_SIDE:
        raise PhotographError(f"{path}: {columns} × {rows} px; allowed: sides of {LEAST_SIDE} px or more")
    reduced = max(1, -(-max(columns, rows) // LONGEST))
    seen = Image.fromarray(_grey(_upright(image), path))
    small = seen.reduce(reduced) if reduced > 1 else seen
    focal = _film_focal(image) * math.hypot(columns, rows) / FILM_DIAGONAL
    return Picture(path.name, np.array(small, dtype=np.float32), seen.width, seen.height, reduced, focal or None)


def _upright(image: Image.Image) -> Image.Image:
    """``image`` as it was held. Only its orientation is read: Pillow's own function writes all of the EXIF anew, and
    fails where a camera has put a text in the place of a number."""
    method = TURNS.get(image.getexif().get(ExifTags.Base.Orientation, 1))
    return image if method is None else image.transpose(method)


def _film_focal(image: Image.Image) -> float:
    """Focal length for 35 mm film that a camera noted beside ``image`` [mm]; 0 where none did."""
    noted = image.getexif().get_ifd(ExifTags.IFD.Exif).get(ExifTags.Base.FocalLengthIn35mmFilm, 0)
    return float(noted) if isinstance(noted, int) and 0 < noted < MOST_FOCAL else 0.0


def _grey(image: Image.Image, path: Path) -> Grey:
    """Grey levels of ``image``, 0 … 255."""
    if image.mode in ("I", "F") or image.mode.startswith("I;"):
        levels = np.array(image, dtype=np.float32)
        if not np.isfinite(levels).all():
            raise PhotographError(f"{path}: a grey level is not finite")
        # Sixteen bits have a known white, that of the sensor that fills fewer of them; other levels are stretched.
        low, high = float(levels.min()), float(levels.max())
        if image.mode.startswith("I;16"):
            low, high = 0.0, next(2.0**bits - 1.0 for bits in SENSOR_BITS if high < 2.0**bits)
        return (levels - low) * np.float32(WHITE / max(high - low, 1e-9))
    if image.mode in ("RGBA", "LA", "PA") or "transparency" in image.info:
        clear = image.convert("RGBA")
        image = Image.alpha_composite(Image.new("RGBA", image.size, "white"), clear)
    return np.array(image.convert("L"), dtype=np.float32)


def _too_many() -> str:
    return f"allowed: up to {MOST_PIXELS // 1_000_000} megapixels; scale the picture down"
