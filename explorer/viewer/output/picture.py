"""A picture of the scene for a paper: at a multiple of the screen's size, with a scale bar and a key."""

from __future__ import annotations

import io
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import viser
from PIL import Image, ImageDraw, ImageFont

from explorer.errors import CommandError
from explorer.viewer.actions import BackgroundWork, Post
from explorer.viewer.look.colour_by import ColourKey, written
from explorer.viewer.look.look_settings import one_of
from explorer.viewer.output.send_file import send_file
from explorer.viewer.palette import CORE, HALO, STILL, Colour, mapped

LARGEST_PICTURE = (4320, 7680)
"""Largest height and width [pixels]."""
RENDER_WAIT = 60.0
"""Seconds that a browser has to draw a picture."""
SIZES: Mapping[str, int] = {"1×": 1, "2×": 2, "4×": 4}
"""Multiples of the size that a browser shows."""
DARK_GROUND, WHITE_GROUND, NO_GROUND = "dark", "white", "transparent"
GROUNDS: Mapping[str, tuple[int, int, int, int]] = {
    DARK_GROUND: (20, 20, 20, 255),
    WHITE_GROUND: (255, 255, 255, 255),
    NO_GROUND: (255, 255, 255, 0),
}
"""What is behind the scene, RGBA."""
INK: Mapping[str, tuple[Colour, Colour]] = {
    DARK_GROUND: (CORE, HALO),
    WHITE_GROUND: (HALO, CORE),
    NO_GROUND: (HALO, CORE),
}
"""Colour of text on each background, and of its rim: the plate, which is dark, may be behind it."""
TEXT = 15
"""Height of letters [pixels at 1×]; other lengths are multiples of it."""
BAR_SHARE = 0.25
"""Largest share of the width that a scale bar takes."""
NICE = (5.0, 2.0, 1.0)


@dataclass(frozen=True)
class Legend:
    """What is explained in a picture."""

    components: Sequence[tuple[str, Colour]] = ()
    """Name and colour of each component, if bodies are coloured by component."""
    colours: ColourKey | None = None
    """The key, if bodies are coloured by a quantity."""
    strongest: float | None = None
    """Force [mN] of the thickest lines, if force chains are drawn."""


def rendered(client: Any, scale: int) -> npt.NDArray[np.uint8]:
    """The scene as ``client`` sees it, ``scale`` times as large, as RGBA; raises CommandError if it is not drawn."""
    height, width = scale * client.camera.image_height, scale * client.camera.image_width
    if height < 1 or width < 1:
        raise CommandError("picture: the browser has not sent its size yet")
    shrink = min(1.0, LARGEST_PICTURE[0] / height, LARGEST_PICTURE[1] / width)
    try:
        pixels: npt.NDArray[np.uint8] = client.get_render(
            round(shrink * height), round(shrink * width), transport_format="png", timeout=RENDER_WAIT
        )
    # The picture comes from a browser, and its reader raises errors of many kinds.
    except Exception as error:
        raise CommandError(f"picture: the browser did not draw it: {' '.join(str(error).split())[:120]}") from None
    if pixels.dtype != np.uint8 or pixels.ndim != 3 or pixels.shape[2] != 4:
        raise CommandError("picture: the browser did not draw it in colours with transparency")
    return pixels


def pixels_per_metre(camera: Any, height: int) -> float:
    """For a picture ``height`` pixels high, across the view at the distance of the middle of the plate."""
    forward = np.asarray(camera.look_at, dtype=np.float64) - camera.position
    forward /= np.linalg.norm(forward)
    distance = float(-np.asarray(camera.position, dtype=np.float64) @ forward)
    if distance <= 0.0:
        raise CommandError("picture: the camera looks away from the pile")
    return height / (2.0 * math.tan(0.5 * camera.fov) * distance)


def bar_length(per_metre: float, width: int) -> float:
    """Length of the scale bar [m]: 1, 2 or 5 times a power of ten, as long as ``BAR_SHARE`` of ``width`` allows."""
    most = BAR_SHARE * width / per_metre
    decade = 10.0 ** math.floor(math.log10(most))
    return next(nice * decade for nice in NICE if nice * decade <= most * (1.0 + 1e-9))


def length_words(length: float) -> str:
    """A length [m] in words."""
    units = ((1.0, "m"), (1e2, "cm"), (1e3, "mm"), (1e6, "µm"))
    return next((f"{length * per:g} {unit}" for per, unit in units if length * per >= 1.0 - 1e-9), f"{length:g} m")


def composed(pixels: npt.NDArray[np.uint8], ground: str, per_metre: float, legend: Legend, unit: float) -> bytes:
    """``pixels`` (RGBA) on a ``ground``, with scale bar and key, as PNG; ``unit``: pixels per screen pixel."""
    image = Image.new("RGBA", (pixels.shape[1], pixels.shape[0]), GROUNDS[ground])
    image.alpha_composite(Image.fromarray(pixels, "RGBA"))
    sheet = Sheet(image, *INK[ground], unit * TEXT)
    sheet.scale_bar(per_metre)
    sheet.key(legend)
    made = io.BytesIO()
    (image if ground == NO_GROUND else image.convert("RGB")).save(made, "PNG", dpi=(96.0 * unit, 96.0 * unit))
    return made.getvalue()


class Sheet:
    """Draws onto ``image`` in the colour ``ink`` with a ``rim``, letters ``size`` pixels high."""

    def __init__(self, image: Image.Image, ink: Colour, rim: Colour, size: float) -> None:
        self._image, self._ink, self._rim, self._size = image, ink, rim, size
        self._draw, self._font = ImageDraw.Draw(image), ImageFont.load_default(size)

    def scale_bar(self, per_metre: float) -> None:
        """Draw the scale bar in the lower left corner."""
        length, size = bar_length(per_metre, self._image.width), self._size
        left, foot = 1.5 * size, self._image.height - 1.5 * size
        right = left + length * per_metre
        rim = 0.12 * size
        self._draw.rectangle((left - rim, foot - 0.3 * size - rim, right + rim, foot + rim), fill=self._rim)
        self._draw.rectangle((left, foot - 0.3 * size, right, foot), fill=self._ink)
        self._write((0.5 * (left + right), foot - 0.6 * size), length_words(length), "mb")

    def key(self, legend: Legend) -> None:
        """Draw the key in the upper right corner: components, or the colours of a quantity; thickness of lines."""
        size = self._size
        wide = max([12.0 * size, *(self._font.getlength(name) + 2.0 * size for name, _ in legend.components)])
        left, top = self._image.width - 1.5 * size - wide, 1.5 * size
        for name, colour in legend.components:
            self._entry(left, top, name, colour)
            top += 1.6 * size
        if legend.colours is not None:
            key = legend.colours
            strip = np.tile(
                np.rint(mapped(np.linspace(0.0, 1.0, round(wide)))).astype(np.uint8), (round(0.9 * size), 1, 1)
            )
            self._image.paste(Image.fromarray(strip, "RGB"), (round(left), round(top)))
            top = self._numbers(left, top + 1.2 * size, wide, key.numbers, key.title)
            if key.still:
                self._entry(left, top, key.still, STILL)
                top += 1.6 * size
        if legend.strongest is not None:
            middle = top + 0.5 * size
            wedge = [(left, middle), (left + wide, middle - 0.4 * size), (left + wide, middle + 0.4 * size)]
            self._draw.polygon(wedge, fill=self._ink)
            self._numbers(left, top + 1.2 * size, wide, (0.0, 0.5 * legend.strongest, legend.strongest), "force [mN]")

    def _entry(self, left: float, top: float, words: str, colour: Colour) -> None:
        size = self._size
        box = (left, top + 0.1 * size, left + 0.9 * size, top + size)
        self._draw.rectangle(box, fill=colour, outline=self._ink, width=max(1, round(0.06 * size)))
        self._write((left + 1.5 * size, top + 0.55 * size), words, "lm")

    def _write(self, place: tuple[float, float], words: str, anchor: str) -> None:
        rim = max(1, round(0.12 * self._size))
        self._draw.text(place, words, self._ink, self._font, anchor, stroke_width=rim, stroke_fill=self._rim)

    def _numbers(self, left: float, top: float, wide: float, numbers: Sequence[float], title: str) -> float:
        """Draw numbers and a title below a bar; returns where the next entry begins."""
        for share, anchor, number in zip((0.0, 0.5, 1.0), ("la", "ma", "ra"), numbers, strict=True):
            self._write((left + share * wide, top), written(number), anchor)
        self._write((left, top + 1.3 * self._size), title, "la")
        return top + 3.2 * self._size


class PicturePanel:
    """Size, background and button; a click in a browser makes a picture of what that browser shows.

    Args:
        gui: where the controls go.
        post: where actions go.
        background: where pictures are made.
        name: returns the name of the file.
        legend: returns what is to be explained.
    """

    def __init__(
        self,
        gui: viser.GuiApi,
        post: Post,
        background: BackgroundWork,
        name: Callable[[], str],
        legend: Callable[[], Legend],
    ) -> None:
        self._background, self._name, self._legend = background, name, legend
        self._size = gui.add_dropdown("Picture size", tuple(SIZES), hint="As a multiple of what this browser shows.")
        self._ground = gui.add_dropdown("Picture background", tuple(GROUNDS), hint="White, or none, for a paper.")
        self.button = gui.add_button(
            "Picture (PNG)", hint="The scene as this browser shows it, with a scale bar and a key, without the panels."
        )

        @self.button.on_click
        def _(event: viser.GuiEvent[Any]) -> None:
            if event.client is not None:
                client = event.client
                post(lambda: self._take(client))

    def _take(self, client: Any) -> None:
        scale = SIZES[one_of(self._size.value, tuple(SIZES), "picture size")]
        ground = one_of(self._ground.value, tuple(GROUNDS), "picture background")
        name, legend = self._name(), self._legend()
        self._background.start(
            "taking the picture",
            lambda: picture(client, scale, ground, legend),
            lambda made: send_file(client, name, made),
        )


def picture(client: Any, scale: int, ground: str, legend: Legend) -> bytes:
    """What ``client`` sees, ``scale`` times as large, on ``ground``, with scale bar and key, as PNG."""
    pixels = rendered(client, scale)
    unit = pixels.shape[0] / client.camera.image_height
    return composed(pixels, ground, pixels_per_metre(client.camera, pixels.shape[0]), legend, unit)
