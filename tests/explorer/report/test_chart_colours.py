"""Colours of charts and bodies: told apart with each common form of colour blindness; charts seen on both pages."""

import re
from itertools import combinations

import numpy as np
import pytest

from explorer.report.figures.style import ASSUMPTION, CHOSEN, DUMMY, FACTOR, TARGET
from explorer.viewer import palette


def written(colour):
    """A colour of the page, a tuple or in CSS, as the report writes it; how clear it is does not count."""
    channels = re.findall(r"\d+", colour)[:3] if isinstance(colour, str) else colour
    return "#" + "".join(f"{int(channel):02x}" for channel in channels)


REPORT = (FACTOR, ASSUMPTION, DUMMY, TARGET, CHOSEN)
LIVE = tuple(
    map(
        written,
        (palette.ANGLE_LINE, palette.MASS_LINE, palette.ENERGY_LINE, palette.CONTACTS_LINE, palette.MARK_LINE),
    )
)
OUTLINES = (written(palette.FLANK), written(palette.MEASURED))
BODIES = tuple(map(written, palette.BODY_COLOURS))
TOGETHER = {"report": REPORT, "live charts": LIVE, "outlines": OUTLINES, "bodies": BODIES}
"""What may be seen side by side."""
# Machado, Oliveira and Fernandes 2009, IEEE Trans. Vis. Comput. Graph. 15:1291, severity 1, on linear RGB.
SEEN_BY = {
    "everybody": np.eye(3),
    "protanopes": [
        [0.152286, 1.052583, -0.204868],
        [0.114503, 0.786281, 0.099216],
        [-0.003882, -0.048116, 1.051998],
    ],
    "deuteranopes": [
        [0.367322, 0.860646, -0.227968],
        [0.280085, 0.672501, 0.047413],
        [-0.011820, 0.042940, 0.968881],
    ],
    "tritanopes": [
        [1.255528, -0.076749, -0.178779],
        [-0.078411, 0.930809, 0.147602],
        [0.004733, 0.691367, 0.303900],
    ],
}
# IEC 61966-2-1, sRGB to CIE XYZ (D65).
XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)
WHITE = np.array([0.95047, 1.0, 1.08883])
PAGES = ("#ffffff", "#fdfcfa", "#191b1e", "#1a1b1e")
"""Light and dark: of the report, and of viser."""
BOARD = ("#fbfaf8", "#272b30")
"""Ground of a board and its cards, light and dark."""


def linear(colour):
    values = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255.0
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def lab(light):
    """CIE 1976 L*a*b* of linear RGB."""
    ratio = XYZ @ np.clip(light, 0.0, 1.0) / WHITE
    f = np.where(ratio > 216 / 24389, np.cbrt(ratio), (24389 / 27 * ratio + 16) / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("people", SEEN_BY)
@pytest.mark.parametrize("place", TOGETHER)
def test_any_two_colours_are_told_apart(place, people):
    seen = [lab(np.array(SEEN_BY[people]) @ linear(colour)) for colour in TOGETHER[place]]
    # ΔE of 2.3 is just noticeable; ten times that is clear also on thin lines and small marks.
    assert min(np.linalg.norm(a - b) for a, b in combinations(seen, 2)) > 23.0


@pytest.mark.parametrize("page", PAGES)
@pytest.mark.parametrize("place", [place for place in TOGETHER if place != "bodies"])
def test_every_line_is_seen_on_light_and_dark(place, page):
    for colour in TOGETHER[place]:
        dark, light = sorted(float(XYZ[1] @ linear(one)) for one in (colour, page))
        # WCAG 2.1 asks for 3 for charts; one palette for both pages can hold 2.6.
        assert (light + 0.05) / (dark + 0.05) > 2.6, colour


@pytest.mark.parametrize("page", (*PAGES, *BOARD))
def test_every_chart_of_a_report_has_the_contrast_of_wcag(page):
    for colour in REPORT:
        dark, light = sorted(float(XYZ[1] @ linear(one)) for one in (colour, page))
        assert (light + 0.05) / (dark + 0.05) >= 3.0, colour


def test_the_spread_has_the_colour_of_its_angle():
    spreads = (palette.ANGLE_SPREAD_LINE, palette.ANGLE_SPREAD_BAND)
    assert {written(colour) for colour in spreads} == {written(palette.ANGLE_LINE)}
