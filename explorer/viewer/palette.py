"""Colours of the page. Bodies: Okabe & Ito (2008), told apart with every common form of colour blindness."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Colour = tuple[int, int, int]

BODY_COLOURS: tuple[Colour, ...] = (
    (230, 159, 0),  # orange
    (86, 180, 233),  # sky blue
    (0, 158, 115),  # bluish green
    (240, 228, 66),  # yellow
    (204, 121, 167),  # reddish purple
    (213, 94, 0),  # vermilion
    (0, 114, 178),  # blue
)
GLASS: Colour = (190, 210, 225)
RIM: Colour = (150, 170, 185)
PLATE: Colour = (74, 82, 92)
RING: Colour = (110, 122, 135)
BRAND: Colour = (86, 150, 200)

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
"""Ten even steps of viridis (van der Walt & Smith 2015): its lightness alone tells the order."""
SELECTED: Colour = (255, 255, 255)
CHAINS: tuple[Colour, ...] = ((150, 190, 230), (240, 228, 66), (213, 94, 0))
"""Lines of weak, middling and strong contacts; their thickness tells them apart as well."""

SRGB_GAMMA = 2.2

ANGLE_LINE = "rgb(230, 159, 0)"
ANGLE_SPREAD_LINE = "rgba(230, 159, 0, 0.45)"
ANGLE_SPREAD_BAND = "rgba(230, 159, 0, 0.18)"
MASS_LINE = "rgb(86, 180, 233)"
ENERGY_LINE = "rgb(204, 121, 167)"
CONTACTS_LINE = "rgb(0, 158, 115)"
MARK_LINE = "rgb(213, 94, 0)"
FLANK: Colour = (230, 159, 0)
MEASURED: Colour = (204, 121, 167)
AXIS_TEXT = "#9aa4ae"
GRID_LINE = "rgba(160, 170, 180, 0.15)"


def linear(colour: Colour) -> Colour:
    """The colour as viser 1.1.1 wants it for batched meshes: it takes those numbers as linear light, not as sRGB."""
    red, green, blue = (round(255.0 * (channel / 255.0) ** SRGB_GAMMA) for channel in colour)
    return red, green, blue


def css(colour: Colour) -> str:
    """The colour as CSS writes it."""
    return f"rgb({colour[0]}, {colour[1]}, {colour[2]})"


def linear_all(colours: npt.NDArray[np.float64]) -> npt.NDArray[np.uint8]:
    """:func:`linear` of many colours, shape (n, 3)."""
    return np.rint(255.0 * (colours / 255.0) ** SRGB_GAMMA).astype(np.uint8)


def mapped(share: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Colours of viridis (0 … 255, sRGB) for shares of a range, 0 … 1 (what is beyond has its end), shape (n, 3)."""
    stops = np.linspace(0.0, 1.0, len(VIRIDIS))
    channels = np.array(VIRIDIS, dtype=float).T
    return np.column_stack([np.interp(share, stops, channel) for channel in channels])
