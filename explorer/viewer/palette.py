"""Colours of the page: of components, of lines, of charts.

The colours of bodies and lines start from Okabe & Ito (2008). Some of their seven are too similar (two of them 16 apart
in CIELAB for tritanopes), and two are too pale for lines on white. They are shifted as little as necessary: any two can
be told apart with every common form of colour blindness, and lines are visible on a light and on a dark page (a test
checks both).
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Colour = tuple[int, int, int]

BODY_COLOURS: tuple[Colour, ...] = (
    (234, 151, 0),  # orange
    (65, 197, 255),  # sky blue
    (39, 154, 107),  # bluish green
    (255, 245, 79),  # yellow
    (197, 122, 170),  # reddish purple
    (197, 83, 0),  # vermilion
    (16, 91, 151),  # blue
)

GLASS: Colour = (190, 210, 225)

RIM: Colour = (150, 170, 185)

PLATE: Colour = (74, 82, 92)

RING: Colour = (110, 122, 135)

TEXT: Colour = (214, 221, 228)
"""Text on the plate."""

BRAND, BRAND_ON_WHITE = (86, 150, 200), (31, 110, 165)
"""Buttons and selected items, on a dark and on a light page: contrast at least 4.5 : 1 as text on either."""

VIRIDIS: tuple[Colour, ...] = (
    (68, 1, 84),
    (72, 40, 120),
    (62, 73, 137),
    (49, 104, 142),
    (38, 130, 142),
    (31, 158, 137),
    (53, 183, 121),
    (110, 206, 88),
    (181, 222, 43),
    (253, 231, 37),
)
"""Ten even steps of viridis (van der Walt & Smith 2015): its lightness alone shows the order."""

SELECTED: Colour = (255, 255, 255)

STILL: Colour = (206, 210, 214)
"""Bodies for which a coloured quantity says nothing: at rest, without contact."""

CORE: Colour = (255, 255, 255)

HALO: Colour = (16, 18, 22)
"""Rim of the lines in the scene, which makes them visible against bodies, plate and page, dark or light."""

SRGB_GAMMA = 2.2

FLANK: Colour = (220, 140, 2)

MEASURED: Colour = (182, 119, 160)

ANGLE_LINE = "rgb(220, 140, 2)"

ANGLE_SPREAD_LINE = "rgba(220, 140, 2, 0.45)"

ANGLE_SPREAD_BAND = "rgba(220, 140, 2, 0.18)"

MASS_LINE = "rgb(46, 166, 234)"

ENERGY_LINE = "rgb(182, 119, 160)"

CONTACTS_LINE = "rgb(3, 120, 79)"

MARK_LINE = "rgb(178, 66, 0)"

AXIS_TEXT = "#9aa4ae"

GRID_LINE = "rgba(160, 170, 180, 0.15)"

DARK = True
"""Whether the page is dark at first."""


def component_colour(k: int) -> Colour:
    """Colour of component ``k`` of a mixture."""
    return BODY_COLOURS[k % len(BODY_COLOURS)]


def linear(colour: Colour) -> Colour:
    """The colour for batched meshes in viser 1.1.1, which takes those numbers as linear light, not as sRGB."""
    red, green, blue = (round(255.0 * (channel / 255.0) ** SRGB_GAMMA) for channel in colour)
    return red, green, blue


def css(colour: Colour) -> str:
    """The colour in CSS notation."""
    return f"rgb({colour[0]}, {colour[1]}, {colour[2]})"


def linear_all(colours: npt.NDArray[np.float64]) -> npt.NDArray[np.uint8]:
    """:func:`linear` of many colours, shape (n, 3)."""
    return np.rint(255.0 * (colours / 255.0) ** SRGB_GAMMA).astype(np.uint8)


def mapped(share: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Colours of viridis (0 … 255, sRGB) for shares of a range, clipped to 0 … 1, shape (n, 3)."""
    stops = np.linspace(0.0, 1.0, len(VIRIDIS))
    channels = np.array(VIRIDIS, dtype=float).T
    return np.column_stack([np.interp(share, stops, channel) for channel in channels])
